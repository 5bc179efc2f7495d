"""Instances in the specification after ten and fifty images, at the recommended pose and at the last one: `python3
reports/paper/specification.py RESULTS > reports/paper/trainings/linear.csv`, from the raw trials of a results folder.

A row has, by noise level, method and images, the number of instances, those in the specification by the rules `own` and
`current`, and the median errors. Trials that failed count as outside. Standard library only.
"""

import csv
import math
import pathlib
import statistics
import sys

from thresholds import trials

SPECIFICATION = 0.0142  # of relign_od: a noise-free image shifted sideways by one pixel (docs/reproduction.md)
LIMITS = (SPECIFICATION, SPECIFICATION / 2, 0.005)
IMAGES = (10, 50)


def main(folder):
    instances, errors = {}, {}
    for closing, lines in trials(folder):
        name = (closing["noise_level"], closing["algorithm"])
        instances[name] = instances.get(name, 0) + 1
        for line in lines:
            if line["step"] in IMAGES:
                errors.setdefault((name, line["step"]), []).append([math.sqrt(max(0, line[f"{pose}_mse"]))
                                                                    for pose in ("recommended", "commanded")])
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("noise_level", "algorithm", "images", "n", "in_spec_own", "in_spec_current", "own_median",
                    "current_median"))
    for (name, images), found in sorted(errors.items()):
        by_rule = list(zip(*found))
        table.writerow((*name, images, instances[name], *(sum(error <= SPECIFICATION for error in rule) for rule in by_rule),
                        *(f"{statistics.median(rule):.6g}" for rule in by_rule)))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
