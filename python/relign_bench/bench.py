"""Scenes, lenses, trials and results without an environment."""

import json
import operator
import pathlib
from dataclasses import dataclass, field

import numpy as np

from . import _native
from .batch import Batch


def list_plugins(kind="algorithm"):
    """Ids and presets of "scene", "noise-level" or "algorithm", sorted."""
    return _native.catalog().ids(kind)


class Bench:
    """One scene under one noise level.

        bench = Bench("relign_od", noise_level="rho0.25")
        lens = bench.lens(3)
        picture = lens.capture([0.5, 0.5, 0.5, 0.5, 0.5])
        trial = bench.run("nlopt-sbplx", instance=3)
        trial.table()                        # a pandas.DataFrame, a row per step

    suite_seed and the number of an instance mean what they mean in suites: the same lenses, frame by frame.
    """

    def __init__(self, scene="relign_od", noise_level="rho0.25", suite_seed=1, clipping="soft", scene_parameters=None,
                 noise_level_parameters=None, size=None, threads=None):
        self._chosen = dict(scene=scene, noise_level=noise_level, clipping=clipping, suite_seed=suite_seed, size=size,
                            scene_parameters=scene_parameters, noise_level_parameters=noise_level_parameters)
        self._threads = threads or _native.cores()
        self._trials = None
        batch = self.batch(1)
        self.description = batch.description  # what the scene says of itself
        self.reference = batch.reference  # float32, height x width
        self.axes = [axis["name"] for axis in self.description["axes"]]
        self.nominal_pose = batch.nominal_pose

    def batch(self, slots):
        """A relign_bench.batch.Batch of this scene and noise level."""
        return Batch(slots, threads=min(self._threads, slots), **self._chosen)

    def lens(self, instance=0, instances="benchmark"):
        """The lens of an instance on its stage. `instances`: "benchmark", "training" or "tuning"."""
        return Lens(self.batch(1), instance, instances)

    def run(self, algorithm, instance=0, steps=50, protocol="paper", merit=None, parameters=None, keep_frames=False):
        """One trial of an installed algorithm (id, preset or path) on a benchmark instance, as `relign-bench run` makes
        it. A failure of the algorithm is a trial whose `end` is "failed". Raises ValueError for what cannot be run."""
        instance, steps = whole(instance, "instance", 0), whole(steps, "steps", 1)
        if self._trials is None:
            chosen = self._chosen
            scene_parameters = _native.sized_parameters(chosen["scene"], chosen["scene_parameters"], chosen["size"])
            self._trials = _native._core.Trials(
                _native.catalog(), str(chosen["scene"]), _native.parameters_text(scene_parameters),
                str(chosen["noise_level"]), _native.parameters_text(chosen["noise_level_parameters"]),
                int(chosen["suite_seed"]), self._threads, _native._core.cache_folder())
        lines, frames = self._trials.run(str(algorithm), _native.parameters_text(parameters), instance, protocol,
                                         merit or "", self._chosen["clipping"], steps, bool(keep_frames))
        *made, closing, times = [json.loads(line) for line in lines.splitlines()]
        if frames is not None:
            frames = np.frombuffer(frames, np.float32).reshape(-1, *self.reference.shape)
        return Trial(closing, made, times, frames)


class Lens:
    """One lens before its sensor, on a stage that stands at the instance's start."""

    def __init__(self, batch, instance, instances):
        self._batch = batch
        instance = whole(instance, "instance", 0)
        batch.reset([0], [instance], instances)
        drawn = batch.instance(0)
        self.number, self.seed = drawn["number"], drawn["seed"]
        self.start = drawn["start"]  # true pose, shares of the travel
        self.distortion = drawn["distortion"]  # true move = distortion @ commanded move
        self.elements = drawn["elements"]

    def capture(self, true_pose, frame=0):
        """What the sensor sees with the lens at a true pose in [0, 1]: float32, height x width. Other frames have other
        noise."""
        return self._batch.capture_at([0], self._pose(true_pose), [_frame_seed(self.seed, frame)])[0]

    def render(self, true_pose):
        """The same without noise. Raises ValueError where the scene offers none."""
        return self._batch.render_at([0], self._pose(true_pose))[0]

    def _pose(self, true_pose):
        pose, axes = np.asarray(true_pose, np.float64), len(self.start)
        if pose.shape != (axes,) or not ((pose >= 0) & (pose <= 1)).all():
            raise ValueError(f"a true pose is {axes} numbers from 0 to 1, this is {true_pose!r}")
        return pose[None]

    def move_by(self, move):
        """Moves the stage as commanded, in shares of the travel, and gives what the sensor sees then."""
        self._batch.move_by([0], np.asarray(move, np.float64)[None])
        return self._batch.frames[0].copy()

    @property
    def true_pose(self):
        return self._batch.true_poses([0])[0]

    def noise_free_mse(self):
        """Of the picture at the true pose against the reference, and its standard error."""
        mse, error = self._batch.truths([0])
        return float(mse[0]), float(error[0])

    def noise_free_rmse(self):
        return float(np.sqrt(max(0.0, self.noise_free_mse()[0])))

    def own_optimum(self):
        """(true pose, noise-free RMSE) at which this lens is best; None where the scene does not look for it."""
        found = self._batch.optima([0])[0]
        return None if found is None else (found[0], float(np.sqrt(max(0.0, found[1]))))


def whole(number, name, least):
    """A whole number of at least `least`; ValueError with its name for anything else."""
    try:
        value = operator.index(number)
    except TypeError:
        value = None
    if value is None or value < least:
        raise ValueError(f"{name}={number!r}: allowed: whole numbers from {least}")
    return value


def _frame_seed(seed, frame):
    # Any fixed map will do: these frames belong to no trial.
    return int(np.random.SeedSequence([int(seed), int(frame)]).generate_state(1, np.uint64)[0])


@dataclass
class Trial:
    """What a trial recorded: `summary` is its closing line, `steps` a dictionary per step, `frames` the captures."""

    summary: dict
    steps: list
    times: dict = field(repr=False)
    frames: object = field(default=None, repr=False)

    @property
    def end(self):
        return self.summary["end"]

    @property
    def message(self):
        return self.summary.get("message", "")

    def rmse(self, track="recommended"):
        """Noise-free RMSE after every step, shape (steps + 1,), of the "recommended" or "commanded" pose; "measured"
        is that of the captures."""
        if track not in ("recommended", "commanded", "measured"):
            raise ValueError(f"there is no track '{track}' of a trial; tracks: recommended, commanded, measured")
        if track == "measured":
            return np.array([_number(step["measured"]) for step in self.steps])
        return np.sqrt(np.maximum(0.0, [_number(step[track + "_mse"]) for step in self.steps]))

    def table(self):
        """A pandas.DataFrame, a row per step."""
        import pandas

        return pandas.DataFrame(self.steps)


def _number(value):
    return np.nan if value is None else float(value)


def read_results(folder, what="curves"):
    """A table of a results folder as a pandas.DataFrame: "curves" (medians over instances, a row per step), "instances"
    (a row per trial) or "steps" (every step of every trial).

    Raises FileNotFoundError for a folder without results.
    """
    import pandas

    folder = pathlib.Path(folder)
    if not (folder / "manifest.json").is_file():
        raise FileNotFoundError(f"{folder} holds no results: there is no manifest.json in it")
    if what in ("curves", "instances"):
        table = folder / (what + ".csv")
        if not table.is_file():
            raise FileNotFoundError(f"{table} is missing; `relign-bench report {folder}` writes it")
        return pandas.read_csv(table)
    if what != "steps":
        raise ValueError(f"there is no table '{what}'; tables: curves, instances, steps")
    if not (folder / "trials").is_dir():
        raise FileNotFoundError(f"{folder} was published without its raw trials: there is no folder trials in it")
    rows, closing = [], {}
    for path in sorted((folder / "trials").glob("*.jsonl")):
        for line in path.read_text().splitlines():
            try:
                record = json.loads(line)
            except ValueError:
                continue  # the half-written end of a run that was killed
            if "end" in record:
                closing[record["trial"]] = record
            else:
                rows.append(record)
    keys = ("scene", "noise_level", "protocol", "algorithm", "instance")
    # A trial counts by its closing line; steps of one that was cut off belong to nothing.
    return pandas.DataFrame([{**{key: closing[row["trial"]][key] for key in keys}, **row} for row in rows
                             if row["trial"] in closing])
