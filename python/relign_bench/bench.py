"""Scenes, instances, trials and results, without a Gymnasium environment."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _html, _native
from ._errors import check_name, require_integer
from ._score import RMSE, Score, score_of
from .batch import Batch
from .results import ENDED_WELL, step_rows

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas

    from ._typing import Float32Array, Float64Array, Parameters, Plugin

LARGEST_BUDGET = 100_000  # steps, as of suites (core/foundation/base/limits.h)
TRACKS = ("recommended", "commanded", "measured")


def list_plugins(kind: str = "algorithm") -> list[str]:
    """Ids and presets of the installed plugins of a kind, sorted.

    Args:
        kind: "scene", "noise-level" or "algorithm".

    Raises:
        ValueError: There is no such kind.
    """
    return _native.catalog().ids(kind)


class Bench:
    """One scene under one noise level.

        bench = Bench("relign_od", noise_level="rho0.25")
        instance = bench.instance(3)
        image = instance.capture([0.5, 0.5, 0.5, 0.5, 0.5])
        trial = bench.run("nlopt-sbplx", instance=3)
        trial.table()                        # a pandas.DataFrame, one row per step

    The suite seed and an instance's number mean the same as in suites: equal instances, equal captures.

    Args:
        scene: Id, preset or path of a scene, or an object as in a suite: {"use": ..., "parameters": {...}}.
        noise_level: A noise level, likewise.
        suite_seed: Seed of the instances, as in a suite.
        clipping: "soft" stops every axis at its own limit, "hard" stops the whole move at the first limit.
        scene_parameters: Parameters of the scene.
        noise_level_parameters: Parameters of the noise level.
        size: Columns of the sensor, for scenes whose sensor can be chosen; None keeps the scene's own.
        threads: Threads that render; None uses all cores. Results do not depend on it.

    Attributes:
        description: The scene's description: axes, nominal_pose, image, elements.
        reference: Noise-free image of the perfect lens at the nominal pose, shape (height, width), in the scene's units.
        axes: Names of the axes.
        nominal_pose: Nominal pose in shares of the travel, shape (axes,).

    Raises:
        ValueError: A name, parameter or size is not valid.
    """

    def __init__(self, scene: Plugin = "relign_od", noise_level: Plugin = "rho0.25", suite_seed: int = 1,
                 clipping: str = "soft", scene_parameters: Parameters | None = None,
                 noise_level_parameters: Parameters | None = None, size: int | None = None,
                 threads: int | None = None) -> None:
        self._scene, self._scene_parameters = _native.chosen_plugin("scene", scene, scene_parameters)
        self._noise_level, self._noise_level_parameters = _native.chosen_plugin("noise level", noise_level,
                                                                                noise_level_parameters)
        self._clipping, self._suite_seed, self._size = clipping, suite_seed, size
        self._threads = _native.chosen_threads(threads)
        self._trials: Any = None  # made by the first run
        batch = self.batch(1)
        self.description = batch.description
        self.reference = batch.reference
        self.axes: list[str] = [axis["name"] for axis in self.description["axes"]]
        self.nominal_pose = batch.nominal_pose

    def _repr_html_(self) -> str:
        height, width = self.reference.shape
        rows: list[list[Any]] = [["axes", ", ".join(self.axes)], ["image", f"{width} x {height} pixels"],
                                 ["suite seed", self._suite_seed]]
        return _html.block(f"{self._scene}, noise level {self._noise_level}",
                           _html.images([("reference: the perfect lens at the nominal pose", self.reference)]),
                           _html.table([], rows))

    def batch(self, slots: int) -> Batch:
        """A Batch of this scene and noise level."""
        return Batch(slots, self._scene, self._noise_level, self._clipping, self._suite_seed, self._size,
                     self._scene_parameters, self._noise_level_parameters, min(self._threads, slots))

    def instance(self, number: int = 0, instances: str = "benchmark") -> Instance:
        """An instance, with its lens on a stage at the start pose.

        Args:
            number: Number of the instance, as in a suite.
            instances: Family of the instances: "benchmark", "training" or "tuning".

        Raises:
            ValueError: The number is not a non-negative integer, or there is no such family.
        """
        return Instance(self.batch(1), number, instances)

    def run(self, algorithm: Plugin, instance: int = 0, steps: int = 50, protocol: str = "paper", merit: str | None = None,
            parameters: Parameters | None = None, keep_frames: bool = False) -> Trial:
        """Runs one trial on a benchmark instance, as `relign-bench run` does.

        Args:
            algorithm: Id, preset or path of an algorithm, or an object as in a suite.
            instance: Number of the benchmark instance.
            steps: Budget, in steps after the capture at the start pose; at most 100,000, as in suites.
            protocol: "paper" or "blind".
            merit: "combined", "rmse", "mtf" or "edge_energy"; None: the protocol's own.
            parameters: Parameters of the algorithm.
            keep_frames: Whether the trial keeps its captures.

        Returns:
            The trial. If the algorithm fails, its `end` is "failed".

        Raises:
            ValueError: An argument is not valid.
        """
        algorithm, parameters = _native.chosen_plugin("algorithm", algorithm, parameters)
        instance, steps = require_integer(instance, "instance", 0), require_integer(steps, "steps", 1, LARGEST_BUDGET)
        if self._trials is None:
            scene_parameters = _native.sized_parameters(self._scene, self._scene_parameters, self._size)
            self._trials = _native.make_trials(self._scene, scene_parameters, self._noise_level,
                                               self._noise_level_parameters, int(self._suite_seed), self._threads)
        lines, pixels = self._trials.run(algorithm, _native.parameters_text(parameters), instance, protocol,
                                         merit or "", self._clipping, steps, bool(keep_frames))
        frames = None if pixels is None else np.frombuffer(pixels, np.float32).reshape(-1, *self.reference.shape)
        return trial_of(lines, frames, score_of(self.description))


class Instance:
    """One instance: a lens with its element offsets, on a stage at the start pose. `Bench.instance` makes it.

    Attributes:
        number: Its number within the family.
        seed: Its seed.
        start: True start pose in shares of the travel, shape (axes,).
        distortion: Movement distortion, shape (axes, axes): true move = distortion @ commanded move.
        elements: Offsets by element: {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}}.
        stage: Errors of the stage in shares of the travel, as a noise level draws them; empty for a linear stage.
    """

    def __init__(self, batch: Batch, number: int, instances: str) -> None:
        self._batch = batch
        batch.reset([0], [number], instances)
        drawn = batch.instance(0)
        self.number: int = drawn["number"]
        self.seed: int = drawn["seed"]
        self.start: Float64Array = drawn["start"]
        self.distortion: Float64Array = drawn["distortion"]
        self.elements: dict[str, Any] = drawn["elements"]
        self.stage: dict[str, Any] = drawn["stage"]

    def _repr_html_(self) -> str:
        axes = [axis["name"] for axis in self._batch.description["axes"]]
        elements = [[name, ", ".join(f"{1e3 * shift:.3g}" for shift in offsets["shift_mm"]),
                     ", ".join(f"{tilt:.3g}" for tilt in offsets["tilt_deg"])] for name, offsets in self.elements.items()]
        return _html.block(
            f"instance {self.number}",
            _html.images([("capture at the present pose", self.capture(self.true_pose)), ("reference", self._batch.reference)],
                         float(np.quantile(self._batch.reference, 0.998))),
            _html.table(["true pose", *axes], [["start", *(f"{share:.3f}" for share in self.start)],
                                               ["present", *(f"{share:.3f}" for share in self.true_pose)]]),
            _html.table(["element", "shift, µm", "tilt, degrees"], elements) if elements else "")

    def capture(self, true_pose: npt.ArrayLike, frame: int = 0) -> Float32Array:
        """A capture with the lens at a true pose; the stage does not move.

        Args:
            true_pose: Shape (axes,), each value in [0, 1].
            frame: Number of the frame, which decides the noise.

        Returns:
            Image in the scene's units, shape (height, width).

        Raises:
            ValueError: The pose has another shape or leaves the travel, or the frame is not a non-negative integer.
        """
        seed = _frame_seed(self.seed, require_integer(frame, "frame", 0))
        return self._batch.capture_at([0], self._pose(true_pose), [seed])[0]

    def render(self, true_pose: npt.ArrayLike) -> Float32Array:
        """The noise-free image with the lens at a true pose; the stage does not move.

        Args:
            true_pose: Shape (axes,), each value in [0, 1].

        Returns:
            Image in the scene's units, shape (height, width).

        Raises:
            ValueError: The pose has another shape or leaves the travel, or the scene renders no noise-free images.
        """
        return self._batch.render_at([0], self._pose(true_pose))[0]

    def _pose(self, true_pose: npt.ArrayLike) -> Float64Array:
        pose, axes = np.asarray(true_pose, np.float64), len(self.start)
        if pose.shape != (axes,) or not ((pose >= 0) & (pose <= 1)).all():
            raise ValueError(f"a true pose must be {axes} numbers from 0 to 1, not {true_pose!r}")
        return pose[None]

    def move_by(self, move: npt.ArrayLike) -> Float32Array:
        """Moves the stage by a commanded move in shares of the travel, shape (axes,), and captures.

        Returns:
            Image in the scene's units, shape (height, width).
        """
        self._batch.move_by([0], np.asarray(move, np.float64)[None])
        return self._batch.frames[0].copy()

    @property
    def true_pose(self) -> Float64Array:
        """True pose of the stage in shares of the travel, shape (axes,)."""
        return self._batch.true_poses([0])[0]

    def noise_free_mse(self) -> tuple[float, float]:
        """Ground truth: noise-free MSE, or the score that the scene declares, at the true pose, and its standard error.

        The estimate is unbiased and may be slightly negative near an optimum.
        """
        mse, error = self._batch.noise_free_mse([0])
        return float(mse[0]), float(error[0])

    def noise_free_error(self) -> float:
        """Ground truth: noise-free score at the true pose, the RMSE of a scene that compares images; never negative."""
        return float(score_of(self._batch.description).shown(self.noise_free_mse()[0]))

    def own_optimum(self) -> tuple[Float64Array, float] | None:
        """The instance's optimum: (true pose, noise-free score).

        Returns:
            None where the scene does not search for it.
        """
        found = self._batch.optima([0])[0]
        return None if found is None else (found[0], float(score_of(self._batch.description).shown(found[1])))


def _frame_seed(seed: int, frame: int) -> int:
    # These captures belong to no trial, so any fixed map is as good as another.
    return int(np.random.SeedSequence([int(seed), int(frame)]).generate_state(1, np.uint64)[0])


@dataclass
class Trial:
    """The record of a trial; results/README.md has the keys.

    Attributes:
        summary: The closing line of the record.
        steps: One dictionary per step, beginning with step 0, the capture at the start pose.
        times: Times of the host.
        frames: Captures in the scene's units, shape (steps + 1, height, width); None unless they were kept.
        score: What the scene judges poses by.
    """

    summary: dict[str, Any]
    steps: list[dict[str, Any]]
    times: dict[str, Any] = field(repr=False)
    frames: Float32Array | None = field(default=None, repr=False)
    score: Score = field(default=RMSE, repr=False)

    def _repr_html_(self) -> str:
        rows: list[list[Any]] = [["steps", len(self.steps) - 1], ["end", self.end]]
        if self.message:
            rows.append(["message", self.message])
        curves = []
        for track in TRACKS:
            values = [float(value) if np.isfinite(value) else None for value in self.errors(track)]
            curves.append(_html.Series(track, list(range(len(values))), values))
            rows.append([f"{track} {self.score.name}, first and last", " → ".join(map(_html.number, (values[0], values[-1])))])
        frames = [] if self.frames is None else [("capture at the start", self.frames[0]), ("last capture", self.frames[-1])]
        known = [one for one in curves if any(value is not None for value in one.values)]
        return _html.block(
            "{algorithm} on instance {instance} of {scene}, {noise_level}".format_map(self.summary),
            _html.chart(known, "step", self.score.label), _html.images(frames) if frames else "", _html.table([], rows))

    @property
    def end(self) -> str:
        """How the trial ended: "budget_spent", "finished", "failed" or another word of results/README.md."""
        return str(self.summary["end"])

    @property
    def ended_well(self) -> bool:
        """Whether the budget was spent or the algorithm finished."""
        return self.end in ENDED_WELL

    @property
    def message(self) -> str:
        """The error message of a failed trial, else ""."""
        return str(self.summary.get("message", ""))

    def errors(self, track: str = "recommended") -> Float64Array:
        """The score after every step, shape (steps + 1,), the RMSE of a scene that compares images; NaN where unknown.

        Args:
            track: "recommended" or "commanded": noise-free, at that pose; "measured": of the captures, noise included.

        Raises:
            ValueError: There is no such track.
        """
        check_name(track, TRACKS, "track")
        if track == "measured":
            return np.array([_number(step["measured"]) for step in self.steps])
        return self.score.shown([_number(step[track + "_mse"]) for step in self.steps])

    def table(self) -> pandas.DataFrame:
        """The steps as a pandas.DataFrame, one row per step, with its criteria."""
        import pandas

        return pandas.DataFrame(step_rows(self.steps, self.summary))


def trial_of(lines: str, frames: Float32Array | None = None, score: Score = RMSE) -> Trial:
    """The trial of the lines of its record and times."""
    *steps, closing, times = map(json.loads, lines.splitlines())
    return Trial(closing, steps, times, frames, score)


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
