"""Table and figure of a sweep, from the curves of its runs, complete or not."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any

import numpy as np

from .curves import read_csv

if TYPE_CHECKING:
    import pathlib
    from collections.abc import Callable, Sequence

    from .._typing import Float64Array
    from .sweep import Job

LAST_ROWS = 3  # training segments whose mean the table has
DRAWS = 1000  # of the bootstrap
FEWEST_SEEDS = 3  # for a band
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", "#999999")
SETTINGS = ("algorithm", "level", "rate", "entropy", "size", "reward", "seed")
CURVE = ("steps", "hours", "reward", "episode", "success", "rmse_6", "rmse_12", "under_0.01")
HEADINGS = ("training", "seeds", "steps", "hours", "reward a step", "success", "error after 6 moves", "error after 12 moves")


class Curves:
    """The curves of one recipe's runs, cut to the steps that all of them have.

    Attributes:
        count: Number of runs with a curve.
        steps: Steps of each training segment, shape (segments,).
        values: By column of curve.csv: shape (runs, segments).
        errors: By number of moves, "6" or "12": noise-free RMSE, shape (runs, segments, instances).
    """

    def __init__(self, jobs: Sequence[Job]) -> None:
        tables = [table for table in map(_curve, jobs) if table]
        self.count = len(tables)
        length = min(map(len, tables), default=0)
        self.steps = np.array([int(row["steps"]) for row in tables[0][:length]]) if tables else np.zeros(0, int)
        self.values = {name: np.array([[float(row[name] or "nan") for row in table[:length]] for table in tables])
                       for name in CURVE[1:]}
        self.errors = {}
        for after in ("6", "12"):
            errors = [_errors(job, after, length) for job in jobs if _curve(job)]
            self.errors[after] = np.array(errors, float) if length else np.zeros((self.count, 0, 0))


def _curve(job: Job) -> list[dict[str, str]]:
    return read_csv(job.folder / "curve.csv", CURVE)


def _errors(job: Job, after: str, length: int) -> list[list[str]]:
    """Errors on the tuning instances after this many moves, in the first `length` training segments."""
    path = job.folder / "errors.csv"
    found = [list(row.values())[2:] for row in read_csv(path, ("steps", "after")) if row["after"] == after]
    if len(found) < length:
        raise ValueError(f"'{path}' has {len(found)} training segments, and curve.csv {length}; the command that trained there "
                         "writes the file anew")
    return found[:length]


def over_trainings(values: Float64Array, seed: int = 0) -> tuple[float, float]:
    """95 % interval of the mean over runs, from values of shape (runs,), by the bootstrap."""
    draws = np.random.default_rng(seed).integers(len(values), size=(DRAWS, len(values)))
    low, high = np.quantile(values[draws].mean(axis=1), [0.025, 0.975])
    return float(low), float(high)


def two_level(errors: Float64Array, seed: int = 0) -> tuple[float, float]:
    """95 % interval of the mean over runs of the median over instances: both are drawn anew (docs/statistics.md).

    Args:
        errors: Shape (runs, instances); all runs are evaluated on the same instances.
        seed: Of the bootstrap.
    """
    random = np.random.default_rng(seed)
    runs, instances = errors.shape
    drawn = []
    for _ in range(DRAWS):
        seeds, numbers = random.integers(runs, size=runs), random.integers(instances, size=instances)
        drawn.append(np.median(errors[np.ix_(seeds, numbers)], axis=1))
    low, high = np.quantile(np.mean(drawn, axis=1), [0.025, 0.975])
    return float(low), float(high)


def write(jobs: Sequence[Job], out: pathlib.Path) -> list[pathlib.Path]:
    """Writes sweep.csv (a row for each training segment), sweep.md (a row for each recipe) and sweep.png.

    Returns:
        The files; none where no training has a segment yet.
    """
    groups: dict[str, list[Job]] = {}
    for job in jobs:
        groups.setdefault(job.group, []).append(job)
    curves = {group: Curves(members) for group, members in groups.items()}
    if not any(found.count for found in curves.values()):
        return []
    paths = [out / f"sweep.{suffix}" for suffix in ("csv", "md", "png")]
    with paths[0].open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["training", *SETTINGS, *CURVE])
        for job in jobs:
            for row in _curve(job):
                table.writerow([job.group, *(getattr(job.recipe, name) for name in SETTINGS), *(row[name] for name in CURVE)])
    lines = ["| " + " | ".join(HEADINGS) + " |", "|---" * len(HEADINGS) + "|"]
    lines += ["| " + " | ".join(_summary(group, groups[group], found)) + " |" for group, found in curves.items()]
    lines += ["", f"Means of the last {LAST_ROWS} training segments that all seeds have. In brackets, from {FEWEST_SEEDS} "
                  "seeds up, 95 % intervals over runs; of errors, over runs and tuning instances."]
    begun = [group for group, members in groups.items() if members[0].warm_start]
    if begun:
        lines += ["", f"Steps and hours of {', '.join(begun)} do not include those of the runs that they started from."]
    paths[1].write_text("\n".join(lines) + "\n")
    _draw(jobs, groups, curves, paths[2])
    return paths


def _summary(group: str, jobs: Sequence[Job], curves: Curves) -> list[str]:
    seeds = f"{sum(job.complete() for job in jobs)} of {len(jobs)} complete"
    if curves.count == 0:
        return [group, seeds, "0", *["-"] * (len(HEADINGS) - 3)]

    def mean(values: Float64Array, interval: Callable[[Float64Array], tuple[float, float]], middle: float, digits: int) -> str:
        if np.isnan(middle):  # no episode ended in one of the segments
            return "-"
        text = f"{middle:.{digits}f}"
        if curves.count >= FEWEST_SEEDS:
            low, high = interval(values)
            text += f" [{low:.{digits}f}, {high:.{digits}f}]"
        return text

    last = {name: values[:, -LAST_ROWS:].mean(axis=1) for name, values in curves.values.items()}
    errors = {after: values[:, -LAST_ROWS:].mean(axis=1) for after, values in curves.errors.items()}
    return [group, seeds, f"{curves.steps[-1]:,}", f"{curves.values['hours'][:, -1].sum():.1f}",
            mean(last["reward"], over_trainings, float(last["reward"].mean()), 2),
            mean(last["success"], over_trainings, float(last["success"].mean()), 2),
            *(mean(errors[after], two_level, float(np.median(errors[after], axis=1).mean()), 4) for after in ("6", "12"))]


def _draw(jobs: Sequence[Job], groups: dict[str, list[Job]], curves: dict[str, Curves], path: pathlib.Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    rows = list(dict.fromkeys(job.figure for job in jobs))
    figure, panels = pyplot.subplots(len(rows), 3, figsize=(13, 3.2 * len(rows)), squeeze=False, constrained_layout=True)
    for of_row, row in zip(panels, rows):
        shown = [(group, curves[group]) for group, members in groups.items()
                 if members[0].figure == row and curves[group].count]
        for number, (group, found) in enumerate(shown):
            style = {"color": COLOURS[number % len(COLOURS)], "linestyle": ("-", "--", ":")[number // len(COLOURS) % 3]}
            for panel, values, middle, interval in _panels(of_row, found):
                panel.plot(found.steps, middle, label=group, **style)
                if found.count >= FEWEST_SEEDS:
                    low, high = np.array([interval(values[:, segment]) for segment in range(len(found.steps))]).T
                    panel.fill_between(found.steps, low, high, color=style["color"], alpha=0.2, linewidth=0)
        for panel, label in zip(of_row, ("reward a step (training)", "episodes that reach the goal", "error after 12 moves")):
            panel.set_xlabel("steps")
            panel.set_ylabel(label)
            panel.xaxis.set_major_formatter(ticker.EngFormatter(sep=""))
            panel.spines[["top", "right"]].set_visible(False)
        of_row[0].set_title(row, loc="left")
        if shown:
            of_row[2].set_yscale("log")
            of_row[2].legend(frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1, 1))
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


def _panels(panels: Any, curves: Curves) -> list[tuple[Any, Float64Array, Float64Array, Any]]:
    errors = curves.errors["12"]
    return [*((panel, curves.values[name], curves.values[name].mean(axis=0), over_trainings)
              for panel, name in zip(panels, ("reward", "success"))),
            (panels[2], errors, np.median(errors, axis=2).mean(axis=0), two_level)]

