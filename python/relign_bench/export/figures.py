"""Figures for papers: the error after every capture, as PDF and SVG. The numbers are those of `relign-bench report`."""

from __future__ import annotations

import json
import subprocess
from typing import TYPE_CHECKING, Any

from .._score import score_of
from ..program import find_program
from .runs import file_names, new_folder, parse_only

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

# Okabe and Ito (2008): distinguished by readers with any colour vision. Methods beyond these get other dashes.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
DASHES = ("-", "--", ":", "-.")
STYLE = {"font.size": 8, "axes.linewidth": 0.6, "lines.linewidth": 1.2, "figure.figsize": (3.5, 2.6),
         "pdf.fonttype": 42,  # fonts that publishers accept, instead of Type 3
         "svg.fonttype": "none", "svg.hashsalt": "relign-bench"}  # text as text; equal runs give equal bytes


def write_figures(results: str | os.PathLike[str], folder: str | os.PathLike[str], error: str = "recommended",
                  only: Iterable[str] = ()) -> int:
    """Writes a figure per scene, noise level and protocol, as PDF and as SVG.

    A line is the median over the instances, its band the 95 % interval of the median, or the quartiles where the report has no
    interval; the horizontal line is the specification.

    Args:
        results: A results folder.
        folder: Folder to create.
        error: "recommended", "commanded" or "measured".
        only: KEY=VALUE with the key scene, noise_level, protocol or algorithm.

    Returns:
        Number of figures.

    Raises:
        FileExistsError: The folder exists and is not empty.
        FileNotFoundError: The program relign-bench is not installed.
        ImportError: matplotlib is not installed.
        ValueError: The report fails, or nothing is left to draw.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError as problem:
        raise ImportError(f"figures need matplotlib: pip install matplotlib ({problem})") from None
    wanted = parse_only(only)
    if "instance" in wanted:
        raise ValueError("--only instance=... does not apply to figures: their numbers are those of the report")
    done = subprocess.run([find_program(), "report", str(results), "--format", "json"], capture_output=True, text=True,
                          check=False)
    if not done.stdout:
        raise ValueError(f"relign-bench report failed: {done.stderr.strip()}")
    groups = [group for group in json.loads(done.stdout)["results"][0]["groups"]
              if all(group[key] in values for key, values in wanted.items() if key != "algorithm")]
    drawn = {}
    for group in groups:
        curves = [curve for curve in group["curves"] if curve["method"] in wanted.get("algorithm", {curve["method"]})
                  and any(value is not None for value in curve["tracks"].get(error, {}).get("median", ()))]
        if curves:
            drawn["_".join(group[key] for key in ("scene", "noise_level", "protocol"))] = (group, curves)
    if not drawn:
        raise ValueError(f"'{results}' has no {error} error of a chosen scene, noise level, protocol and algorithm to draw")
    names = file_names(list(drawn))
    with rc_context(STYLE), new_folder(folder) as new:
        for name, (group, curves) in drawn.items():
            figure = Figure(layout="constrained")
            _draw(figure.add_subplot(), group, curves, error)
            figure.savefig(new / f"{names[name]}.pdf", metadata={"CreationDate": None})
            figure.savefig(new / f"{names[name]}.svg", metadata={"Date": None})
    return len(drawn)


def _draw(axes: Any, group: dict[str, Any], curves: list[dict[str, Any]], error: str) -> None:
    for place, curve in enumerate(curves):
        track = curve["tracks"][error]
        captures = [curve["first_step"] + 1 + step for step in range(len(track["median"]))]
        look = {"color": COLOURS[place % len(COLOURS)]}
        # One instance has neither, few have no interval.
        ends = ("lo95", "hi95") if any(value is not None for value in track.get("lo95", ())) else ("q25", "q75")
        band = [(capture, low, high) for capture, low, high in zip(captures, track.get(ends[0], ()), track.get(ends[1], ()))
                if low is not None and high is not None]
        if band:
            axes.fill_between(*zip(*band), alpha=0.2, linewidth=0, **look)
        line = [(capture, value) for capture, value in zip(captures, track["median"]) if value is not None]
        axes.plot(*zip(*line), DASHES[place // len(COLOURS) % len(DASHES)], label=curve["method"], **look)
    limit = group.get("spec_rmse", group.get("spec_score"))
    if limit is not None:
        axes.axhline(limit, color="0.4", linewidth=0.8, linestyle=(0, (4, 3)), label="specification")
    axes.set_yscale("log")
    axes.set_xlabel("captures")
    score = score_of(group).label
    axes.set_ylabel(f"measured {score}" if error == "measured" else f"noise-free {score}")
    axes.grid(True, which="major", alpha=0.25, linewidth=0.5)
    axes.legend(frameon=False, fontsize=7)
