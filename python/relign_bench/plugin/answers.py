"""What the host asks of a plugin of each kind, as calls of the author's object (docs/process_plugins.md)."""

import math

from .images import numpy_or_none
from .pixels import ImageFile, float32_bytes
from .scenes import Moved, Station
from .services import Stopped
from .talk import Talk


class AlgorithmAnswers:
    def __init__(self, made, host):
        self._made = made
        self._host = host
        if "images" in made.knows:
            numpy_or_none()  # slow to import: before the trial's clock starts

    def on_run(self, message):
        try:
            self._made.run(Talk(self._host, message["task"]))
        except Stopped:  # a service was cut off by the end of the run
            pass
        return {"message": "done"}


class NoiseLevelAnswers:
    def __init__(self, made, host):
        self._made = made

    def on_draw(self, message):
        return {"message": "drawn", "drawn": _dictionary(self._made.draw(message["seed"], message["scene"]), "draw()")}


class _AnySceneAnswers:
    def __init__(self, made, host):
        self._made = made
        self._file = None
        self._image = None

    def on_describe(self, message):
        description = _dictionary(self._made.describe(), "describe()")
        if isinstance(self._made, Station):
            description = dict(description, owns_stage=True, truth=False)
        self._image = description.get("image")
        self._file = ImageFile(message["image_file"])
        return {"message": "described", "description": description}

    def on_reference(self, message):
        self._share(self._made.reference(), "reference()")
        return {"message": "ok"}

    def _share(self, pixels, giver):
        self._file.write(float32_bytes(pixels, int(self._image["height"]), int(self._image["width"]), giver))


class SimulatorAnswers(_AnySceneAnswers):
    def __init__(self, made, host):
        super().__init__(made, host)
        self._mounted = {}

    def on_mount(self, message):
        offsets = {
            element: {kind: [float(value) for value in values] for kind, values in given.items()}
            for element, given in message["offsets"].items()
        }
        assembly = self._made.mount(offsets)
        if not callable(getattr(assembly, "capture", None)):
            raise TypeError("mount() gave %s, expected an Assembly" % type(assembly).__name__)
        self._mounted[message["assembly"]] = assembly
        return {"message": "ok"}

    def on_unmount(self, message):
        del self._mounted[message["assembly"]]
        return {"message": "ok"}

    def on_capture(self, message):
        assembly = self._mounted[message["assembly"]]
        self._share(assembly.capture(_pose(message["pose"]), message["seed"]), "capture()")
        return {"message": "ok"}

    def on_noise_free_mse(self, message):
        assembly = self._mounted[message["assembly"]]
        given = assembly.noise_free_mse(_pose(message["pose"]), message["seed"])
        mse, standard_error = _pair(given, "noise_free_mse()", "(mse, standard_error)")
        return {
            "message": "measured",
            "mse": _number(mse, "the mse of noise_free_mse()"),
            "standard_error": _number(standard_error, "the standard_error of noise_free_mse()"),
        }

    def on_render_noise_free(self, message):
        render = getattr(self._mounted[message["assembly"]], "render_noise_free", None)
        if render is None:
            return {"message": "unsupported"}
        self._share(render(_pose(message["pose"])), "render_noise_free()")
        return {"message": "ok"}

    def on_mtf(self, message):
        measure = getattr(self._mounted[message["assembly"]], "mtf", None)
        if measure is None:
            return {"message": "unsupported"}
        centre, corner = _pair(measure(_pose(message["pose"]), message["lp_per_mm"]), "mtf()", "(centre, corner)")
        return {
            "message": "measured",
            "centre": _number(centre, "the centre of mtf()"),
            "corner": _number(corner, "the corner of mtf()"),
        }


class StationAnswers(_AnySceneAnswers):
    def on_begin(self, message):
        self._made.begin(message["seed"])
        return {"message": "ok"}

    def on_move_by(self, message):
        delta = _pose(message["delta"])
        made = self._made.move_by(delta)
        if not isinstance(made, Moved):
            raise TypeError("move_by() gave %s, expected Moved(moved, machine_seconds)" % type(made).__name__)
        moved = [_number(value, "a value of moved") for value in made.moved]
        limits = list(made.limits) or [0] * len(delta)
        for name, values in (("moved", moved), ("limits", limits)):
            if len(values) != len(delta):
                raise ValueError("%s has %d values, expected one per axis (%d)" % (name, len(values), len(delta)))
        if any(limit not in (-1, 0, 1) for limit in limits):
            raise ValueError("limits are -1 (lower), 0 or +1 (upper) per axis, found %r" % (made.limits,))
        return {
            "message": "moved",
            "moved": moved,
            "limits_low": sum(1 << axis for axis, limit in enumerate(limits) if limit == -1),
            "limits_high": sum(1 << axis for axis, limit in enumerate(limits) if limit == 1),
            "machine_seconds": _seconds(made.machine_seconds, "move_by()"),
        }

    def on_capture(self, message):
        pixels, seconds = _pair(self._made.capture(), "capture()", "(pixels, machine_seconds)")
        self._share(pixels, "capture()")
        return {"message": "captured", "machine_seconds": _seconds(seconds, "capture()")}


def answers_of(made, host):
    """Whoever answers the host's messages in the name of `made`."""
    if made.kind == "scene":
        return (StationAnswers if isinstance(made, Station) else SimulatorAnswers)(made, host)
    return (NoiseLevelAnswers if made.kind == "noise-level" else AlgorithmAnswers)(made, host)


def _pose(values):
    return tuple(math.nan if value is None else float(value) for value in values)


def _dictionary(given, giver):
    if not isinstance(given, dict):
        raise TypeError("%s gave %s, expected a dictionary" % (giver, type(given).__name__))
    return given


def _pair(given, giver, names):
    try:
        first, second = given
    except (TypeError, ValueError):
        raise TypeError("%s gave %s, expected two values %s" % (giver, type(given).__name__, names)) from None
    return first, second


def _number(value, what):
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError("%s is %r, expected a number" % (what, value)) from None
    if not math.isfinite(number):
        raise ValueError("%s is %r, expected a finite number" % (what, value))
    return number


def _seconds(value, giver):
    seconds = _number(value, "machine_seconds of %s" % giver)
    if seconds < 0:
        raise ValueError("machine_seconds of %s is %r, expected 0 or more" % (giver, seconds))
    return seconds
