"""A trial as an algorithm sees it."""

from __future__ import annotations

import math

from .images import Box, SharedImage
from .service_classes import TrialServices
from .services import Model, Outcome, Pretraining

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any

    from .process import Host


class Observation:
    """What a step returns: the pose after a move, and the capture there.

    Attributes:
        step: Number of the step; 0 is the capture at the start pose.
        pose: Commanded pose, one value per axis.
        merit: The merit, smaller is better; NaN unless the algorithm observes "merit".
        machine_seconds: Simulated machine time since the start.
        limits_low: Bit i is set if axis i met its lower limit during this move.
        limits_high: Bit i is set if axis i met its upper limit during this move.
    """

    __slots__ = ("step", "pose", "merit", "limits_low", "limits_high", "machine_seconds", "_trial", "_image")

    def __init__(self, message: dict[str, Any], trial: Trial) -> None:
        merit = message["merit"]
        self.step: int = message["step"]
        self.pose: tuple[float, ...] = tuple(map(float, message["pose"]))  # JSON has 0 for 0.0
        self.merit: float = math.nan if merit is None else merit
        self.limits_low: int = message["limits_low"]
        self.limits_high: int = message["limits_high"]
        self.machine_seconds: float = message["machine_seconds"]
        self._trial = trial
        self._image: Any = None

    @property
    def limits(self) -> tuple[int, ...]:
        """Per axis -1 if this move met its lower limit, +1 for its upper limit, 0 for neither."""
        return tuple(
            -1 if self.limits_low >> axis & 1 else 1 if self.limits_high >> axis & 1 else 0
            for axis in range(len(self.pose))
        )

    @property
    def image(self) -> Any:
        """The capture: float32, shape (height, width), row 0 on top, read-only; a numpy array, without numpy an Image.

        Read it before the next step; once read it stays valid.

        Raises:
            RuntimeError: The algorithm does not observe "images", or the next step was made before.
        """
        if self._image is None:
            self._image = self._trial._pixels_of(self)
        return self._image

    @property
    def readings(self) -> dict[str, float]:
        """What the instruments read, by name; empty of a scene without readings.

        Read it before the next step, or the image, which has it in its last row.

        Raises:
            RuntimeError: The algorithm does not observe "images", or the next step was made before.
        """
        image = self.image
        return {one["name"]: float(image[-1, k]) for k, one in enumerate(self._trial.readings)}

    def __repr__(self) -> str:
        return f"Observation(step={self.step}, pose={self.pose!r}, merit={self.merit!r})"


class Trial(TrialServices):
    """One trial: the argument of `run`.

    Attributes:
        axes: [{"name": "x", "unit": "mm", "travel": 2.0}, ...]; travel is the length of [0, 1].
        readings: [{"name": "loss", "unit": "dB"}, ...]: what Observation.readings has; empty of a scene without readings,
            and unless the algorithm observes "images".
        budget: Steps granted after step 0.
        seed: Seed of the algorithm; equal seeds must give equal trials.
        observes: What this trial shows, of the words in the class's `observes`.
        largest_move: Largest move per axis and step, as a share of the travel; infinity when unlimited. Longer moves are
            clipped.
    """

    def __init__(self, host: Host, task: dict[str, Any]) -> None:
        super().__init__(host, task)
        self.readings: list[dict[str, str]] = task.get("readings", [])
        self.budget: int = task["budget"]
        self.seed: int = task["seed"]
        self.observes: frozenset[str] = frozenset(task["observes"])
        largest_move = task.get("largest_move")
        self.largest_move: float = math.inf if largest_move is None else largest_move
        box = task.get("box")
        self._box = Box(box["lower"], box["upper"]) if box else None
        self._first: Observation | None = None
        self._reference: Any = None
        self._latest = 0
        self._pixels = SharedImage(task["image"]) if task.get("image") else None

    @property
    def box(self) -> Box:
        """The box to search, in commanded coordinates.

        Raises:
            RuntimeError: The algorithm does not observe "box".
        """
        if self._box is None:
            raise _not_observed("box", "box")
        return self._box

    @property
    def first(self) -> Observation:
        """Step 0: the capture at the start pose, which costs nothing.

        Raises:
            ValueError: A step was made before the first access.
        """
        if self._first is None:
            self._first = Observation(self._host.ask('{"message":"first"}\n'), self)
            self._latest = self._first.step
        return self._first

    def step(self, pose: Iterable[float]) -> Observation | None:
        """Moves to an absolute commanded pose and captures once.

        Args:
            pose: One value per axis.

        Returns:
            The observation, or None once the budget is spent or the run was stopped; then return from `run` soon: the host
            waits for some seconds.

        Raises:
            ValueError: The pose is not finite, or has another number of axes.
        """
        return self._observation(self._host.ask(f'{{"message":"step","pose":[{self._numbers(pose)}]}}\n'))

    def move(self, delta: Iterable[float]) -> Observation | None:
        """As `step`, for a move relative to the current pose."""
        return self._observation(self._host.ask(f'{{"message":"move","delta":[{self._numbers(delta)}]}}\n'))

    def recommend(self, pose: Iterable[float]) -> None:
        """Recommends a commanded pose: the final pose if the trial ended now. Costs nothing; counts until the next one.

        Raises:
            ValueError: The pose is not finite, or has another number of axes.
        """
        self._host.ask(f'{{"message":"recommend","pose":[{self._numbers(pose)}]}}\n')

    @property
    def reference(self) -> Any:
        """The reference image O*, as Observation.image.

        Raises:
            RuntimeError: The algorithm does not observe "images".
        """
        if self._pixels is None:
            raise _not_observed("image", "images")
        if self._reference is None:
            self._offered(self._host.ask('{"message":"reference"}\n'))
            self._reference = self._pixels.next_image()
        return self._reference

    def model(self) -> Model:
        """A simulator of the scene's design, for any offsets and seeds. Needs "design"."""
        return self._made(Model)

    def pretraining(self) -> Pretraining:
        """What the algorithm learnt on source instances. Needs the class attribute `prepare`."""
        return self._made(Pretraining)

    def run(self, parameter: str, steps: int, /, **parameters: Any) -> Outcome:
        """Hands over to another algorithm.

        Args:
            parameter: Name of a parameter of type "algorithm", which names the algorithm.
            steps: Steps granted, at most.
            **parameters: Changes to the other algorithm's own parameters.

        Returns:
            What it did.

        Raises:
            RuntimeError: The other algorithm failed, with its message. The trial continues.
        """
        request = {"parameter": parameter, "steps": steps, "parameters": parameters}
        answer = self._host.exchange(self._request("relign.run/1", "run", request))
        last = answer.get("last")
        if last is not None:  # after a failure too
            self._latest = last["step"]
        answer = self._offered(self._host.checked(answer))
        if answer["message"] == "stop":
            return Outcome()
        best = answer["best"]
        return Outcome(
            answer["steps"],
            answer["end"] == "finished",
            Observation(last, self) if last else None,
            Observation(best, self) if best else None,
            tuple(answer["recommendation"]) if answer["recommendation"] else None,
        )

    def _numbers(self, pose: Iterable[float]) -> str:
        return ",".join(map(repr, self._finite(pose)))

    def _observation(self, answer: dict[str, Any]) -> Observation | None:
        if answer["message"] == "stop":
            return None
        self._latest = answer["step"]
        return Observation(answer, self)

    def _pixels_of(self, observation: Observation) -> Any:
        if self._pixels is None:
            raise _not_observed("image", "images")
        if observation.step != self._latest:
            raise RuntimeError(f"the pixels of step {observation.step} are gone (the current step is {self._latest}): read "
                               "observation.image before the next step")
        return self._pixels.image()


def _not_observed(what: str, word: str) -> RuntimeError:
    return RuntimeError(f'the trial grants no {what}: add "{word}" to the class\'s observes')
