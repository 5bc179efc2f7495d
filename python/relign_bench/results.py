"""Results of a run as data frames; needs pandas, not the compiled module."""

from __future__ import annotations

import collections
import json
import pathlib
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
    if not (folder / "manifest.json").is_file():
        raise FileNotFoundError(f"'{folder}' is not a results folder: it has no manifest.json")
    check_name(what, TABLES, "table")
    if what in ("curves", "instances"):
        table = folder / (what + ".csv")
        if not table.is_file():
            raise FileNotFoundError(f"'{table}' does not exist; `relign-bench report {shlex.quote(str(folder))}` writes it")
        return pandas.read_csv(table)
    if not (folder / "trials").is_dir():
        raise FileNotFoundError(f"'{folder}' has no folder trials: it was published without its raw trials")
    steps, closing = collections.defaultdict(list), {}
    for path in sorted((folder / "trials").glob("*.jsonl")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            try:
                record = json.loads(line, object_pairs_hook=unique_keys)
            except json.JSONDecodeError:
                continue  # the incomplete last line of a run that was killed
            except ValueError as problem:
                raise ValueError(f"{path}:{number}: {problem}") from None
            if "end" in record:
                closing[record["trial"]] = record
            else:
                steps[record["trial"]].append(record)
    keys = ("scene", "noise_level", "protocol", "algorithm", "instance", "end", *TABLED)
    # A trial counts once it has a closing line; the steps of interrupted trials are left out.
    return pandas.DataFrame([{**{key: of_trial[key] for key in keys if key in of_trial}, **row}
                             for trial, rows in steps.items() if (of_trial := closing.get(trial))
                             for row in step_rows(rows, of_trial)])


def step_rows(steps: list[dict[str, Any]], closing: dict[str, Any]) -> list[dict[str, Any]]:
    """The steps of a trial with the values per step of its closing line, such as criteria."""
    return [{**step, **{key: closing[key][place] for key in PER_STEP if len(closing.get(key, ())) > place}}
            for place, step in enumerate(steps)]
