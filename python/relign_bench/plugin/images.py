"""Boxes of poses, and images: numpy arrays when numpy is there."""


import mmap


class Box:
    """Axis-aligned box in commanded coordinates: `lower` and `upper`, one value per axis."""

    def __init__(self, lower, upper):
        self.lower = tuple(lower)
        self.upper = tuple(upper)

    def clamp(self, pose):
        """The pose of the box nearest to `pose`, as a list."""
        return [low if x < low else high if high < x else x for x, low, high in zip(pose, self.lower, self.upper)]

    def centre(self):
        return [0.5 * (low + high) for low, high in zip(self.lower, self.upper)]


class Image:
    """Pixels without numpy: image[y, x] and image[y] (a row), float32, read-only, row 0 on top."""

    def __init__(self, data, width, height):
        self._values = memoryview(data).cast("f")
        self.width = width
        self.height = height
        self.shape = (height, width)

    def __len__(self):
        return self.height

    def __getitem__(self, place):
        if isinstance(place, tuple):
            y, x = place
            return self[y][x]
        if not -self.height <= place < self.height:
            raise IndexError("row %d of %d" % (place, self.height))
        first = (place % self.height) * self.width
        return self._values[first : first + self.width]

    def __iter__(self):
        return (self[y] for y in range(self.height))

    def tolist(self):
        return [row.tolist() for row in self]


def numpy_or_none():
    try:
        import numpy
    except ImportError:
        return None
    return numpy


class SharedImage:
    """An image in the file that the host writes: {"width", "height", "file"} and "offset" in bytes unless it is 0."""

    def __init__(self, place):
        self._shape = (place["height"], place["width"])
        self._file = place["file"]
        self._begin = place.get("offset", 0)
        self._size = 4 * place["height"] * place["width"]
        with open(self._file, "rb") as file:
            self._mapped = mmap.mmap(file.fileno(), self._begin + self._size, access=mmap.ACCESS_READ)

    def image(self):
        """What lies there now: a copy."""
        return as_image(self._mapped[self._begin : self._begin + self._size], *self._shape)

    def next_image(self):
        """What lies behind it."""
        with open(self._file, "rb") as file:
            file.seek(self._begin + self._size)
            return as_image(file.read(self._size), *self._shape)


def as_image(data, height, width):
    """float32 rows as a numpy array, without numpy as an Image; `data` is not copied."""
    numpy = numpy_or_none()
    if numpy is None:
        return Image(data, width, height)
    return numpy.frombuffer(data, dtype=numpy.float32).reshape((height, width))
