"""Ratios and verdicts of a study's planned contrasts with other floors of the noise-free RMSE: `python3 tests/peers/floors.py
reports/paper > reports/paper/floors.csv`, from the study's manifest.json and instances.csv.

Errors below the floor count as the floor before ratios are taken. A row has the ratio, interval and verdict of a contrast by a
rule, at a floor of the report's 1e-4 (these rows equal contrasts.csv), and at one standard error of the noise-free MSE as RMSE,
3.5e-4. Pairs that the plan does not name are marked. Needs SciPy and pandas.
"""

import csv
import json
import pathlib
import sys

import numpy as np
import pandas as pd
from recompute import RELEVANT_RATIO, RULES
from scipy_statistics import band, draws, iqm

FLOORS = (1e-4, 3.5e-4)
RESAMPLES = 10_000
UNPLANNED = (("imitation", "imitation-ppo"),)
COLUMNS = ("protocol", "noise_level", "first", "second", "planned", "rule", "floor", "n", "ratio", "lo95", "hi95", "verdict")


def verdict(low, high, relevant):
    if high < 1 / relevant:
        return "better"
    if low > relevant:
        return "worse"
    return "practically equal" if low > 1 / relevant and high < relevant else "undecided"


def compared(first, second, floor, drawn, relevant):
    """n, ratio, ends of its interval and verdict of two columns of errors with a value per instance."""
    ratio = np.log(first.clip(lower=floor) / second.clip(lower=floor)).to_numpy()
    middle, (low, high) = np.exp(iqm(ratio[None])[0]), np.exp(band(ratio, drawn, iqm))
    return len(ratio), *(f"{value:.6g}" for value in (middle, low, high)), verdict(low, high, relevant)


def rows(manifest, trials):
    plan = manifest["analysis"]
    pairs = [(*pair, "yes") for pair in plan["contrasts"]] + [(*pair, "no") for pair in UNPLANNED]
    for (protocol, level), group in trials.groupby(["protocol", "noise_level"], sort=False):
        drawn = draws(group.instance.nunique(), RESAMPLES, int(manifest["seed"]))
        for first, second, planned in pairs:
            for rule, column in RULES.items():
                errors = group.pivot(index="instance", columns="algorithm", values=column).sort_index()
                for floor in FLOORS:
                    yield (protocol, level, first, second, planned, rule, floor,
                           *compared(errors[first], errors[second], floor, drawn,
                                     plan.get("smallest_relevant_ratio", RELEVANT_RATIO)))


def main(folder):
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows(rows(json.loads((folder / "manifest.json").read_text()), pd.read_csv(folder / "instances.csv")))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
