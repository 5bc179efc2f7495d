"""The layout of a station: a JSON file with its axes, their box, and its camera. README.md describes the keys."""
import json
import math

import numpy as np

AXIS_KEYS = {"name": str, "pv": str, "unit": str, "low": float, "high": float}
AXIS_DEFAULTS = {"tolerance": None, "start": None}
CAMERA_KEYS = {"cam": str, "image": str, "width": int, "height": int, "exposure_s": float, "counts_at_1": float}
GENICAM_KEYS = {"genicam": str, "width": int, "height": int, "exposure_s": float, "counts_at_1": float}
CAMERA_DEFAULTS = {"white": 1.0}
OPTIONAL = {"tolerance": float, "start": float, "white": float, "load": str, "start_spread": float}
POSITIVE = ("tolerance", "width", "height", "exposure_s", "counts_at_1", "white")


class Axis:
    """An axis and its box, in the unit of its motor record.

    Attributes:
        name: For reports.
        pv: The motor record.
        unit: As in the record's EGU.
        low, high: The box: the motor is never sent beyond.
        tolerance: How far a readback may be from its target.
        start: Where trials start.
        backlash: The record's BDST, once it has been read.
    """

    def __init__(self, facts, place):
        given = checked(facts, AXIS_KEYS, AXIS_DEFAULTS, place)
        self.name, self.pv, self.unit = given["name"], given["pv"], given["unit"]
        self.low, self.high = given["low"], given["high"]
        if self.low >= self.high:
            raise ValueError(f"{place}: 'low' is {self.low:g} and must be below 'high', {self.high:g}")
        width = self.high - self.low
        self.tolerance = 0.001 * width if given["tolerance"] is None else given["tolerance"]
        self.start = (self.low + self.high) / 2 if given["start"] is None else given["start"]
        if self.tolerance >= width:
            raise ValueError(f"{place}: 'tolerance' is {self.tolerance:g} and must be less than the box's width, {width:g}")
        if not self.low <= self.start <= self.high:
            raise ValueError(f"{place}: 'start' is {self.start:g} and must be in the box of {self.low:g} to {self.high:g}")
        self.backlash = 0.0

    def __str__(self):
        return f"{self.pv} ({self.name})"


class Layout:
    """The file's content, with `prefix` in place of $(P).

    Attributes:
        axes: Of class Axis.
        camera: The camera's keys.
        load: Record that loads a lens by number, or None.
        start_spread: Share of the box within which trials start at random, around `start`.

    Raises:
        ValueError: A key or value is not valid.
    """

    def __init__(self, path, prefix):
        try:
            with open(path, encoding="utf-8") as file:
                facts = json.loads(file.read().replace("$(P)", prefix))
        except OSError as error:
            raise ValueError(f"the layout {path} cannot be read: {error.strerror}") from None
        except json.JSONDecodeError as error:
            raise ValueError(f"{path}:{error.lineno}: not JSON: {error.msg}") from None
        given = checked(facts, {"axes": list, "camera": dict}, {"load": None, "start_spread": 0.0}, str(path))
        self.axes = [Axis(axis, f"{path}: axis {number}") for number, axis in enumerate(given["axes"], 1)]
        if not self.axes:
            raise ValueError(f"{path}: 'axes' is empty and must have at least one axis")
        keys = GENICAM_KEYS if "genicam" in given["camera"] else CAMERA_KEYS
        self.camera = checked(given["camera"], keys, CAMERA_DEFAULTS, f"{path}: camera")
        self.load, self.start_spread = given["load"], given["start_spread"]
        self._refuse_one_record_twice(path)
        if not 0 <= self.start_spread <= 1:
            raise ValueError(f"{path}: 'start_spread' is {self.start_spread:g} and must be from 0 to 1")

    def _refuse_one_record_twice(self, path):
        """The box of one axis would not hold for another one's targets, nor for the numbers of lenses."""
        named = [(axis.pv, f"axis '{axis.name}'") for axis in self.axes] + ([(self.load, "'load'")] if self.load else [])
        users = {}
        for pv, user in named:
            record = pv.partition(".")[0].strip()  # m4 and m4.VAL are one motor
            if record in users:
                raise ValueError(f"{path}: {users[record]} and {user} have the same record, '{record}'")
            users[record] = user


def checked(facts, required, defaults, place):
    """The keys of an object, with numbers as float where a float is required."""
    if not isinstance(facts, dict):
        raise ValueError(f"{place}: expected an object, found {facts!r}")
    for key in facts:
        if key not in required and key not in defaults:
            raise ValueError(f"{place}: unknown key '{key}'; keys: {', '.join([*required, *defaults])}")
    given = {**defaults, **facts}
    for key, kind in {**required, **{key: OPTIONAL[key] for key in defaults if given[key] is not defaults[key]}}.items():
        if key not in given:
            raise ValueError(f"{place}: key '{key}' is missing")
        value = given[key]
        accepted = (int, float) if kind is float else kind
        if isinstance(value, bool) or not isinstance(value, accepted):
            raise ValueError(f"{place}: '{key}' is {value!r}, expected {kind.__name__}")
        if kind is str and not value.strip():
            raise ValueError(f"{place}: '{key}' is empty")
        if kind in (int, float) and not math.isfinite(value):
            raise ValueError(f"{place}: '{key}' is {value!r}, expected a finite number")
        if key in POSITIVE and value <= 0:
            raise ValueError(f"{place}: '{key}' is {value:g} and must be positive")
        given[key] = float(value) if kind is float else value
    return given


def golden_image(path, camera):
    """The .npy file of the image of a perfect lens, float32, shape (height, width) of the layout's camera.

    Raises:
        ValueError: It is something else, or has values that are not finite.
    """
    image, size = np.load(path), (camera["height"], camera["width"])
    if image.shape != size or image.dtype != np.float32:
        raise ValueError(f"{path} has {image.dtype} values of shape {image.shape}, expected float32 of shape {size}")
    if not np.isfinite(image).all():
        raise ValueError(f"{path} has pixels without a finite value")
    return image
