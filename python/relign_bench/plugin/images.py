"""Boxes of poses, and images, which are numpy arrays where numpy is installed."""

from __future__ import annotations

import mmap

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from types import ModuleType
    from typing import Any


class Box:
    """Axis-aligned box in commanded coordinates.

    Args:
        lower: Lower bounds, one per axis.
        upper: Upper bounds, one per axis.
    """

    def __init__(self, lower: Iterable[float], upper: Iterable[float]) -> None:
        self.lower = tuple(lower)
        self.upper = tuple(upper)

    def clamp(self, pose: Iterable[float]) -> list[float]:
        """The pose of the box that is closest to `pose`."""
        return [low if x < low else high if high < x else x for x, low, high in zip(pose, self.lower, self.upper)]

    def centre(self) -> list[float]:
        """The centre of the box."""
        return [0.5 * (low + high) for low, high in zip(self.lower, self.upper)]


class Image:
    """Pixels without numpy: image[y, x], or image[y] for a row. float32, read-only, row 0 on top.

    Args:
        data: The bytes, height rows of width values.
        width: Columns.
        height: Rows.
    """

    def __init__(self, data: bytes, width: int, height: int) -> None:
        self._values = memoryview(data).cast("f")
        self.width = width
        self.height = height
        self.shape = (height, width)

    def __len__(self) -> int:
        return self.height

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, tuple):
            y, x = place
            return self[y][x]
        if not -self.height <= place < self.height:
            raise IndexError(f"row {place} of {self.height}")
        first = (place % self.height) * self.width
        return self._values[first : first + self.width]

    def __iter__(self) -> Iterator[Any]:
        return (self[y] for y in range(self.height))

    def tolist(self) -> list[list[float]]:
        """The rows as lists."""
        return [row.tolist() for row in self]


def numpy_or_none() -> ModuleType | None:
    """The module numpy, or None where it is not installed."""
    try:
        import numpy
    except ImportError:
        return None
    return numpy


class SharedImage:
    """An image in a file that the host writes.

    Args:
        place: {"width", "height", "file"}, and "offset" in bytes unless it is 0.
    """

    def __init__(self, place: dict[str, Any]) -> None:
        self._height, self._width = place["height"], place["width"]
        self._file = place["file"]
        self._begin = place.get("offset", 0)
        self._size = 4 * self._height * self._width
        with open(self._file, "rb") as file:
            self._mapped = mmap.mmap(file.fileno(), self._begin + self._size, access=mmap.ACCESS_READ)

    def image(self) -> Any:
        """A copy of the image that is there now."""
        return as_image(self._mapped[self._begin : self._begin + self._size], self._height, self._width)

    def images(self, count: int) -> Any:
        """Copies of so many images, the first of them this one: an array, or without numpy a list of images."""
        with open(self._file, "rb") as file:
            file.seek(self._begin)
            data = file.read(count * self._size)
        numpy = numpy_or_none()
        if numpy is None:
            parts = [data[k * self._size : (k + 1) * self._size] for k in range(count)]
            return [Image(part, self._width, self._height) for part in parts]
        return numpy.frombuffer(data, dtype=numpy.float32).reshape((count, self._height, self._width))

    def next_image(self) -> Any:
        """A copy of the image behind it in the file."""
        with open(self._file, "rb") as file:
            file.seek(self._begin + self._size)
            return as_image(file.read(self._size), self._height, self._width)


def as_image(data: bytes, height: int, width: int) -> Any:
    """float32 rows as a numpy array, or without numpy as an Image; `data` is not copied."""
    numpy = numpy_or_none()
    if numpy is None:
        return Image(data, width, height)
    return numpy.frombuffer(data, dtype=numpy.float32).reshape((height, width))
