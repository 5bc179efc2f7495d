"""Base classes of scenes.

Pixels are a 2-D numpy array, a list of rows of numbers, or float32 values behind the buffer protocol (bytes, array("f")):
height rows of width values, row 0 on top. Readings are a list of numbers. A scene that has both returns a tuple (pixels,
readings), and its captures have a last row that begins with the readings.
"""

from __future__ import annotations

from .ability_classes import AssemblyAbilities, SceneAbilities
from .base import Plugin

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from typing import Any

    Pose = tuple[float, ...]
    Offsets = Mapping[str, Mapping[str, Any]]  # numbers or lists of them


def uncertain_values(offsets: Offsets, known: Collection[str]) -> dict[str, Any]:
    """The values of the uncertain quantities that `mount` gets; those that were not drawn are missing.

    Args:
        offsets: As of Scene.mount.
        known: Names of the quantities, as in the description's "uncertain".

    Raises:
        ValueError: One is unknown.
    """
    for name in offsets:
        if name not in known:
            raise ValueError(f"unknown quantity '{name}'; quantities: {', '.join(known)}")
    return {name: given["value"] for name, given in offsets.items()}


class Scene(SceneAbilities, Plugin):
    """A simulator that turns (assembly, true pose, frame seed) into an image.

    One object serves all trials of a worker. Images and noise-free errors must be functions of their arguments, in every
    process.
    """

    kind = "scene"

    def describe(self) -> dict[str, Any]:
        """The scene's description: name, axes, nominal_pose, image, readings and score, elements.

        The keys are those of relign_scene_interface::describe in plugin.h.
        """
        raise self._missing("describe(self)")

    def reference(self) -> Any:
        """Pixels, readings or both of the reference O*, noise-free, of the perfect device at the nominal pose. Called once."""
        raise self._missing("reference(self)")

    def mount(self, offsets: Offsets) -> Assembly:
        """Assembles one lens.

        Args:
            offsets: Offsets by element: {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}}; {} is the perfect lens.
                Of a quantity that the description has in "uncertain": {"waist": {"value": 0.05}}, see uncertain_values.

        Raises:
            ValueError: Raise it for an unknown element.
        """
        raise self._missing("mount(self, offsets)")


class Assembly(AssemblyAbilities):
    """One lens with its element offsets.

    True poses are tuples with one value per axis of the description, 0 to 1; offsets and noise may lead beyond.

    The methods of AssemblyAbilities are optional.
    """

    def capture(self, true_pose: Pose, frame_seed: int) -> Any:
        """Pixels, readings or both of a noisy capture. Equal arguments must give equal ones."""
        raise NotImplementedError(f"{type(self).__name__} has no capture(self, true_pose, frame_seed)")

    def noise_free_mse(self, true_pose: Pose, seed: int) -> tuple[float, float]:
        """Ground truth: an unbiased estimate of the noise-free MSE against O*, and its standard error.

        Not called for a scene whose description has "truth": False.

        Args:
            true_pose: True pose.
            seed: Seed of the estimate's random numbers; they must differ from those of captures.
        """
        return self.score(true_pose, seed)

    def score(self, true_pose: Pose, seed: int) -> tuple[float, float]:
        """Ground truth of a scene whose description declares a "score", in place of noise_free_mse.

        Args:
            true_pose: True pose.
            seed: Of random numbers, if it needs any.

        Returns:
            The score without noise, the better the lower it is and from 0, and its standard error: 0 if it is exact.
        """
        raise NotImplementedError(f"{type(self).__name__} has no noise_free_mse(self, true_pose, seed), nor a score(self, "
                                  "true_pose, seed) as the description declares it")


class Station(Scene):
    """A scene that owns its stage: hardware, such as a hexapod and a camera, or a simulation of it.

    The host calls `begin` and `capture`, then `move_by` and `capture` for each step. An error ends the trial, and the next
    trial gets a new process. The description gets "owns_stage": True and "truth": False.
    """

    def begin(self, seed: int) -> None:
        """Moves the station to a start pose; equal seeds ask for the same one. Its time does not count."""
        raise self._missing("begin(self, seed)")

    def move_by(self, delta: Pose) -> Moved:
        """Moves the stage relative to its current pose by its own encoders.

        A limit is not an error: stop there and report it.

        Args:
            delta: One value per axis, in shares of the travel.
        """
        raise self._missing("move_by(self, delta)")

    def capture(self) -> tuple[Any, float]:
        """Captures at the current pose.

        Returns:
            (pixels, machine_seconds).
        """
        raise self._missing("capture(self)")


class Moved:
    """A station's report of one move, by its encoders.

    Args:
        moved: How far each axis moved, in shares of the travel.
        machine_seconds: Measured duration, settling included.
        limits: Per axis -1 for the lower limit met, +1 for the upper limit, 0 for neither; () for none on any axis.
    """

    __slots__ = ("moved", "machine_seconds", "limits")

    def __init__(self, moved: Sequence[float], machine_seconds: float, limits: Sequence[int] = ()) -> None:
        self.moved = moved
        self.machine_seconds = machine_seconds
        self.limits = limits

    def __repr__(self) -> str:
        return f"Moved(moved={self.moved!r}, machine_seconds={self.machine_seconds!r}, limits={self.limits!r})"
