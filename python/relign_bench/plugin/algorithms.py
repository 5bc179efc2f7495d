"""Base classes of algorithms."""

from __future__ import annotations

from .base import Plugin

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from .trial import Trial


class Algorithm(Plugin):
    """Base of Optimizer and Agent; derive from one of them.

    Attributes:
        observes: What a trial shows to the algorithm: "images", "merit", "start", "box", "design", "level",
            "history". Key "observes" of the manifest.
    """

    observes: ClassVar[Sequence[str]] = ()

    def run(self, trial: Trial) -> None:
        """Runs one trial. Return when `trial.step` returns None, or earlier to finish the trial.

        Args:
            trial: The trial.
        """
        raise self._missing("run(self, trial)")


class Optimizer(Algorithm):
    """An algorithm that searches. Unless it recommends a pose, the pose with the lowest merit counts."""

    kind = "optimizer"
    observes = ("merit", "start", "box")


class Agent(Algorithm):
    """An algorithm with a trained or given policy. Unless it recommends a pose, the current pose counts."""

    kind = "agent"
    observes = ("images",)
