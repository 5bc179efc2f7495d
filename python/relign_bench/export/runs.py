"""Trials of a results folder as runs of an optimiser: evaluations, poses and one error."""

from __future__ import annotations

import contextlib
import os
import pathlib
import re
import shutil
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .._errors import check_name
from .._score import Score, score_of
from ..results import ENDED_WELL, read_manifest, read_trials

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

#: What the exported number is, by the name of the error.
ERRORS = {
    "recommended": "noise-free {score} at the recommended pose, after gluing",
    "commanded": "noise-free {score} at the commanded pose",
    "measured": "{score} as the capture measures it, noise included",
}
ONLY_KEYS = ("scene", "noise_level", "algorithm", "protocol", "instance")


@dataclass(frozen=True)
class Run:
    """One trial. Evaluation k is step k - 1: the first is the capture at the start pose.

    Attributes:
        instance: Number of the instance in the suite, from 0.
        poses: One commanded pose per evaluation, shares of the travel.
        errors: One score of the scene per evaluation; the noise-free ones are not negative.
        seconds: Simulated machine seconds until each evaluation was done.
    """

    instance: int
    poses: list[list[float]]
    errors: list[float]
    seconds: list[float]

    @property
    def best(self) -> int:
        """Index of the first evaluation with the lowest error."""
        return min(range(len(self.errors)), key=self.errors.__getitem__)


@dataclass(frozen=True)
class Function:
    """A scene at a noise level, which other programs call a function.

    Attributes:
        number: Its id, from 1, in the order of the suite.
    """

    number: int
    scene: str
    noise_level: str

    @property
    def name(self) -> str:
        """Scene and noise level in one word."""
        return f"{self.scene}@{self.noise_level}"


@dataclass
class Study:
    """What is exported of a results folder.

    Attributes:
        suite: Name of the suite.
        error: One of ERRORS.
        score: Name and unit of the score of its scenes.
        runs: Runs by (algorithm, function), in the order of the suite. With several protocols, an algorithm's name has its
            protocol.
        left_out: Number of failed trials, which are not exported.
        missing: Number of planned trials without a complete record.
    """

    suite: str
    error: str
    score: str
    runs: dict[tuple[str, Function], list[Run]] = field(default_factory=dict)
    left_out: int = 0
    missing: int = 0

    @property
    def algorithms(self) -> list[str]:
        """Names of the methods."""
        return list(dict.fromkeys(name for name, _ in self.runs))

    @property
    def functions(self) -> list[Function]:
        """The scenes and noise levels that have runs."""
        return list(dict.fromkeys(function for _, function in self.runs))

    def of(self, algorithm: str) -> list[tuple[Function, list[Run]]]:
        """The runs of a method by function."""
        return [(function, runs) for (name, function), runs in self.runs.items() if name == algorithm]


def read_study(folder: str | os.PathLike[str], error: str = "recommended", only: Iterable[str] = ()) -> Study:
    """The trials of a results folder that did not fail.

    Args:
        folder: A results folder, also one that `relign-bench merge` wrote.
        error: "recommended", "commanded" or "measured".
        only: KEY=VALUE with a key of ONLY_KEYS: only trials with this value, or one of the values of a repeated key.

    Raises:
        FileNotFoundError: The folder has no results, or no trials.
        ValueError: A record is damaged, an argument is not valid, or a trial has no such error.
    """
    check_name(error, ERRORS, "error")
    manifest, trials, missing = chosen_trials(folder, only)
    several = len({closing["protocol"] for closing, _ in trials}) > 1
    # All pairs of the suite are numbered, so that ids do not depend on what is left out.
    pairs = [(scene["name"], level if isinstance(level, str) else level["name"])
             for scene in manifest["scenes"] for level in manifest["noise_levels"]]
    functions = {pair: Function(number, *pair) for number, pair in enumerate(pairs, 1)}
    scores = {scene["name"]: score_of(scene) for scene in manifest["scenes"]}
    labels = {score.label for score in scores.values()}
    score = labels.pop() if len(labels) == 1 else "score of each scene"
    study = Study(str(manifest["suite_name"]), error, score, missing=missing)
    for closing, steps in trials:
        if closing["end"] not in ENDED_WELL:
            study.left_out += 1
            continue
        name = f"{closing['algorithm']} ({closing['protocol']})" if several else str(closing["algorithm"])
        function = functions.get((closing["scene"], closing["noise_level"]))
        if function is None:
            raise ValueError(f"trial '{closing['trial']}' is of scene '{closing['scene']}' at noise level "
                             f"'{closing['noise_level']}', which '{pathlib.Path(folder) / 'manifest.json'}' does not have")
        study.runs.setdefault((name, function), []).append(_run(closing, steps, error, scores[closing["scene"]]))
    if not study.runs:
        raise ValueError(f"'{folder}' has no trial to export: {study.left_out} failed, and no other was chosen")
    return study


def chosen_trials(folder: str | os.PathLike[str], only: Iterable[str] = ()) -> tuple[
        dict[str, Any], list[tuple[dict[str, Any], list[dict[str, Any]]]], int]:
    """The manifest of a results folder, the trials that `only` chooses, as read_trials returns them, and how many are missing.

    A trial is missing if the folder has no complete record of it, whatever `only` is.

    Raises:
        FileNotFoundError: The folder has no results, or no trials.
        ValueError: A record is damaged, none is complete, or a value of `only` is that of no trial.
    """
    manifest, trials = read_manifest(folder), read_trials(folder, checked=True)
    missing = len(manifest["order"]) - len(trials)
    if not trials:
        raise ValueError(f"'{folder}' has no complete trial; relign-bench run resumes an interrupted run")
    wanted = parse_only(only)
    for key, values in wanted.items():
        for value in values:
            check_name(value, dict.fromkeys(str(closing[key]) for closing, _ in trials), key.replace("_", " "))
    return manifest, [(closing, steps) for closing, steps in trials
                      if all(str(closing[key]) in values for key, values in wanted.items())], missing


def parse_only(only: Iterable[str]) -> dict[str, set[str]]:
    """The allowed values of each key of --only.

    Raises:
        ValueError: A text is not KEY=VALUE with a key of ONLY_KEYS.
    """
    wanted: dict[str, set[str]] = {}
    for text in only:
        key, equals, value = text.partition("=")
        if not equals:
            raise ValueError(f"--only '{text}' must be KEY=VALUE; keys: {', '.join(ONLY_KEYS)}")
        check_name(key, ONLY_KEYS, "key")
        wanted.setdefault(key, set()).add(value)
    return wanted


def _run(closing: dict[str, Any], steps: list[dict[str, Any]], error: str, score: Score) -> Run:
    column = "measured" if error == "measured" else error + "_mse"
    errors = []
    for step in steps:
        if step[column] is None:
            raise ValueError(f"trial '{closing['trial']}' has no {error} error at step {step['step']}: "
                             + ("the capture was one of regions; export --error recommended" if error == "measured" else
                                "a station has no ground truth; export --error measured"))
        errors.append(step[column] if error == "measured" else float(score.shown(step[column])))
    pose = "recommended_pose" if error == "recommended" else "commanded_pose"
    return Run(int(closing["instance"]), [step[pose] for step in steps], errors,
               [step["machine_seconds"] for step in steps])


def readme(study: Study, template: str, prefix: str = "", **more: Any) -> str:
    """A format's README: its template, with the study's facts, and the functions, whose numbers have a prefix."""
    meaning = meaning_of(study.error, study.score)
    text = template.format(suite=study.suite, meaning=meaning, error=study.error, left_out=study.left_out, **more)
    return text + "".join(f"{prefix + str(function.number):<8}  {function.scene}, {function.noise_level}\n"
                          for function in study.functions)


def meaning_of(error: str, score: str = "score") -> str:
    """What the exported number is.

    Args:
        error: One of ERRORS.
        score: Name and unit of the score, where the scenes have the same one.
    """
    return ERRORS[error].format(score=score)


def file_names(names: Sequence[str], kept: str = ".+-") -> dict[str, str]:
    """A file name for each name: letters, digits and the characters `kept`, different for different names."""
    made: dict[str, str] = {}
    for name in names:
        plain = re.sub(rf"[^A-Za-z0-9{re.escape(kept)}]+", "_", name).strip("._") or "_"
        count, unique = 1, plain
        while unique.lower() in {other.lower() for other in made.values()}:
            count += 1
            unique = f"{plain}_{count}"
        made[name] = unique
    return made


@contextlib.contextmanager
def new_folder(folder: str | os.PathLike[str]) -> Iterator[pathlib.Path]:
    """A folder beside `folder` to write into, which gets its name once it is complete, and is removed after an error.

    Raises:
        FileExistsError: `folder` exists and is not empty.
    """
    folder = pathlib.Path(os.path.realpath(folder))  # '.' has no name, and a link cannot be replaced
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise FileExistsError(f"'{folder}' exists; remove it, or choose another folder")
    new = folder.with_name(f"{folder.name}.new-{os.getpid()}")
    try:
        new.mkdir(parents=True)
    except OSError as problem:
        problem.filename = str(folder)
        raise
    try:
        yield new
        if folder.exists():
            folder.rmdir()
        new.rename(folder)
    except BaseException:
        shutil.rmtree(new, ignore_errors=True)
        raise
