"""Base class of noise levels."""

from __future__ import annotations

from .base import Plugin

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class NoiseLevel(Plugin):
    """A distribution of the perturbations: start pose, movement distortion, element offsets."""

    kind = "noise-level"

    def draw(self, seed: int, scene: dict[str, Any]) -> dict[str, Any]:
        """Draws the perturbations of one instance. Must be a pure function of its arguments.

        Args:
            seed: Seed of the instance.
            scene: The scene's description.

        Returns:
            {"start": [true pose, n values in 0..1], "distortion": [[n x n]: true move = distortion @ commanded move],
            "elements": {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}}} for n axes, and where the lens shifts while
            its glue cures, "cure_shift": [n shares of the travel]. For a stage with errors beyond the distortion also
            "stage": {"backlash": [n], "repeatability": [n], "encoder_step": [n], "drift": [n], "drift_seconds": time
            constant}, each optional, in shares of the travel: full width of the play, standard deviation after a move,
            resolution, drift in the end (signed). For instances in batches "batch": {"size": modules, "cure_shift": [n: mean
            of a batch, added to those of its modules; taken from the draw with the batch's own seed], "inspection": [n:
            standard deviation of a measured cure shift]}.
        """
        raise self._missing("draw(self, seed, scene)")
