"""Optimizers whose poses another package suggests: by gest-api's interface, or searching for the minimum of a function."""

from __future__ import annotations

import math

from .algorithms import Optimizer

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from .trial import Observation, Trial

    Point = dict[str, Any]

MERIT = "merit"


class Space:
    """A trial as packages of optimisation expect a search space. Poses are in commanded coordinates.

    Attributes:
        names: Names of the axes.
        lower: Lower bounds of the box to search, one per axis.
        upper: Upper bounds.
        start: The start pose, or where it is outside the box, as it may be, the pose of the box closest to it.
        start_merit: The merit at `start`, which is known and costs no step; None where the start pose is outside the box.
        budget: Steps granted.
        seed: The trial's seed in 31 bits, which every package accepts.
    """

    def __init__(self, trial: Trial) -> None:
        self.names: list[str] = [axis["name"] for axis in trial.axes]
        self.lower, self.upper = list(trial.box.lower), list(trial.box.upper)
        self.start: list[float] = trial.box.clamp(trial.first.pose)
        inside = self.start == list(trial.first.pose)
        self.start_merit: float | None = trial.first.merit if inside else None
        self.budget = trial.budget
        self.seed = trial.seed & 0x7FFFFFFF

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """(lower, upper) of each axis."""
        return list(zip(self.lower, self.upper))

    def vocs(self) -> Any:
        """The space as a VOCS of gest-api: the axes as variables, and the objective "merit", smaller is better.

        Raises:
            ImportError: The package gest-api is not installed.
        """
        from gest_api.vocs import VOCS

        variables = {name: list(bounds) for name, bounds in zip(self.names, self.bounds)}
        return VOCS(variables=variables, objectives={MERIT: "MINIMIZE"})

    def point(self, pose: Sequence[float]) -> Point:
        """A pose as a point of gest-api."""
        return {name: float(value) for name, value in zip(self.names, pose)}

    def pose(self, point: Point) -> list[float]:
        """The pose of a point.

        Raises:
            ValueError: The point lacks an axis, or a value is not finite.
        """
        missing = [name for name in self.names if name not in point]
        if missing:
            raise ValueError(f"a suggested point lacks {', '.join(missing)}: {point!r}")
        pose = [float(point[name]) for name in self.names]
        if not all(map(math.isfinite, pose)):
            raise ValueError(f"a suggested point is not finite: {point!r}")
        return pose


class GeneratorSearch(Optimizer):
    """Base of optimizers whose poses a generator of gest-api suggests: an object with `suggest` and `ingest`.

        class Improvement(GeneratorSearch):
            def generator(self, space):
                return ExpectedImprovementGenerator(vocs=space.vocs())

    The generator receives the merit at `space.start` before it suggests the first point, which costs a step only if the start
    pose is outside the box, and then one point at a time. Poses outside the box are clamped to it, and the point is ingested as
    it was suggested. If the generator has a method `recommended`, which returns a point or None, its answer is recommended
    after each step; otherwise the pose of the lowest merit counts. An empty suggestion finishes the trial. A method `finalize`
    is called at its end.
    """

    def generator(self, space: Space) -> Any:
        """The generator of a trial. Seed it with `space.seed`."""
        raise self._missing("generator(self, space)")

    def run(self, trial: Trial) -> None:
        """Runs one trial on the generator."""
        space = Space(trial)
        generator = self.generator(space)
        recommended = getattr(generator, "recommended", lambda: None)
        try:
            self._search(trial, space, generator, recommended)
        finally:
            getattr(generator, "finalize", lambda: None)()

    @staticmethod
    def _search(trial: Trial, space: Space, generator: Any, recommended: Callable[[], Point | None]) -> None:
        merit = space.start_merit
        if merit is None:
            observation = trial.step(space.start)
            if observation is None:
                return
            merit = observation.merit
        generator.ingest([{**space.point(space.start), MERIT: merit}])
        while True:
            points = generator.suggest(1)
            if not points:
                return
            for point in points:
                observation = trial.step(trial.box.clamp(space.pose(point)))
                if observation is None:
                    return
                generator.ingest([{**point, MERIT: observation.merit}])
                best = recommended()
                if best is not None:
                    trial.recommend(trial.box.clamp(space.pose(best)))


class _BudgetSpent(BaseException):
    """Leaves a package's search; no `except Exception` of the package catches it."""


class FunctionSearch(Optimizer):
    """Base of optimizers that leave the search for the minimum of a function to another package.

        class Simplex(FunctionSearch):
            def search(self, merit, space):
                return package.simplex(merit, space.start)

    Every call of `merit` is a step, except that its first one is free if it asks for `space.start` and the merit there is
    known. Poses outside the box are clamped to it.
    """

    def search(self, merit: Callable[[Sequence[float]], float], space: Space) -> Sequence[float] | None:
        """Searches the space for the lowest `merit`. The call does not return if it spends the budget.

        Returns:
            The pose to recommend; None for the one of the lowest merit.
        """
        raise self._missing("search(self, merit, space)")

    def run(self, trial: Trial) -> None:
        """Runs one trial of `search`."""
        space = Space(trial)
        calls = 0

        def merit(pose: Sequence[float]) -> float:
            nonlocal calls
            calls += 1
            wanted = [float(value) for value in pose]
            if calls == 1 and wanted == space.start and space.start_merit is not None:
                return space.start_merit
            observation: Observation | None = trial.step(trial.box.clamp(wanted))
            if observation is None:
                raise _BudgetSpent
            return observation.merit

        try:
            pose = self.search(merit, space)
        except _BudgetSpent:
            return
        if pose is not None:
            trial.recommend(trial.box.clamp(float(value) for value in pose))
