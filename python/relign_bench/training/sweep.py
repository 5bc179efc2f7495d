"""Many training runs from one file: side by side, resumable, with a table and a figure at the end (sweep_report.py)."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .._errors import unknown_name
from .._json import unique_keys
from .._native import available_cores
from .curves import read_csv
from .folder import check_same, read_recipe
from .logs import check_loggers
from .recipe import Recipe, check_recipe, check_warm_start, preset_recipe, setting_text
from .settings import with_goal, with_settings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

KEYS = ("$schema", "scene", "trainings")
TRAINING_KEYS = ("name", "figure", "preset", "algorithm", "warm_start", "settings", "vary", "seeds")
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._=-]*")
PROGRAM = (sys.executable, "-m", "relign_bench.training")
KEPT_LINES = 20  # of a run's output, in which the reason of a failure is searched


@dataclass(frozen=True)
class Job:
    """One training of a sweep.

    Attributes:
        group: Name of the recipe; runs of a group differ in their seeds only.
        figure: Name of the row of the figure.
        recipe: The recipe.
        folder: Folder of the run.
        arguments: Of `relign-train`, without threads and device.
        warm_start: Folder of the initial weights, or None.
    """

    group: str
    figure: str
    recipe: Recipe
    folder: pathlib.Path
    arguments: tuple[str, ...]
    warm_start: pathlib.Path | None = None

    @property
    def name(self) -> str:
        """Name of the training."""
        return f"{self.group}/seed-{self.recipe.seed}"

    def complete(self) -> bool:
        """Whether the training has ended and the network with the best score has been written."""
        try:
            rows = read_csv(self.folder / "curve.csv", ("steps", "score"))
            errors = read_csv(self.folder / "errors.csv", ("steps", "after"))
            if int(rows[-1]["steps"]) < self.recipe.total or errors[-1]["steps"] != rows[-1]["steps"]:
                return False
            if self.recipe.algorithm == "recurrent-ppo":
                return True
            written = json.loads((self.folder / "ppo.json").read_text(), object_pairs_hook=unique_keys)["trained"]["steps"]
            scores = {int(row["steps"]): float(row["score"]) for row in rows[self.recipe.warm_up:]}
            return (self.folder / "ppo.onnx").is_file() and scores[written] == min(scores.values())
        except (OSError, ValueError, LookupError, TypeError):  # files that the training writes anew
            return False


def read_sweep(path: str | os.PathLike[str], out: str | os.PathLike[str]) -> list[Job]:
    """The training runs of a file (docs/schemas/sweep.schema.json), a list of them or an object with `trainings`.

    Args:
        path: The file.
        out: Folder of the sweep.

    Raises:
        ValueError: The file is not valid, or the folder of a run has another recipe.
    """
    path = pathlib.Path(path)
    try:
        content = json.loads(path.read_text(), object_pairs_hook=unique_keys)
    except json.JSONDecodeError as problem:
        raise ValueError(f"{path}: not JSON: {problem}") from None
    except ValueError as problem:
        raise ValueError(f"{path}: {problem}") from None
    if isinstance(content, list):
        content = {"trainings": content}
    with _at(f"{path}"):
        _check_keys(content, KEYS, ("trainings",))
        if not isinstance(content["trainings"], list) or not content["trainings"]:
            raise ValueError("trainings: expected a list of at least one training")
    jobs = []
    for number, training in enumerate(content["trainings"]):
        with _at(f"{path}: trainings[{number}]"):
            jobs += _jobs_of(training, str(content.get("scene", "relign_od")), path.parent, pathlib.Path(out))
    names = [job.name for job in jobs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{path}: '{name}' is there twice; give each entry its own name")
    for job in jobs:
        with _at(f"{path}: {job.name}"):
            grows = ("total",) if job.recipe.rate == job.recipe.last_rate else ()
            check_same(job.folder, job.recipe, grows, ignored=("warm_start",))
            if (job.folder / "recipe.json").is_file():
                begun = read_recipe(job.folder, "ppo").get("warm_start")
                if bool(begun) != bool(job.warm_start):
                    raise ValueError(f"'{job.folder}' has a run {'with' if begun else 'without'} initial weights, the file one "
                                     f"{'without' if begun else 'with'}; choose another folder, or remove this one")
    return jobs


@contextlib.contextmanager
def _at(place: str) -> Iterator[None]:
    try:
        yield
    except ValueError as problem:
        raise ValueError(f"{place}: {problem}") from None


def _check_keys(given: Any, allowed: tuple[str, ...], required: tuple[str, ...]) -> None:
    if not isinstance(given, dict):
        raise ValueError(f"expected an object, found {json.dumps(given)}")
    for key in given:
        if key not in allowed:
            raise ValueError(unknown_name("key", key, allowed))
    for key in required:
        if key not in given:
            raise ValueError(f"key '{key}' is missing")


def _setting(name: str, value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, (int, float, str, list)):
        raise ValueError(f"settings: {name}: expected a number, a text or a list of numbers, found {json.dumps(value)}")
    return f"{name}={setting_text(value)}"


def _jobs_of(training: Any, scene: str, folder: pathlib.Path, out: pathlib.Path) -> list[Job]:
    _check_keys(training, TRAINING_KEYS, ("name", "seeds"))
    name = training["name"]
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise ValueError(f"name: expected letters, digits, '.', '_', '-' and '=', found {json.dumps(name)}")
    seeds = training["seeds"]
    if (not isinstance(seeds, list) or not seeds or len(set(map(str, seeds))) < len(seeds)
            or any(type(seed) is not int or seed < 0 for seed in seeds)):
        raise ValueError(f"seeds: expected a list of different non-negative integers, found {json.dumps(seeds)}")
    settings, vary = training.get("settings", {}), training.get("vary", {})
    for key, values in (("settings", settings), ("vary", vary)):
        if not isinstance(values, dict):
            raise ValueError(f"{key}: expected an object, found {json.dumps(values)}")
    for key in ("scene", "seed", "preset", "algorithm", "warm_start"):
        if key in settings or key in vary:
            raise ValueError(f"settings: {key}: use the key '{'seeds' if key == 'seed' else key}' of the file instead")
    for key, values in vary.items():
        if not isinstance(values, list) or not values:
            raise ValueError(f"vary: {key}: expected a list of values, found {json.dumps(values)}")
    preset, algorithm = str(training.get("preset", "paper")), str(training.get("algorithm", "ppo"))
    jobs: list[Job] = []
    for varied in itertools.product(*vary.values()):
        of_group = {**settings, **dict(zip(vary, varied))}
        texts = [_setting(key, value) for key, value in of_group.items()]
        group = "-".join([name, *(_setting(key, value) for key, value in zip(vary, varied))]).replace(",", "+")
        for seed in seeds:
            recipe = with_goal(with_settings(preset_recipe(preset, algorithm, scene, seed), texts), texts)
            check_recipe(recipe)
            if any(recipe == job.recipe for job in jobs):
                raise ValueError(f"vary: {group} is the same training as another one")
            arguments = ["ppo", "--preset", preset, "--algorithm", algorithm, "--scene", scene, "--seed", str(seed),
                         *(part for text in texts for part in ("--set", text))]
            warm = folder / str(training["warm_start"]) if "warm_start" in training else None
            if warm:
                arguments += ["--warm-start", str(warm)]
            place = out / group / f"seed-{seed}"
            jobs.append(Job(group, str(training.get("figure", name)), recipe, place, (*arguments, "-o", str(place)), warm))
    return jobs


class Sweep:
    """Executes training runs, each in its own process.

    Args:
        jobs: The runs.
        side_by_side: How many run at once.
        threads: Threads of each; None: the cores, shared equally.
        device: Torch device.
        minutes: No training segment begins that would end later than this from now; None: no limit.
        log: Gets the lines of progress.
        program: relign-train.
        render: Where images are rendered.
        loggers: Names of the logs of each run (logs.NEEDS); None: relign-train's own choice.

    Raises:
        ImportError: The package of a log is not installed.
    """

    def __init__(self, jobs: list[Job], side_by_side: int, threads: int | None = None, device: str = "cpu",
                 minutes: float | None = None, log: Callable[[str], object] = print,
                 program: Sequence[str] = PROGRAM, render: str = "cpu",
                 loggers: Sequence[str] | None = None) -> None:
        check_loggers(loggers or ())
        self._jobs, self._side_by_side, self._log, self._program = jobs, side_by_side, log, program
        self._threads = threads or max(1, available_cores() // side_by_side)
        self._further = ["--threads", str(self._threads), "--device", device, "--render", render]
        self._further += [part for name in loggers or () for part in ("--log", name)]
        self._end = None if minutes is None else time.monotonic() + 60 * minutes
        self._running: list[subprocess.Popen[str]] = []
        self._lock, self._stopping = threading.Lock(), False

    def run(self) -> dict[str, str]:
        """Runs what is not complete.

        Returns:
            The reason of each failure, by name of the training.

        Raises:
            ValueError: The folder of initial weights does not suit.
            KeyboardInterrupt: The process was interrupted or told to end; the runs have been ended before.
        """
        missing = [job for job in self._jobs if not job.complete()]
        for job in self._jobs:
            with _at(job.name):
                check_warm_start(job.recipe, job.warm_start)
        before = signal.signal(signal.SIGTERM, _interrupt) if threading.current_thread() is threading.main_thread() else None
        if len(missing) < len(self._jobs):
            self._log(f"{len(self._jobs) - len(missing)} of {len(self._jobs)} runs are complete already")
        with ThreadPoolExecutor(self._side_by_side) as pool:
            try:
                reasons = list(pool.map(self._train, missing))
            except BaseException:
                self._stop()
                raise
            finally:
                if before is not None:
                    signal.signal(signal.SIGTERM, before)
        return {job.name: reason for job, reason in zip(missing, reasons) if reason}

    def _stop(self) -> None:
        with self._lock:
            self._stopping = True
            for process in self._running:
                process.terminate()

    def _train(self, job: Job) -> str:
        further = list(self._further)
        if self._end is not None:
            left = (self._end - time.monotonic()) / 60
            if left <= 0:
                self._log(f"{job.name}: not started, the time is over")
                return ""
            further += ["--minutes", f"{left:.4f}"]
        environment = {**os.environ, "OMP_NUM_THREADS": str(self._threads), "PYTHONUNBUFFERED": "1"}
        job.folder.mkdir(parents=True, exist_ok=True)
        last: deque[str] = deque(maxlen=KEPT_LINES)
        with open(job.folder / "log.txt", "a", encoding="utf-8") as log:
            with self._lock:
                if self._stopping:
                    return ""
                process = subprocess.Popen([*self._program, *job.arguments, *further], text=True, stdout=subprocess.DEVNULL,
                                           stderr=subprocess.PIPE, env=environment)
                self._running.append(process)
            assert process.stderr is not None
            with process.stderr:
                for line in process.stderr:
                    last.append(line.rstrip())
                    log.write(line)
                    log.flush()
                    # Warnings of libraries are in log.txt alone.
                    if " steps" in line or " step " in line or line.startswith("warning: "):
                        self._log(f"{job.name}: {line.rstrip()}")
        status = process.wait()
        with self._lock:
            self._running.remove(process)
        if status == 0 or self._stopping:
            return ""
        reason = _reason(status, list(last))
        self._log(f"{job.name}: {reason}")
        return reason


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _reason(status: int, lines: list[str]) -> str:
    if status < 0:
        name = signal.Signals(-status).name
        why = ", which often means too little memory: run fewer at once (--jobs), or set a smaller size or environments"
        return f"ended by signal {name}{why if name == 'SIGKILL' else ''}; the same command resumes it"
    errors = [line for line in lines if line.startswith("error: ")]
    return errors[-1].removeprefix("error: ") if errors else f"ended with status {status}; see log.txt"
