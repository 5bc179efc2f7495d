"""Pixels that a plugin returns: checked, and as bytes."""

from __future__ import annotations

import array
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def float32_bytes(pixels: Any, height: int, width: int, giver: str) -> bytes:
    """Pixels as rows of float32 in the machine's byte order.

    Args:
        pixels: A 2-D numpy array, rows of numbers, or float32 values behind the buffer protocol.
        height: Rows expected.
        width: Columns expected.
        giver: What returned the pixels, for error messages: "capture()".

    Raises:
        TypeError: The pixels have another type.
        ValueError: The pixels have another shape.
    """
    expected = f"expected {height} rows of {width} pixels"
    numpy = sys.modules.get("numpy")  # without the import there is no array of it
    if numpy is not None and isinstance(pixels, numpy.ndarray):
        if pixels.shape != (height, width):
            raise ValueError(f"{giver} returned an array of shape {pixels.shape!r}, {expected}")
        if pixels.dtype.kind not in "fiub":
            raise TypeError(f"{giver} returned an array of {pixels.dtype}, {expected}")
        return pixels.astype(numpy.float32).tobytes()
    try:
        view = memoryview(pixels)
    except TypeError:
        return _rows(pixels, height, width, giver, expected)
    if view.format not in ("f", "B", "b", "c"):
        raise TypeError(f"{giver} returned values of the format '{view.format}', expected float32 ('f')")
    if view.nbytes != 4 * height * width:
        raise ValueError(f"{giver} returned {view.nbytes} bytes, {expected}: {4 * height * width} bytes of float32")
    return view.tobytes()


def readings_bytes(values: Any, count: int, giver: str) -> bytes:
    """Readings as float32 in the machine's byte order.

    Raises:
        TypeError: They are not a list of numbers, or a 1-D numpy array.
        ValueError: They are more or fewer than `count`.
    """
    expected = f"expected {count} reading" + ("s" if count > 1 else "")
    try:
        found = array.array("f", values)
    except TypeError:
        raise TypeError(f"{giver} returned {type(values).__name__}, {expected} as a list of numbers") from None
    if len(found) != count:
        raise ValueError(f"{giver} returned {len(found)} readings, {expected}")
    return found.tobytes()


def _rows(pixels: Any, height: int, width: int, giver: str, expected: str) -> bytes:
    try:
        rows = list(pixels)
    except TypeError:
        raise TypeError(f"{giver} returned {type(pixels).__name__}, {expected}") from None
    if len(rows) != height:
        raise ValueError(f"{giver} returned {len(rows)} rows, {expected}")
    values = array.array("f")
    for number, row in enumerate(rows):
        try:
            values.extend(array.array("f", row))
        except TypeError:
            raise TypeError(f"row {number} of {giver} is not a list of numbers, {expected}") from None
        if len(values) != (number + 1) * width:
            raise ValueError(f"row {number} of {giver} has {len(values) - number * width} pixels, {expected}")
    return values.tobytes()


class ImageFile:
    """The host's file for pixels; the host empties it before each request for an image."""

    def __init__(self, path: str) -> None:
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CLOEXEC)

    def write(self, data: bytes) -> None:
        """Writes the pixels."""
        write_all(self._descriptor, memoryview(data), 0)


def write_all(descriptor: int, data: memoryview, offset: int) -> None:
    """Writes all bytes of `data` to an open file, beginning at byte `offset`."""
    written = 0
    while written < len(data):
        written += os.pwrite(descriptor, data[written:], offset + written)
