"""Results of a run, also as data frames; needs pandas or polars for these, never the compiled module."""

from __future__ import annotations

import collections
import csv
import hashlib
import json
import pathlib
import re
import shlex
from typing import TYPE_CHECKING, Any

from . import _html
from ._columns import PER_STEP, TABLED
from ._errors import check_name
from ._json import unique_keys
from ._score import RMSE, score_of

if TYPE_CHECKING:
    import os

TABLES = ("curves", "instances", "steps")
ENDED_WELL = ("budget_spent", "finished")  # ends of trials that did not fail
LIBRARIES = ("pandas", "polars")
CLOSING = ("scene", "noise_level", "protocol", "algorithm", "instance", "end")
STEP = ("trial", "step", "commanded_pose", "true_pose", "limits_low", "limits_high", "merit", "measured", "machine_seconds",
        "recommended_pose", "recommendation", "recommended_seconds", "recommended_true_pose", "commanded_mse",
        "commanded_mse_error", "recommended_mse", "recommended_mse_error")  # what docs/schemas/trials.schema.json requires
MOST_CHARTS = 6  # of a picture in a notebook


class Results:
    """A results folder.

        results = Results("results/quick")
        results.table("instances")                   # a pandas.DataFrame
        results.table("steps", library="polars")     # a polars.DataFrame

    A notebook shows the final error and the curve of every method.

    Args:
        folder: A folder of `relign-bench run` or `merge`.

    Attributes:
        folder: The folder.
        manifest: Its manifest: suite, plugins, program and machine; results/README.md has the keys.

    Raises:
        FileNotFoundError: The folder has no results.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = pathlib.Path(folder)
        self.manifest = read_manifest(folder)

    def __repr__(self) -> str:
        return f"Results({str(self.folder)!r})"

    def table(self, what: str = "curves", library: str = "pandas") -> Any:
        """A table as a pandas.DataFrame or a polars.DataFrame.

        Args:
            what: "curves" (medians over instances, one row per step), "instances" (one row per trial, without errors if it
                failed) or "steps" (every step of every trial of the suite, with its criteria; `end` states whether the
                trial failed).
            library: "pandas" or "polars". Missing values are NaN in pandas and null in polars.

        Raises:
            FileNotFoundError: The folder does not have this table.
            ImportError: The library is not installed.
            ValueError: The table or the library is unknown, or a line of the records has a key twice.
        """
        check_name(what, TABLES, "table")
        check_name(library, LIBRARIES, "module")
        try:
            frames = __import__(library)
        except ImportError as problem:
            raise ImportError(f"tables need {library}: pip install {library} ({problem})") from None
        if what in ("curves", "instances"):
            table = self._csv(what)
            return (frames.read_csv(table, dtype={"trial": str}) if library == "pandas" else
                    frames.read_csv(table, infer_schema_length=None, schema_overrides={"trial": frames.String}))
        rows = [{**{key: closing[key] for key in (*CLOSING, *TABLED) if key in closing}, **row}
                for closing, steps in read_trials(self.folder) for row in step_rows(steps, closing)]
        data: Any = rows or {key: [] for key in (*CLOSING, *STEP)}
        return frames.DataFrame(data) if library == "pandas" else frames.DataFrame(data, infer_schema_length=None, strict=False)

    def _csv(self, what: str) -> pathlib.Path:
        table = self.folder / (what + ".csv")
        if not table.is_file():
            raise FileNotFoundError(
                f"'{table}' does not exist; `relign-bench report {shlex.quote(str(self.folder))}` writes it")
        return table

    def _repr_html_(self) -> str:
        for key in ("suite_name", "instances", "scenes"):
            if key not in self.manifest:
                raise ValueError(f"'{self.folder / 'manifest.json'}' is damaged: it has no '{key}'; restore it from a copy")
        title = f"{self.manifest['suite_name']}: {self.manifest['instances']} instances"
        try:
            with self._csv("curves").open(encoding="utf-8", newline="") as file:
                rows = list(csv.DictReader(file))
        except FileNotFoundError as problem:
            return _html.block(title, _html.paragraph(str(problem)))
        groups: dict[tuple[str, ...], dict[str, list[dict[str, str]]]] = {}
        for row in rows:
            group = groups.setdefault((row["scene"], row["noise_level"], row["protocol"]), {})
            group.setdefault(row["algorithm"], []).append(row)
        scores = {scene["name"]: score_of(scene).label for scene in self.manifest["scenes"]}
        parts = [_group_html(", ".join(group), scores.get(group[0], RMSE.name), curves)
                 for group, curves in list(groups.items())[:MOST_CHARTS]]
        if len(groups) > MOST_CHARTS:
            parts.append(_html.paragraph(f"and {len(groups) - MOST_CHARTS} more scenes and levels; table('curves') has all"))
        return _html.block(title, *parts)


def _group_html(title: str, score: str, curves: dict[str, list[dict[str, str]]]) -> str:
    # A station has measured errors only.
    error = "recommended" if any(row["recommended_median"] for rows in curves.values() for row in rows) else "best"

    def column(rows: list[dict[str, str]], statistic: str) -> list[float | None]:
        return [float(row[f"{error}_{statistic}"]) if row[f"{error}_{statistic}"] else None for row in rows]

    series = [_html.Series(name, [int(row["step"]) for row in rows], column(rows, "median"), column(rows, "q25"),
                           column(rows, "q75")) for name, rows in curves.items()]
    series.sort(key=lambda one: (one.values[-1] is None, one.values[-1] or 0))
    last = [[one.name, curves[one.name][-1]["n"], *map(_html.number, (one.values[-1], one.low[-1], one.high[-1]))]
            for one in series]
    what = f"noise-free {score} at the recommended pose" if error == "recommended" else f"lowest measured {score}"
    return (_html.paragraph(f"{title}: {what}, medians and quartiles") + _html.chart(series, "step", score)
            + _html.table(["method", "trials", "median", "lower quartile", "upper quartile"], last))


def read_manifest(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """The manifest of a results folder; results/README.md has its keys.

    Raises:
        FileNotFoundError: The folder has no results.
        ValueError: The manifest is damaged.
    """
    folder = pathlib.Path(folder)
    if not (folder / "manifest.json").is_file():
        shards = folder.is_dir() and any(folder.glob("shard-*/manifest.json"))
        raise FileNotFoundError(
            f"'{folder}' is not a results folder: it has no manifest.json"
            + (f"; merge its shards: relign-bench merge {shlex.quote(str(folder))} -o MERGED" if shards else ""))
    try:
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        if not isinstance(manifest, dict):
            raise ValueError("it must be an object")
    except ValueError as problem:
        raise ValueError(f"'{folder / 'manifest.json'}' is damaged: {problem}; restore it from a copy") from None
    return manifest


def read_trials(folder: str | os.PathLike[str], checked: bool = False) -> list[tuple[dict[str, Any], list[dict[str, Any]]]]:
    """The complete trials of a results folder in the order of its plan, each as its closing line and its steps.

    Args:
        folder: The results folder.
        checked: Whether lines that do not have their checksum are an error.

    Raises:
        FileNotFoundError: The folder has no results, or was published without its trials.
        ValueError: A file is damaged, a line of the records has a key twice, a trial is there twice, or does not have its
            checksum.
    """
    folder = pathlib.Path(folder)
    order = read_manifest(folder).get("order")
    if not isinstance(order, list):
        raise ValueError(f"'{folder / 'manifest.json'}' is damaged: it has no list 'order'; restore it from a copy")
    if not (folder / "trials").is_dir():
        raise FileNotFoundError(f"'{folder}' has no folder trials: it was published without its raw trials")
    steps, closing = collections.defaultdict(list), {}
    for path in sorted((folder / "trials").glob("*.jsonl")):
        hashes: dict[str, Any] = collections.defaultdict(hashlib.sha256)
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError as problem:
            raise ValueError(f"'{path}' is damaged: {problem}; restore it from a copy, or let relign-bench run --drop-damaged "
                             "repeat its trials") from None
        for number, line in enumerate(text.split("\n"), 1):
            try:
                record = json.loads(line, object_pairs_hook=unique_keys)
            except json.JSONDecodeError:
                continue  # the incomplete last line of a run that was killed
            except ValueError as problem:
                raise ValueError(f"{path}:{number}: {problem}") from None
            trial = record.get("trial") if isinstance(record, dict) else None
            if not isinstance(trial, str):
                raise ValueError(f"{path}:{number}: expected a step or the end of a trial, found {line[:40]!r}; restore the "
                                 "file from a copy")
            if trial in closing:
                raise ValueError(f"{path}:{number}: trial '{trial}' is recorded twice; remove one of its records")
            hashes[trial].update((re.sub(r',"sha256":"[0-9a-f]*"}$', "}", line) + "\n").encode())
            if "end" not in record:
                steps[trial].append(record)
                continue
            if checked and hashes[trial].hexdigest() != record["sha256"]:
                raise ValueError(f"{path}:{number}: the lines of trial '{trial}' do not have their checksum; restore the file, "
                                 "or let relign-bench run --drop-damaged repeat the trial")
            closing[trial] = record
    # A trial counts once it has a closing line; the steps of interrupted trials are left out.
    return [(closing[trial], steps[trial]) for trial in order if trial in closing]


def step_rows(steps: list[dict[str, Any]], closing: dict[str, Any]) -> list[dict[str, Any]]:
    """The steps of a trial with the values per step of its closing line, such as criteria."""
    return [{**step, **{key: closing[key][place] for key in PER_STEP if len(closing.get(key, ())) > place}}
            for place, step in enumerate(steps)]
