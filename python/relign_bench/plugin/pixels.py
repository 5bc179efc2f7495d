"""Pixels that an author gives, checked and as bytes."""

import array
import os
import sys


def float32_bytes(pixels, height, width, giver):
    """Rows of float32 in the machine's byte order. `giver` names in errors what gave them: "capture()"."""
    expected = "expected %d rows of %d pixels" % (height, width)
    numpy = sys.modules.get("numpy")  # who has not imported it has no array of it
    if numpy is not None and isinstance(pixels, numpy.ndarray):
        if pixels.shape != (height, width):
            raise ValueError("%s gave an array of shape %r, %s" % (giver, pixels.shape, expected))
        if pixels.dtype.kind not in "fiub":
            raise TypeError("%s gave an array of %s, %s" % (giver, pixels.dtype, expected))
        return pixels.astype(numpy.float32).tobytes()
    try:
        view = memoryview(pixels)
    except TypeError:
        return _rows(pixels, height, width, giver, expected)
    if view.format not in ("f", "B", "b", "c"):
        raise TypeError("%s gave values of the format '%s', expected float32 ('f')" % (giver, view.format))
    if view.nbytes != 4 * height * width:
        raise ValueError(
            "%s gave %d bytes, %s: %d bytes of float32" % (giver, view.nbytes, expected, 4 * height * width)
        )
    return view.tobytes()


def _rows(pixels, height, width, giver, expected):
    try:
        rows = list(pixels)
    except TypeError:
        raise TypeError("%s gave %s, %s" % (giver, type(pixels).__name__, expected)) from None
    if len(rows) != height:
        raise ValueError("%s gave %d rows, %s" % (giver, len(rows), expected))
    values = array.array("f")
    for number, row in enumerate(rows):
        try:
            values.extend(array.array("f", row))
        except TypeError:
            raise TypeError("row %d of %s is no list of numbers, %s" % (number, giver, expected)) from None
        if len(values) != (number + 1) * width:
            raise ValueError(
                "row %d of %s has %d pixels, %s" % (number, giver, len(values) - number * width, expected)
            )
    return values.tobytes()


class ImageFile:
    """The host's file for pixels. It is empty before each request for an image."""

    def __init__(self, path):
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CLOEXEC)

    def write(self, data):
        write_all(self._descriptor, memoryview(data), 0)


def write_all(descriptor, data, offset):
    """`data`, a memoryview of bytes, to an open file from byte `offset` on."""
    written = 0
    while written < len(data):
        written += os.pwrite(descriptor, data[written:], offset + written)
