"""Results of a run as data frames; needs pandas, not the compiled module."""

from __future__ import annotations

import collections
import hashlib
import json
import pathlib
import re
import shlex
from typing import TYPE_CHECKING, Any

from ._columns import PER_STEP, TABLED
from ._errors import check_name
from ._json import unique_keys

if TYPE_CHECKING:
    import os

    import pandas

TABLES = ("curves", "instances", "steps")


def read_results(folder: str | os.PathLike[str], what: str = "curves") -> pandas.DataFrame:
    """A table of a results folder as a pandas.DataFrame.

    Args:
        folder: The results folder.
        what: "curves" (medians over instances, one row per step), "instances" (one row per trial, without errors if it
            failed) or "steps" (every step of every trial, with its criteria; `end` states whether the trial failed).

    Raises:
        FileNotFoundError: The folder has no results, or not this table.
        ValueError: There is no such table, or a line of the records has a key twice.
    """
    import pandas

    folder = pathlib.Path(folder)
    read_manifest(folder)
    check_name(what, TABLES, "table")
    if what in ("curves", "instances"):
        table = folder / (what + ".csv")
        if not table.is_file():
            raise FileNotFoundError(f"'{table}' does not exist; `relign-bench report {shlex.quote(str(folder))}` writes it")
        return pandas.read_csv(table)
    keys = ("scene", "noise_level", "protocol", "algorithm", "instance", "end", *TABLED)
    return pandas.DataFrame([{**{key: closing[key] for key in keys if key in closing}, **row}
                             for closing, steps in read_trials(folder) for row in step_rows(steps, closing)])


def read_manifest(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """The manifest of a results folder; results/README.md has its keys.

    Raises:
        FileNotFoundError: The folder has no results.
    """
    folder = pathlib.Path(folder)
    if not (folder / "manifest.json").is_file():
        shards = folder.is_dir() and any(folder.glob("shard-*/manifest.json"))
        raise FileNotFoundError(
            f"'{folder}' is not a results folder: it has no manifest.json"
            + (f"; merge its shards: relign-bench merge {shlex.quote(str(folder))} -o MERGED" if shards else ""))
    manifest: dict[str, Any] = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    return manifest


def read_trials(folder: str | os.PathLike[str], checked: bool = False) -> list[tuple[dict[str, Any], list[dict[str, Any]]]]:
    """The complete trials of a results folder in the order of its plan, each as its closing line and its steps.

    Args:
        folder: The results folder.
        checked: Whether lines that do not have their checksum are an error.

    Raises:
        FileNotFoundError: The folder has no results, or was published without its trials.
        ValueError: A line of the records has a key twice, or a trial does not have its checksum.
    """
    folder = pathlib.Path(folder)
    order = read_manifest(folder)["order"]
    if not (folder / "trials").is_dir():
        raise FileNotFoundError(f"'{folder}' has no folder trials: it was published without its raw trials")
    steps, closing = collections.defaultdict(list), {}
    for path in sorted((folder / "trials").glob("*.jsonl")):
        hashes: dict[str, Any] = collections.defaultdict(hashlib.sha256)
        for number, line in enumerate(path.read_text(encoding="utf-8").split("\n"), 1):
            try:
                record = json.loads(line, object_pairs_hook=unique_keys)
            except json.JSONDecodeError:
                continue  # the incomplete last line of a run that was killed
            except ValueError as problem:
                raise ValueError(f"{path}:{number}: {problem}") from None
            trial = record["trial"]
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
