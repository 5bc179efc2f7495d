"""The instances of the third and fourth run, a class of modules at a time: see README.md, "Third run".

    python3 reports/camera_module/plan.py third FOLDER
    relign-bench run FOLDER/precision_stepper.json -o RESULTS
    python3 reports/camera_module/add_class.py third precision_stepper RESULTS    puts it into third_instances.csv

Adds how far from its module's plane of best focus the method to the plane ended, before the glue cured. Failed trials have
empty cells. Needs the package relign_bench and NumPy; table.py makes the tables, without them.
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
from relign_bench.results import ENDED_WELL, read_trials

HERE = pathlib.Path(__file__).resolve().parent
TAKEN = ("algorithm", "instance", "field_mtf_deficit", "centre_px", "pose_um", "tilt_arcmin", "recommended_seconds",
         "criterion_optimum_deficit")
PLANE = ("plane_um", "plane_z_um", "plane_arcmin", "plane_rx_arcmin", "plane_ry_arcmin")


def planes(folder, run, module_class):
    """By instance, of the method to the plane: the columns PLANE, of the last pose before curing."""
    method = plan.TO_THE_PLANE[run]["name"]
    ended = {closing["instance"]: steps for closing, steps in read_trials(folder)
             if closing["algorithm"] == method and closing["end"] in ENDED_WELL}  # fmt: skip
    with tempfile.TemporaryDirectory() as scratch:
        plan.write_suite(pathlib.Path(scratch), run, module_class)
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
        found[instance] = [np.linalg.norm(away[:3]), away[2], np.linalg.norm(away[3:]), *away[3:]]
        print(module_class, instance, file=sys.stderr)
    return found


def rows_of(folder, run, module_class):
    distances = planes(folder, run, module_class)
    with (pathlib.Path(folder) / "instances.csv").open(encoding="utf-8", newline="") as file:
        trials = list(csv.DictReader(file))
    rows = []
    for trial in trials:
        row = {"class": module_class} | {column: trial[column] for column in TAKEN}
        for column in TAKEN[2:]:
            row[column] = row[column] and f"{float(row[column]):.5g}"
        is_aimed = trial["algorithm"] == plan.TO_THE_PLANE[run]["name"]
        aimed = distances.get(int(trial["instance"]), [""] * len(PLANE)) if is_aimed else [""] * len(PLANE)
        rows.append(row | {column: value if value == "" else f"{value:.4g}" for column, value in zip(PLANE, aimed)})
    return rows


if __name__ == "__main__":
    if len(sys.argv) != 4 or sys.argv[2] not in plan.SEEDS.get(sys.argv[1], ()):
        sys.exit(__doc__)
    the_run, the_class, results = sys.argv[1:]
    file, others = HERE / f"{the_run}_instances.csv", []
    if file.exists():
        with file.open(encoding="utf-8", newline="") as old:
            others = [row for row in csv.DictReader(old) if row["class"] != the_class]
    added = rows_of(results, the_run, the_class)
    together = others + added
    order = list(plan.SEEDS[the_run])
    together.sort(key=lambda row: order.index(row["class"]))  # stable: methods and instances stay as they are
    with file.open("w", encoding="utf-8", newline="") as new:
        writer = csv.DictWriter(new, fieldnames=list(added[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(together)
