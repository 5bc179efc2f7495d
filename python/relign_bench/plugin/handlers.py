"""Handlers of the host's requests, one class for each kind of plugin (docs/process_plugins.md).

The request `name` calls the method `on_name` with the message, and its return value is the answer.
"""

from __future__ import annotations

from .ability import number_of, pose_of, values_of
from .ability_classes import ABILITIES
from .images import numpy_or_none
from .pixels import ImageFile, float32_bytes, readings_bytes
from .scenes import Moved, Scene, Station
from .service import Stopped
from .trial import Trial

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Union

    from .algorithms import Algorithm
    from .base import Plugin
    from .noise_levels import NoiseLevel
    from .process import Host
    from .scenes import Assembly

    Message = dict[str, Any]
    Handler = Union["AlgorithmHandler", "NoiseLevelHandler", "SimulatorHandler", "StationHandler"]


class AlgorithmHandler:
    """Handles the requests for an Optimizer or Agent."""

    def __init__(self, plugin: Algorithm, host: Host) -> None:
        self._plugin = plugin
        self._host = host
        if "images" in plugin.observes:
            numpy_or_none()  # slow to import: before the trial's clock starts

    def on_run(self, message: Message) -> Message:
        try:
            self._plugin.run(Trial(self._host, message["task"]))
        except Stopped:  # the end of the run interrupted a service
            pass
        return {"message": "done"}


class NoiseLevelHandler:
    """Handles the requests for a NoiseLevel."""

    def __init__(self, plugin: NoiseLevel) -> None:
        self._plugin = plugin

    def on_draw(self, message: Message) -> Message:
        drawn = self._plugin.draw(message["seed"], message["scene"])
        return {"message": "drawn", "drawn": _dictionary(drawn, "draw()")}


class _AnySceneHandler:
    _file: ImageFile
    _image: Any
    _readings: Any
    _judged: Any  # what messages call the number that poses are judged by

    def __init__(self, plugin: Scene) -> None:
        self._plugin = plugin

    def on_describe(self, message: Message) -> Message:
        description = _dictionary(self._plugin.describe(), "describe()")
        if isinstance(self._plugin, Station):
            description = dict(description, owns_stage=True, truth=False)
        self._image, self._readings = description.get("image"), description.get("readings")
        score = description.get("score")
        self._judged = score.get("name", "score") if isinstance(score, dict) else "mse"
        self._file = ImageFile(message["image_file"])
        return {"message": "described", "description": description, "abilities": self._abilities()}

    def on_reference(self, message: Message) -> Message:
        self._share([self._plugin.reference()], "reference()")
        return {"message": "ok"}

    def _abilities(self) -> list[str]:
        return []

    def _share(self, images: list[Any], giver: str) -> None:
        self._file.write(b"".join(self._bytes(capture, giver) for capture in images))

    def _bytes(self, capture: Any, giver: str) -> bytes:
        if not self._image:
            return readings_bytes(capture, len(self._readings), giver)
        height, width = int(self._image["height"]), int(self._image["width"])
        if not self._readings:
            return float32_bytes(capture, height, width, giver)
        if not isinstance(capture, tuple) or len(capture) != 2:
            raise TypeError(f"{giver} returned {type(capture).__name__}, expected (pixels, readings), a tuple, since the scene "
                            "has both")
        pixels, readings = capture
        count = len(self._readings)
        return float32_bytes(pixels, height, width, giver) + readings_bytes(readings, count, giver) + bytes(4 * (width - count))


class SimulatorHandler(_AnySceneHandler):
    """Handles the requests for a Scene that is a simulator."""

    def __init__(self, plugin: Scene) -> None:
        super().__init__(plugin)
        self._mounted: dict[int, Assembly] = {}

    def _abilities(self) -> list[str]:
        return [name for name, able in ABILITIES.items() if not able.offered or getattr(self._plugin, able.offered)]

    def on_mount(self, message: Message) -> Message:
        offsets = {
            element: {kind: float(values) if kind == "value" else [float(value) for value in values]
                      for kind, values in given.items()}
            for element, given in message["offsets"].items()
        }
        assembly = self._plugin.mount(offsets)
        if not callable(getattr(assembly, "capture", None)):
            raise TypeError(f"mount() returned {type(assembly).__name__}, expected an Assembly")
        self._mounted[message["assembly"]] = assembly
        return {"message": "ok"}

    def on_unmount(self, message: Message) -> Message:
        del self._mounted[message["assembly"]]
        return {"message": "ok"}

    def on_capture(self, message: Message) -> Message:
        assembly = self._mounted[message["assembly"]]
        self._share([assembly.capture(pose_of(message["pose"]), message["seed"])], "capture()")
        return {"message": "ok"}

    def on_noise_free_mse(self, message: Message) -> Message:
        assembly = self._mounted[message["assembly"]]
        returned = assembly.noise_free_mse(pose_of(message["pose"]), message["seed"])
        giver = "noise_free_mse()" if self._judged == "mse" else "score()"
        value, standard_error = values_of(returned, giver, (self._judged, "standard_error"))
        return {
            "message": "measured",
            "mse": number_of(value, f"the {self._judged} of {giver}"),
            "standard_error": number_of(standard_error, f"the standard_error of {giver}"),
        }

    def on_ability(self, message: Message) -> Message:
        name = message["ability"]
        ability = ABILITIES[name]
        method = getattr(self._mounted[message["assembly"]], name, None)
        returned = method(*ability.given(message)) if method else None
        if returned is None:
            return {"message": "unsupported"}
        answer, images = ability.answer(returned, message, f"{name}()", {"mse": self._judged})
        if images:
            self._share(images, f"{name}()")
        return dict(answer, message="result")


class StationHandler(_AnySceneHandler):
    """Handles the requests for a Station."""

    _plugin: Station

    def on_begin(self, message: Message) -> Message:
        self._plugin.begin(message["seed"])
        return {"message": "ok"}

    def on_move_by(self, message: Message) -> Message:
        delta = pose_of(message["delta"])
        made = self._plugin.move_by(delta)
        if not isinstance(made, Moved):
            raise TypeError(f"move_by() returned {type(made).__name__}, expected Moved(moved, machine_seconds)")
        moved = [number_of(value, "a value of moved") for value in made.moved]
        limits = list(made.limits) or [0] * len(delta)
        for name, count in (("moved", len(moved)), ("limits", len(limits))):
            if count != len(delta):
                raise ValueError(f"{name} has {count} values, expected one per axis ({len(delta)})")
        if any(limit not in (-1, 0, 1) for limit in limits):
            raise ValueError(f"limits must be -1 (lower), 0 or +1 (upper) per axis, found {made.limits!r}")
        return {
            "message": "moved",
            "moved": moved,
            "limits_low": sum(1 << axis for axis, limit in enumerate(limits) if limit == -1),
            "limits_high": sum(1 << axis for axis, limit in enumerate(limits) if limit == 1),
            "machine_seconds": _seconds(made.machine_seconds, "move_by()"),
        }

    def on_capture(self, message: Message) -> Message:
        kind = "readings" if self._readings else "pixels"
        captured, seconds = values_of(self._plugin.capture(), "capture()", (kind, "machine_seconds"))
        self._share([captured], "capture()")
        return {"message": "captured", "machine_seconds": _seconds(seconds, "capture()")}


def handler_of(plugin: Plugin, host: Host) -> Handler:
    """The handler for a plugin, by its kind."""
    made: Any = plugin
    if made.kind == "scene":
        return StationHandler(made) if isinstance(made, Station) else SimulatorHandler(made)
    return NoiseLevelHandler(made) if made.kind == "noise-level" else AlgorithmHandler(made, host)


def _dictionary(returned: Any, giver: str) -> Message:
    if not isinstance(returned, dict):
        raise TypeError(f"{giver} returned {type(returned).__name__}, expected a dictionary")
    return returned


def _seconds(value: Any, giver: str) -> float:
    seconds = number_of(value, f"machine_seconds of {giver}")
    if seconds < 0:
        raise ValueError(f"machine_seconds of {giver} is {seconds!r}, expected a non-negative number")
    return seconds
