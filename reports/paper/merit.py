"""Noise-free RMSE at the pose of the lowest merit, the rule of scikit-optimize and of the paper's package: `python3
reports/paper/merit.py RESULTS... > reports/paper/merit.csv`, from the raw trials of results folders.

A row has a trial of bo-gp under protocol `paper`, by its id in instances.csv, with the step of the lowest merit (the first of
equal ones) among the poses to which the search moved. Under `blind` the merit is the measured RMSE. Standard library only.
"""

import csv
import math
import pathlib
import sys

from thresholds import trials


def main(folders):
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("trial", "noise_level", "protocol", "algorithm", "instance", "step", "merit", "rmse"))
    for folder in map(pathlib.Path, folders):
        for closing, lines in trials(folder):
            if (closing["algorithm"], closing["protocol"]) == ("bo-gp", "paper"):
                lowest = min(lines[1:], key=lambda line: line["merit"])
                table.writerow((closing["trial"], closing["noise_level"], closing["protocol"], closing["algorithm"],
                                closing["instance"], lowest["step"], f"{lowest['merit']:.6g}",
                                f"{math.sqrt(max(0, lowest['commanded_mse'])):.6g}"))


if __name__ == "__main__":
    main(sys.argv[1:])
