"""Bayesian optimisation against scikit-optimize on many instances: `python compare_skopt.py FOLDER [--instances 100]`.

An interrupted comparison resumes in the same folder, which has a folder for each noise level. Each level has its own instances,
since a search draws the same random numbers for an instance at every level. --read only prints the results. Not a test; its
times need an idle machine.
"""

import argparse
import os
import sys
from pathlib import Path

import paired_search

MOST_INSTANCES = 1000  # of a level: the first one has 0 to 999, the second one 1000 to 1999
FOREST = {"search": "forest"}
SEARCHES = {
    "skopt GP": {"use": paired_search.SKOPT},
    "skopt RF": {"use": paired_search.SKOPT, "parameters": {"estimator": "RF"}},
    "skopt ET": {"use": paired_search.SKOPT, "parameters": {"estimator": "ET"}},
    "package GP": {"use": paired_search.PACKAGE},
    "package forest": {"use": paired_search.PACKAGE, "parameters": FOREST},
    "bo-gp": {"use": "bo-gp"},
    "bo-rf": {"use": "bo-rf"},
    "bo-et": {"use": "bo-et"},
    # Another number of candidates gives another random stream: this measures the random variation.
    "bo-gp again": {"use": "bo-gp", "parameters": {"candidates": 9990}},
    "bo-rf again": {"use": "bo-forest", "parameters": {"candidates": 9990}},
}

PAIRS = (
    ("bo-gp", "skopt GP"),
    ("bo-gp", "package GP"),
    ("bo-gp", "bo-gp again"),
    ("bo-rf", "skopt RF"),
    ("bo-rf", "bo-rf again"),
    ("bo-et", "skopt ET"),
    ("bo-et", "package forest"),
    # Random poses, which every suite has, as a baseline for both.
    ("skopt GP", "random"),
    ("bo-gp", "random"),
    ("skopt RF", "random"),
    ("bo-rf", "random"),
    ("skopt ET", "random"),
    ("bo-et", "random"),
)


def ratios(trials):
    """One row for each pair, measure and number of images, by level and for all levels together."""
    measures = {
        "lowest merit": paired_search.Trial.lowest_merit,
        "error there": paired_search.Trial.error_at_lowest_merit,
    }
    levels = sorted({trial.noise_level for trial in trials})
    for name, group in [(level, [level]) for level in levels] + [("all", levels)] * (len(levels) > 1):
        found = {trial.algorithm for trial in trials if trial.noise_level in group}
        for ours, theirs in PAIRS:
            if not {ours, theirs} <= found:
                continue
            for measure, of in measures.items():
                for step in paired_search.STEPS:
                    both = [
                        paired_search.values(trials, search, group, lambda trial, of=of, step=step: of(trial, step))
                        for search in (ours, theirs)
                    ]
                    yield (name, ours, theirs, measure, step, *paired_search.median_ratio(*both))


def table(trials):
    """The same as Markdown, one row for each level, pair and measure."""
    columns = ["level", "searches", "pairs", "", *(f"{step} images" for step in paired_search.STEPS)]
    lines = ["| " + " | ".join(columns) + " |"]
    lines.append("|" + "---|" * len(columns))
    rows = {}
    for level, ours, theirs, name, _, middle, low, high, count in ratios(trials):
        cells = rows.setdefault((level, f"{ours} / {theirs}", count, name), [])
        cells.append(f"{middle:.2f} ({low:.2f} to {high:.2f})")
    return "\n".join(lines + ["| " + " | ".join(map(str, (*key, *cells))) + " |" for key, cells in rows.items()])


def rows(trials):
    """CSV: the values that each trial has reached after some numbers of images."""
    lines = ["noise_level,search,instance,images,lowest_merit,error_there"]
    for trial in sorted(trials, key=lambda trial: (trial.noise_level, trial.algorithm, trial.instance)):
        for step in paired_search.STEPS:
            if trial.algorithm != "home":  # one move
                reached = f"{trial.lowest_merit(step):.6g},{trial.error_at_lowest_merit(step):.6g}"
                lines.append(f"{trial.noise_level},{trial.algorithm},{trial.instance},{step},{reached}")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scene", default="gaussian_spot")
    parser.add_argument("--noise-levels", nargs="+", default=["rho0"], help="noise levels [default: rho0]")
    parser.add_argument("--instances", type=int, default=100, help="instances of each noise level [default: %(default)s]")
    parser.add_argument("--searches", nargs="+", default=["skopt GP", "bo-gp", "bo-gp again"], choices=list(SEARCHES))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--read", action="store_true", help="run nothing; print the results in the folder")
    parser.add_argument("--csv", type=Path, help="write a CSV file with a row for each trial")
    asked = parser.parse_args()

    searches = {name: SEARCHES[name] for name in asked.searches}
    for number, level in enumerate([] if asked.read else asked.noise_levels):
        given = paired_search.suite(asked.scene, level, asked.instances, searches, number * MOST_INSTANCES)
        paired_search.run(asked.folder / level, given, asked.workers)
    trials = [trial for results in sorted(asked.folder.rglob("results")) for trial in paired_search.read(results)]
    if not trials:
        sys.exit(f"no finished trial in {asked.folder}")
    print(table(trials))
    if asked.csv:
        asked.csv.write_text(rows(trials))
    if not asked.read:
        print(f"\n{asked.scene}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}")
        for name in asked.searches:
            times = [1000 * paired_search.proposal_seconds(trials, name, step) for step in (20, 50)]
            print(f"{name:14s} proposal of step 20: {times[0]:8.2f} ms, of step 50: {times[1]:8.2f} ms")


if __name__ == "__main__":
    main()
