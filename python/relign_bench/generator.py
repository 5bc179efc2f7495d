"""The benchmark's methods as generators of gest-api, for programs that take such generators (libEnsemble, Optimas, blop)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gest_api.generator import Generator
from gest_api.vocs import ContinuousVariable, MaximizeObjective, MinimizeObjective

from .method import Method

if TYPE_CHECKING:
    from gest_api.vocs import VOCS

    from ._typing import Parameters


class MethodGenerator(Generator):
    """A method of the benchmark behind `suggest` and `ingest`.

        generator = MethodGenerator(vocs, "nlopt-bobyqa")
        (point,) = generator.suggest(1)
        generator.ingest([{**point, "error": measure(point["x"])}])

    Methods are sequential: a point is suggested once the one before has its value.

    Args:
        vocs: Continuous variables, one objective, whose lowest or highest value is wanted, and no constraints.
        algorithm: Id, preset or path of an algorithm, as of `relign_bench.Method`.
        steps: Budget, in points after the start pose.
        goal: The best value that the objective can have; 0 unless given.
        start: Start pose by name; by default the middle of the variables' domains.
        seed: Seed of the method.
        parameters: Parameters of the algorithm.

    Raises:
        ValueError: The VOCS is not supported, or an argument is not valid.
    """

    returns_id = True

    def __init__(self, vocs: VOCS, algorithm: str = "nlopt-bobyqa", steps: int = 50, goal: float = 0.0,
                 start: dict[str, float] | None = None, seed: int = 1, parameters: Parameters | None = None) -> None:
        super().__init__(vocs)
        ((self._objective, objective),) = vocs.objectives.items()
        self._sign = -1.0 if isinstance(objective, MaximizeObjective) else 1.0
        self._constants = {name: constant.value for name, constant in vocs.constants.items()}
        axes = {name: tuple(variable.domain) for name, variable in vocs.variables.items()}
        self.method = Method(algorithm, axes, steps, start, seed, parameters, goal=self._sign * goal)
        self._told = 0

    def _validate_vocs(self, vocs: VOCS) -> None:
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
            RuntimeError: The method failed.
        """
        if num_points not in (None, 1):
            raise ValueError(f"a method of relign-bench suggests one point at a time, not {num_points}")
        if self.method.waits:
            raise ValueError("the point suggested before has no value yet: ingest it first")
        pose = self.method.ask()
        return [] if pose is None else [{**pose, **self._constants, "_id": self._told}]

    def ingest(self, results: list[dict[str, Any]]) -> None:
        """The value of the point suggested last.

        Raises:
            ValueError: A point is not the one suggested last: methods cannot use other measurements.
        """
        for result in results:
            if result.get("_id") != self._told or not self.method.waits:
                raise ValueError(f"the point {result!r} was not suggested last; a method of relign-bench learns from its "
                                 "own points only")
            self.method.tell(self._sign * float(result[self._objective]))
            self._told += 1

    def finalize(self) -> None:
        """Ends the method."""
        self.method.close()
