"""The benchmark's methods as generators of gest-api, for programs that take them (Xopt, libEnsemble, Optimas, blop)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gest_api.generator import Generator
from gest_api.vocs import VOCS, ContinuousVariable, MaximizeObjective, MinimizeObjective

from ._errors import require_number
from .method import Method

if TYPE_CHECKING:
    from ._typing import Parameters

SAME = 1e-6  # of a variable's domain: single precision


class MethodGenerator(Generator):
    """A method of the benchmark behind `suggest` and `ingest`.

        generator = MethodGenerator(vocs, "nlopt-bobyqa")
        (point,) = generator.suggest(1)
        generator.ingest([{**point, "error": measure(point["x"])}])

    Methods are sequential: a point is suggested once the one before has its value. The generator is also an optimizer of blop.
    Before its first point it can be copied, pickled and used in a process forked from this one, and begins anew there.

    Args:
        vocs: Continuous variables, one objective, whose lowest or highest value is wanted, and no constraints.
        algorithm: Id, preset or path of an algorithm, as of `relign_bench.Method`.
        steps: Budget, in points after the start pose.
        goal: The best value that can be measured, noise included; 0 unless given.
        start: Start pose by name; by default the middle of the variables' domains.
        seed: Seed of the method.
        parameters: Parameters of the algorithm.

    Raises:
        TypeError: `vocs` is not a VOCS of gest-api.
        ValueError: The VOCS is not supported, or an argument is not valid.
    """

    returns_id = True

    def __init__(self, vocs: VOCS, algorithm: str = "nlopt-bobyqa", steps: int = 50, goal: float = 0.0,
                 start: dict[str, float] | None = None, seed: int = 1, parameters: Parameters | None = None) -> None:
        super().__init__(vocs)
        self.vocs = vocs  # for Xopt
        self._arguments = (vocs, algorithm, steps, goal, start, seed, parameters)
        self._process = os.getpid()
        ((self._objective, objective),) = vocs.objectives.items()
        self._sign = -1.0 if isinstance(objective, MaximizeObjective) else 1.0
        self._constants = {name: constant.value for name, constant in vocs.constants.items()}
        axes = self._domains = {name: tuple(variable.domain) for name, variable in vocs.variables.items()}
        self._goal = require_number(goal, "goal")
        self.method = Method(algorithm, axes, steps, start, seed, parameters, goal=self._sign * self._goal)
        self._told, self._suggested = 0, False
        self._pose: dict[str, float] = {}  # of the point suggested last
        self._best: tuple[int, dict[str, float]] | None = None

    def __reduce__(self) -> tuple[type[MethodGenerator], tuple[Any, ...]]:
        """A new generator with the same arguments: the thread of a method cannot be copied.

        Raises:
            RuntimeError: A point was suggested already.
        """
        self._refuse_if_begun("copied")
        return type(self), self._arguments

    def _refuse_if_begun(self, what: str) -> None:
        if self._told or self._suggested:
            raise RuntimeError(f"a method of relign-bench that has suggested a point cannot be {what}; make a new generator")

    def _begin_in_this_process(self) -> None:
        if self._process != os.getpid():
            self._refuse_if_begun("used in another process")
            self.__init__(*self._arguments)  # type: ignore[misc]

    def _validate_vocs(self, vocs: VOCS) -> None:
        if not isinstance(vocs, VOCS):
            raise TypeError(f"vocs must be a VOCS of gest_api.vocs, not {vocs!r}")
        other = [name for name, variable in vocs.variables.items() if type(variable) is not ContinuousVariable]
        if other or not vocs.variables:
            raise ValueError(f"a method of relign-bench moves continuous variables only, and has found {other or 'none'}")
        kinds = [type(objective) for objective in vocs.objectives.values()]
        if len(kinds) != 1 or kinds[0] not in (MinimizeObjective, MaximizeObjective):
            raise ValueError("a method of relign-bench needs one objective, to minimize or to maximize")
        if vocs.constraints:
            raise ValueError(f"a method of relign-bench takes no constraints: {', '.join(vocs.constraints)}")

    def suggest(self, num_points: int | None = None) -> list[dict[str, Any]]:
        """The next point; an empty list once the method has ended.

        Raises:
            ValueError: More than one point is wanted, or the one before has no value yet.
            RuntimeError: The method failed, or began in another process.
        """
        self._begin_in_this_process()
        if num_points not in (None, 1):
            raise ValueError(f"a method of relign-bench suggests one point at a time, not {num_points}")
        if self._suggested:
            raise ValueError("the point suggested before has no value yet: ingest it first")
        pose = self.method.ask()
        self._suggested, self._pose = pose is not None, pose or {}
        return [] if pose is None else [{**pose, **self._constants, "_id": self._told}]

    def ingest(self, results: list[dict[str, Any]]) -> None:
        """The value of the point suggested last.

        Raises:
            TypeError: `results` is not a list of points.
            ValueError: A point is not the one suggested last, as methods cannot use other measurements, or its value is
                missing, not a finite number, or better than the goal. The point still waits for its value.
        """
        if isinstance(results, (str, Mapping)) or not all(isinstance(result, Mapping) for result in results):
            raise TypeError(f"results must be a list of points, such as [{{**point, {self._objective!r}: value}}], not "
                            f"{results!r}")
        for result in results:
            for key in ("_id", self._objective):
                if key not in result:
                    raise ValueError(f"the point {result!r} lacks the key {key!r}: ingest "
                                     f"[{{**point, {self._objective!r}: value}}] with the point as it was suggested")
            if result.get("_id") != self._told or not self._suggested or self._moved(result):
                raise ValueError(f"the point {result!r} was not suggested last; a method of relign-bench learns from its "
                                 "own points only")
            value = require_number(result[self._objective], f"the value of '{self._objective}'")
            if self._sign < 0 and value > self._goal:
                raise ValueError(f"{value!r} is above the goal {self._goal:g}: set goal to the highest value that can be "
                                 "measured, noise included")
            best = self.method.best
            self.method.tell(self._sign * value)
            if self.method.best is not None and self.method.best != best:
                self._best = (self._told, self.method.best[0])
            self._told, self._suggested = self._told + 1, False

    def _moved(self, result: Mapping[str, Any]) -> bool:
        """Whether a point has other coordinates than suggested, beyond a program's rounding; one without any has not."""
        return any(abs(require_number(result[name], f"variable '{name}'") - self._pose[name]) > SAME * (upper - lower)
                   for name, (lower, upper) in self._domains.items() if name in result and name != self._objective)

    def should_stop(self) -> tuple[bool, str | None]:
        """Whether the method has ended, and why, as blop's plans ask.

        Raises:
            RuntimeError: The method failed, or began in another process.
        """
        self._begin_in_this_process()
        ended = not self._suggested and self.method.ask() is None
        return ended, self.method.end if ended else None

    def get_best_points(self) -> list[tuple[int, dict[str, float], dict[str, float]]]:
        """The best point so far as (_id, variables, objective), as blop's plans ask; empty before the first value."""
        if self._best is None or self.method.best is None:
            return []
        return [(*self._best, {self._objective: self._sign * self.method.best[1]})]

    def finalize(self) -> None:
        """Ends the method; a point that waits for its value counts no more."""
        self.method.close()
        self._suggested = False
