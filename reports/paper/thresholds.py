"""Instances that meet the success thresholds of the authors' package, and after how many images: `python3
reports/paper/thresholds.py RESULTS... > reports/paper/thresholds.csv`, from the raw trials of results folders.

The package ends an episode once the measured RMSE (camera noise included) is below a threshold that depends on the noise level.
Standard library only.
"""

import csv
import json
import pathlib
import statistics
import sys

THRESHOLDS = {"rho0": 0.051, "rho0.25": 0.0555, "rho0.5": 0.060}  # relign 0.1.0, 64 samples per pixel
NEVER = float("inf")


def trials(folder):
    """Closing line and lines of the steps of each trial."""
    planned = set(json.loads((folder / "manifest.json").read_text())["order"])
    steps = {}
    for file in sorted((folder / "trials").glob("*.jsonl")):
        for text in file.open():
            line = json.loads(text)
            if "end" not in line:
                steps.setdefault(line["trial"], []).append(line)
            elif line["trial"] in planned:
                yield line, steps.pop(line["trial"], [])


def first_under(measured, threshold):
    return next((step for step, value in enumerate(measured) if value < threshold), NEVER)


def main(folders):
    arrivals = {}
    for folder in map(pathlib.Path, folders):
        for closing, lines in trials(folder):
            if closing["end"] not in ("budget_spent", "finished"):
                continue
            level = closing["noise_level"]
            key = (level, closing["protocol"], closing["algorithm"])
            arrivals.setdefault(key, []).append(first_under([line["measured"] for line in lines], THRESHOLDS[level]))
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("noise_level", "protocol", "algorithm", "threshold", "n", "met_at_start", "met_after_1", "met_ever",
                    "images_median"))
    for (level, protocol, algorithm), steps in sorted(arrivals.items()):
        median = statistics.median(steps)
        table.writerow((level, protocol, algorithm, THRESHOLDS[level], len(steps), sum(step == 0 for step in steps),
                        sum(step <= 1 for step in steps), sum(step < NEVER for step in steps),
                        "" if median == NEVER else median))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1:])
