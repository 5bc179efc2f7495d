"""The instances of the third run, a class of modules at a time: see README.md, "Third run".

    python3 reports/camera_module/plan.py FOLDER
    relign-bench run FOLDER/precision_stepper.json -o RESULTS
    python3 reports/camera_module/third_run.py precision_stepper RESULTS    puts the class into third_instances.csv

Adds how far from its module's plane of best focus `field-focus to the plane` ended, before the glue cured. Needs the package
relign_bench and NumPy; table.py makes the tables, without them.
"""

import csv
import json
import pathlib
import sys
import tempfile

import focus
import numpy as np
import plan

from relign_bench import Batch
from relign_bench.results import read_trials

FILE = pathlib.Path(__file__).resolve().parent / "third_instances.csv"
TAKEN = ("algorithm", "instance", "field_mtf_deficit", "centre_px", "pose_um", "tilt_arcmin", "recommended_seconds",
         "criterion_optimum_deficit")
PLANE = ("plane_um", "plane_z_um", "plane_arcmin")


def planes(folder, module_class):
    """By instance, of `field-focus to the plane`: the columns PLANE, of the last pose before curing."""
    method = plan.TO_THE_PLANE["name"]
    ended = {closing["instance"]: steps for closing, steps in read_trials(folder) if closing["algorithm"] == method}
    with tempfile.TemporaryDirectory() as scratch:
        plan.write_suite(pathlib.Path(scratch), module_class, plan.SEEDS[module_class])
        suite = json.loads((pathlib.Path(scratch) / f"{module_class}.json").read_text(encoding="utf-8"))
        design_px, response = focus.design_response(suite)
        scene, level = suite["scenes"][0], str(pathlib.Path(scratch) / suite["noise_levels"][0]["use"])
        batch = Batch(1, scene["use"], level, suite_seed=suite["seed"], scene_parameters=scene["parameters"], threads=1)
    found = {}
    for instance, steps in sorted(ended.items()):
        batch.reset([0], [instance], "benchmark")
        lens = focus.Lens(batch, suite, design_px)
        best = focus.plane_of_best_focus(lens, response)[0]  # centres the lens
        plane = np.concatenate([lens.xy, best])
        glued = np.array(steps[-1]["recommended_true_pose"]) - batch.instance(0)["cure_shift"]
        away = lens.focus(glued) - plane
        found[instance] = [np.linalg.norm(away[:3]), away[2], np.linalg.norm(away[3:])]
        print(module_class, instance, file=sys.stderr)
    return found


def rows_of(folder, module_class):
    distances = planes(folder, module_class)
    with (pathlib.Path(folder) / "instances.csv").open(encoding="utf-8", newline="") as file:
        trials = list(csv.DictReader(file))
    if any(trial["message"] for trial in trials):
        sys.exit(f"{folder} has failed trials")
    rows = []
    for trial in trials:
        row = {"class": module_class} | {column: trial[column] for column in TAKEN}
        for column in TAKEN[2:]:
            row[column] = row[column] and f"{float(row[column]):.5g}"
        aimed = distances[int(trial["instance"])] if trial["algorithm"] == plan.TO_THE_PLANE["name"] else ("", "", "")
        rows.append(row | {column: value if value == "" else f"{value:.4g}" for column, value in zip(PLANE, aimed)})
    return rows


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in plan.SEEDS:
        sys.exit(__doc__)
    others = []
    if FILE.exists():
        with FILE.open(encoding="utf-8", newline="") as old:
            others = [row for row in csv.DictReader(old) if row["class"] != sys.argv[1]]
    together = others + rows_of(sys.argv[2], sys.argv[1])
    together.sort(key=lambda row: list(plan.SEEDS).index(row["class"]))  # stable: methods and instances stay as they are
    with FILE.open("w", encoding="utf-8", newline="") as new:
        writer = csv.DictWriter(new, fieldnames=list(together[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(together)
