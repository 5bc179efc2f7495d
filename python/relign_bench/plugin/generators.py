"""Packages of optimisation with interfaces of their own as generators of gest-api, for GeneratorSearch.

Each class imports nothing: it gets an object of the package. `suggest(1)` returns a point with the "_id" under which `ingest`
expects its merit; points without "_id" are measurements that the generator did not ask for, and are added where the package
can learn from them.
"""

from __future__ import annotations

from .searches import MERIT

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .searches import Point, Space


class Generator:
    """Base: `ask` and `tell` of a package, one point at a time."""

    returns_id = True

    def __init__(self, space: Space) -> None:
        self.space = space
        self._asked: dict[int, Any] = {}
        self._next = 0

    def ask(self) -> tuple[Any, list[float]] | None:
        """(what the package calls the suggestion, its pose); None when the package has none left."""
        raise NotImplementedError

    def tell(self, asked: Any, pose: list[float], merit: float) -> None:
        """The merit of a suggestion."""
        raise NotImplementedError

    def add(self, pose: list[float], merit: float) -> None:
        """A measurement that was not suggested. Without a definition it is ignored."""

    def suggest(self, num_points: int | None = None) -> list[Point]:
        """As gest-api's `suggest`."""
        points = []
        for _ in range(num_points or 1):
            suggestion = self.ask()
            if suggestion is None:
                break
            asked, pose = suggestion
            self._asked[self._next] = asked
            points.append({**self.space.point(pose), "_id": self._next})
            self._next += 1
        return points

    def ingest(self, results: list[Point]) -> None:
        """As gest-api's `ingest`.

        Raises:
            ValueError: An "_id" was not suggested, or its merit was ingested before.
        """
        for result in results:
            pose, merit = self.space.pose(result), float(result[MERIT])
            if "_id" not in result:
                self.add(pose, merit)
            elif result["_id"] in self._asked:
                self.tell(self._asked.pop(result["_id"]), pose, merit)
            else:
                raise ValueError(f"no suggestion with the _id {result['_id']!r} waits for its merit")


class OptunaGenerator(Generator):
    """A study of Optuna (version 3 or later), whose direction is the default: smaller is better.

    A sampler that stops the study, as one whose grid is exhausted does, has no further points.

    Args:
        study: The study, with a seeded sampler.
        space: The space.

    Raises:
        ValueError: The study has another direction, or several.
    """

    def __init__(self, study: Any, space: Space) -> None:
        super().__init__(space)
        from optuna.distributions import FloatDistribution

        directions = [direction.name.lower() for direction in study.directions]
        if directions != ["minimize"]:
            raise ValueError(f"the study must minimize one value, the merit, but its directions are {', '.join(directions)}: "
                             "make it by create_study(sampler=...)")
        self._study, self._stopped = study, False
        study.stop = self._stop  # Optuna's own raises an error outside of study.optimize
        self._distributions = {name: FloatDistribution(*bounds) for name, bounds in zip(space.names, space.bounds)}

    def _stop(self) -> None:
        self._stopped = True

    def ask(self) -> tuple[Any, list[float]] | None:
        if self._stopped:
            return None
        trial = self._study.ask(self._distributions)
        return trial, self.space.pose(trial.params)

    def tell(self, asked: Any, pose: list[float], merit: float) -> None:
        self._study.tell(asked, merit)

    def add(self, pose: list[float], merit: float) -> None:
        from optuna.trial import create_trial

        self._study.add_trial(create_trial(params=self.space.point(pose), distributions=self._distributions, value=merit))


class NevergradGenerator(Generator):
    """An optimizer of Nevergrad; `name` is a key of nevergrad.optimizers.registry. Recommends what Nevergrad recommends.

    Args:
        name: Name of the optimizer.
        space: The space.
    """

    def __init__(self, name: str, space: Space) -> None:
        super().__init__(space)
        import nevergrad

        array = nevergrad.p.Array(init=space.start).set_bounds(space.lower, space.upper)
        array.random_state.seed(space.seed)
        self._optimizer = nevergrad.optimizers.registry[name](parametrization=array, budget=space.budget)
        self._told = 0

    def ask(self) -> tuple[Any, list[float]]:
        candidate = self._optimizer.ask()
        return candidate, [float(value) for value in candidate.value]

    def tell(self, asked: Any, pose: list[float], merit: float) -> None:
        self._optimizer.tell(asked, merit)
        self._told += 1

    def add(self, pose: list[float], merit: float) -> None:
        self._optimizer.tell(self._optimizer.parametrization.spawn_child(new_value=pose), merit)

    def recommended(self) -> Point | None:
        """Nevergrad's recommendation, once a suggestion was measured."""
        return self.space.point(self._optimizer.provide_recommendation().value) if self._told else None


class CmaGenerator(Generator):
    """A strategy of the package cma (CMAEvolutionStrategy and its variants), which takes whole generations.

    Recommends the mean of the strategy's distribution after the first generation.

    Args:
        strategy: The strategy, made with bounds and seed; a seed of 0 means the time to cma.
        space: The space.
    """

    def __init__(self, strategy: Any, space: Space) -> None:
        super().__init__(space)
        self._strategy = strategy
        self._waiting: list[Any] = []
        self._measured: list[tuple[Any, float]] = []
        self._size = 0

    def ask(self) -> tuple[Any, list[float]] | None:
        if not self._waiting:
            if self._strategy.stop():
                return None
            self._waiting = list(self._strategy.ask())
            self._size = len(self._waiting)
        pose = self._waiting.pop(0)
        return pose, [float(value) for value in pose]

    def tell(self, asked: Any, pose: list[float], merit: float) -> None:
        self._measured.append((asked, merit))
        if len(self._measured) == self._size:
            self._strategy.tell(*map(list, zip(*self._measured)))
            self._measured = []

    def recommended(self) -> Point | None:
        """The mean, once a generation was measured."""
        mean = self._strategy.result.xfavorite if self._strategy.countiter else None
        return None if mean is None else self.space.point(mean)


class AxGenerator(Generator):
    """A client of Ax (version 1 or later) that has no experiment yet.

    Args:
        client: The client.
        space: The space.
    """

    def __init__(self, client: Any, space: Space) -> None:
        super().__init__(space)
        from ax import RangeParameterConfig

        self._client = client
        self._client.configure_experiment(parameters=[
            RangeParameterConfig(name=name, bounds=bounds, parameter_type="float")
            for name, bounds in zip(space.names, space.bounds)])
        self._client.configure_optimization(objective="-" + MERIT)

    def ask(self) -> tuple[Any, list[float]]:
        ((index, parameters),) = self._client.get_next_trials(max_trials=1).items()
        return index, self.space.pose(parameters)

    def tell(self, asked: Any, pose: list[float], merit: float) -> None:
        self._client.complete_trial(trial_index=asked, raw_data={MERIT: merit})

    def add(self, pose: list[float], merit: float) -> None:
        self.tell(self._client.attach_trial(parameters=self.space.point(pose)), pose, merit)
