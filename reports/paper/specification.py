"""Instances in the specification after ten and fifty images, at the recommended pose and at the last one: `python3
reports/paper/specification.py RESULTS > reports/paper/trainings/linear.csv`, from the raw trials of a results folder.

A row has, by noise level, method and images, the number of instances, those in the specification by the rules `own` and
`current`, and the median errors. Trials that failed count as outside. Standard library only.
"""

import csv
import json
import math
import pathlib
import statistics
import sys

SPECIFICATION = 0.0142  # docs/reproduction.md
IMAGES = (10, 50)


def main(folder):
    errors, names, instances = {}, {}, {}
    for file in sorted((folder / "trials").glob("*.jsonl")):
        for text in file.open():
            line = json.loads(text)
            if "end" in line:
                names[line["trial"]] = (line["noise_level"], line["algorithm"])
            elif line["step"] in IMAGES:
                errors[line["trial"], line["step"]] = [math.sqrt(max(0, line[f"{pose}_mse"]))
                                                       for pose in ("recommended", "commanded")]
    for name in names.values():
        instances[name] = instances.get(name, 0) + 1
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("noise_level", "algorithm", "images", "n", "in_spec_own", "in_spec_current", "own_median",
                    "current_median"))
    for name, count in sorted(instances.items()):
        for images in IMAGES:
            found = [errors[trial, images] for trial, of in names.items() if of == name and (trial, images) in errors]
            if not found:  # ends earlier, as `home` does
                continue
            by_rule = list(zip(*found))
            table.writerow((*name, images, count, *(sum(error <= SPECIFICATION for error in rule) for rule in by_rule),
                            *(f"{statistics.median(rule):.6g}" for rule in by_rule)))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
