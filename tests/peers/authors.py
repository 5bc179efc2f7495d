"""Contrasts in which each method recommends by the rule of its authors: `python3 tests/peers/authors.py reports/paper >
reports/paper/authors.csv`, from instances.csv, merit.csv and trainings/instances.csv of a study, protocol `paper`.

The package's searches return the pose of the lowest merit (column `rmse` of merit.csv; the own rule of random), its policies
end at their last pose, other methods keep their own rule. None of these contrasts was planned. Needs SciPy and pandas.
"""

import csv
import json
import pathlib
import sys

import pandas as pd
from floors import FLOORS, RESAMPLES, compared
from scipy_statistics import draws

MERIT, POLICIES = ("bo-gp",), ("ppo-paper", "ppo-exact")
COLUMNS = ("noise_level", "first", "first_rule", "second", "second_rule", "n", "ratio", "lo95", "hi95", "verdict")


def rule_of(method):
    return "merit" if method in MERIT else "recommended_current" if method.startswith(POLICIES) else "recommended"


def main(folder):
    merit = pd.read_csv(folder / "merit.csv").set_index("trial").rmse
    trials = pd.concat([pd.read_csv(folder / "instances.csv"), pd.read_csv(folder / "trainings" / "instances.csv")])
    trials = trials[trials.protocol == "paper"].drop_duplicates("trial")
    trials["merit"] = trials.trial.map(merit)
    manifest = json.loads((folder / "manifest.json").read_text())
    firsts = [name for name in trials.algorithm.unique()
              if name.startswith(POLICIES) and "shrinking" not in name or name in ("imitation-ppo", "bo-gp")]
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    for level, group in trials.groupby("noise_level", sort=False):
        drawn = draws(group.instance.nunique(), RESAMPLES, int(manifest["seed"]))
        for first in firsts:
            second = "random" if first == "bo-gp" else "bo-gp"
            errors = [group[group.algorithm == name].set_index("instance").sort_index()[rule_of(name)]
                      for name in (first, second)]
            table.writerow((level, first, rule_of(first), second, rule_of(second),
                            *compared(*errors, FLOORS[-1], drawn, manifest["analysis"]["smallest_relevant_ratio"])))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
