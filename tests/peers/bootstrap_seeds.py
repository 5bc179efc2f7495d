"""Planned verdicts that depend on the seed of the bootstrap: `python3 tests/peers/bootstrap_seeds.py reports/paper >
reports/paper/bootstrap.csv`, from the study's manifest.json, instances.csv and floors.csv.

An interval of 10,000 resamples has an error of its own. Contrasts by `own` and `best` of which an end is within a factor of
1 + NEAR of a limit are computed again with other seeds. A row has the mean of the interval's ends and the share of each verdict
among the seeds. Needs SciPy and pandas.
"""

import csv
import json
import pathlib
import sys

import numpy as np
import pandas as pd
from floors import FLOORS, RESAMPLES, compared
from recompute import RELEVANT_RATIO, RULES
from scipy_statistics import draws

NEAR = 0.01
SEEDS = range(1, 101)
VERDICTS = ("better", "practically equal", "undecided", "worse")
NAMES = ("protocol", "noise_level", "first", "second", "rule")


def near_a_limit(row, relevant):
    ends = np.log([float(row["lo95"]), float(row["hi95"])])
    return min(abs(end - limit) for end in ends for limit in (-np.log(relevant), np.log(relevant))) < np.log(1 + NEAR)


def again(group, row, relevant):
    """Ends of the interval and verdict, for every seed."""
    errors = group.pivot(index="instance", columns="algorithm", values=RULES[row["rule"]]).sort_index()
    for seed in SEEDS:
        _, _, low, high, verdict = compared(errors[row["first"]], errors[row["second"]], FLOORS[1],
                                            draws(len(errors), RESAMPLES, seed), relevant)
        yield float(low), float(high), verdict


def main(folder):
    relevant = json.loads((folder / "manifest.json").read_text())["analysis"].get("smallest_relevant_ratio", RELEVANT_RATIO)
    trials = pd.read_csv(folder / "instances.csv")
    with (folder / "floors.csv").open(newline="") as file:
        planned = [row for row in csv.DictReader(file) if row["planned"] == "yes" and float(row["floor"]) == FLOORS[1]
                   and row["rule"] in ("own", "best") and near_a_limit(row, relevant)]
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow((*NAMES, "verdict", "seeds", "lo95_mean", "hi95_mean", *VERDICTS))
    for row in planned:
        group = trials[(trials.protocol == row["protocol"]) & (trials.noise_level == row["noise_level"])]
        lows, highs, verdicts = zip(*again(group, row, relevant))
        table.writerow((*(row[name] for name in NAMES), row["verdict"], len(SEEDS), f"{np.mean(lows):.6g}",
                        f"{np.mean(highs):.6g}",
                        *(f"{verdicts.count(one) / len(SEEDS):.2f}" for one in VERDICTS)))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
