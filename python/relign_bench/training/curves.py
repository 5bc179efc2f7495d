"""Learning curves as CSV and PNG."""

from __future__ import annotations

import csv
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pathlib
    from collections.abc import Mapping, Sequence

    from .folder import RunFolder

    Rows = Sequence[Mapping[str, Any]]

COLUMNS = ("steps", "hours", "episodes", "reward", "episode", "success", "rmse_6", "rmse_12", "under_0.01", "score", "std")


def write_csv(folder: RunFolder, rows: Rows) -> None:
    """Writes curve.csv, one row per training segment.

    steps        of all environments so far
    hours        of training so far
    episodes     that ended in the segment
    reward       mean reward per step of these episodes
    episode      mean length of these episodes, in steps
    success      share of these episodes that reached the goal; these three are empty where no episode ended
    rmse_6, _12  median noise-free RMSE on tuning instances after 6 and 12 steps of the policy, without exploration
    under_0.01   share of tuning instances below 0.01 after 12 steps
    score        smaller is better; selects the best checkpoint (evaluation.py)
    std          mean standard deviation of the policy's actions in exploration; empty in segments of earlier versions
    """
    lines = [",".join(COLUMNS)]
    lines += [",".join("" if row.get(name) is None else f"{row[name]:.6g}" if name != "steps" else str(row[name])
                       for name in COLUMNS) for row in rows]
    folder.keep_text("curve.csv", "\n".join(lines) + "\n")


def write_errors(folder: RunFolder, rows: Rows) -> None:
    """Writes errors.csv: the error on every tuning instance, one row per training segment and number of moves.

    steps  of all environments so far
    after  moves of the policy, without exploration
    0, 1, ...  noise-free RMSE on the tuning instance of this number
    """
    lines = []
    for row in rows:
        for after, errors in row["errors"].items():
            lines.append(",".join([str(row["steps"]), after, *(f"{error:.5g}" for error in errors)]))
    instances = range(lines[0].count(",") - 1) if lines else range(0)
    folder.keep_text("errors.csv", "\n".join([",".join(["steps", "after", *map(str, instances)]), *lines]) + "\n")


def read_csv(path: pathlib.Path, columns: Sequence[str]) -> list[dict[str, str]]:
    """The rows of curve.csv or errors.csv; none if the file is missing.

    Args:
        path: The file.
        columns: Columns that it must have, in every row, as all others, with a number or nothing.

    Raises:
        ValueError: It has not.
    """
    if not path.is_file():
        return []
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    for line, row in enumerate(rows, 2):
        for name in (*columns, *row):
            try:
                float(row[name] if row[name] != "" else "nan")
            except (KeyError, TypeError, ValueError):
                raise ValueError(f"{path}:{line}: {name}: expected a number, found {row.get(name)!r}; the command that trained "
                                 "there writes the file anew") from None
    return rows


def draw(folder: RunFolder, title: str, rows: Rows) -> None:
    """Writes curve.png: reward, success and error against steps, as in the paper's figure. Needs matplotlib."""
    from matplotlib import ticker
    from matplotlib.figure import Figure

    steps = [row["steps"] for row in rows]
    figure = Figure(figsize=(12, 3.4), layout="constrained")
    panels = figure.subplots(1, 3)
    for panel, (name, label) in zip(panels, (("reward", "reward per step (training)"),
                                             ("success", "episodes that reach the goal (training)"))):
        panel.plot(steps, [math.nan if row[name] is None else row[name] for row in rows], color="#0072b2")
        panel.set_ylabel(label)
    for name, label, style in (("rmse_6", "after 6 steps", "--"), ("rmse_12", "after 12 steps", "-")):
        panels[2].plot(steps, [row[name] for row in rows], style, color="#d55e00", label=label)
    panels[2].set_ylabel("noise-free RMSE (tuning, median)")
    panels[2].set_yscale("log")
    panels[2].legend(frameon=False)
    for panel in panels:
        panel.set_xlabel("steps")
        panel.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
        panel.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title)
    folder.keep("curve.png", lambda out: figure.savefig(out, format="png", dpi=100))
