"""Rank correlation between the errors of a method at two noise levels, over the instances of the study: `python3
reports/paper/levels.py > reports/paper/levels.csv`, from instances.csv beside it.

An instance number is one draw at every level, scaled by the level, so its errors are not independent between levels. Spearman's
coefficient, with mean ranks for ties. Standard library only.
"""

import csv
import itertools
import statistics
import sys

from cells import COLUMNS, LEVELS, RULES, read


def ranks(values):
    """Ranks from 1; equal values share their mean rank."""
    return [sum(other < value for other in values) + (sum(other == value for other in values) + 1) / 2 for value in values]


def main():
    errors = {}
    for row in read("instances.csv"):
        for rule in RULES:
            of_level = errors.setdefault((row["protocol"], row["algorithm"], rule), {}).setdefault(row["noise_level"], {})
            of_level[int(row["instance"])] = float(row[COLUMNS[rule]])
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("protocol", "algorithm", "rule", "first_level", "second_level", "n", "rank_correlation"))
    for key, of_level in errors.items():
        for first, second in itertools.combinations(LEVELS, 2):
            instances = sorted(of_level[first].keys() & of_level[second].keys())
            both = [ranks([of_level[level][instance] for instance in instances]) for level in (first, second)]
            table.writerow((*key, first, second, len(instances), f"{statistics.correlation(*both):.3f}"))


if __name__ == "__main__":
    main()
