"""Contrasts in which each method recommends by the rule of its authors: `python3 tests/peers/authors.py reports/paper >
reports/paper/authors.csv`, from instances.csv, merit.csv and trainings/instances.csv of a study, protocol `paper`.

The package's searches return the pose of the lowest merit (column `rmse` of merit.csv; the own rule of random and BOBYQA), its
policies end at their last pose, other methods keep their own rule. Against the searches with the lowest errors, BOBYQA and
TransferGP, both methods are compared by `own` and by `best`, too. None of these contrasts was planned. Needs SciPy and pandas.
"""

import csv
import json
import pathlib
import sys

import pandas as pd
from floors import FLOORS, RESAMPLES, compared
from scipy_statistics import draws

MERIT, POLICIES, STRONGEST = ("bo-gp",), ("ppo-paper", "ppo-exact"), ("nlopt-bobyqa", "transfer-gp")
OWN, BEST = "recommended", "recommended_best"
COLUMNS = ("noise_level", "first", "first_rule", "second", "second_rule", "n", "ratio", "lo95", "hi95", "verdict")


def rule_of(method):
    return "merit" if method in MERIT else "recommended_current" if method.startswith(POLICIES) else OWN


def pairs(names):
    """First and second method with the column of each one's rule."""
    firsts = [name for name in names
              if name.startswith(POLICIES) and "shrinking" not in name or name in ("imitation-ppo", "bo-gp")]
    for first in firsts:
        second = "random" if first == "bo-gp" else "bo-gp"
        yield first, rule_of(first), second, rule_of(second)
    for second in STRONGEST:
        for first in firsts:
            if first not in MERIT:
                yield from ((first, rule, second, OWN) for rule in dict.fromkeys((rule_of(first), OWN)))
                yield first, BEST, second, BEST


def main(folder):
    merit = pd.read_csv(folder / "merit.csv").set_index("trial").rmse
    trials = pd.concat([pd.read_csv(folder / "instances.csv"), pd.read_csv(folder / "trainings" / "instances.csv")])
    trials = trials[trials.protocol == "paper"].drop_duplicates("trial")
    trials["merit"] = trials.trial.map(merit)
    manifest = json.loads((folder / "manifest.json").read_text())
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    for level, group in trials.groupby("noise_level", sort=False):
        drawn = draws(group.instance.nunique(), RESAMPLES, int(manifest["seed"]))
        for pair in pairs(trials.algorithm.unique()):
            errors = [group[group.algorithm == name].set_index("instance").sort_index()[rule]
                      for name, rule in (pair[:2], pair[2:])]
            table.writerow((level, *pair,
                            *compared(*errors, FLOORS[-1], drawn, manifest["analysis"]["smallest_relevant_ratio"])))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
