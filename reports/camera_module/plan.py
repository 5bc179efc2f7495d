"""Writes the suites of the third or fourth run (README.md, "Plan of ...") into a folder, a suite for each class.

    python3 reports/camera_module/plan.py third FOLDER
    relign-bench run FOLDER/precision_stepper.json

They are suites/camera_module.json with 100 modules, batches of 12, and a seed of its own for each class. The third run adds a
method that aligns to the plane of best focus; the fourth has `field-focus-plane` alone. Standard library only.
"""

import json
import pathlib
import sys

SUITES = pathlib.Path(__file__).resolve().parents[2] / "suites"
SEEDS = {
    "third": {
        "precision_stepper": 2026113001,
        "commercial_stepper": 2026113002,
        "precision_piezo": 2026113003,
        "commercial_piezo": 2026113004,
    },
    "fourth": {
        "precision_piezo": 2026113005,
        "precision_stepper": 2026113006,
        "commercial_piezo": 2026113007,
        "commercial_stepper": 2026113008,
    },
}
MODULES, BATCH = 100, 12
TO_THE_PLANE = {
    "third": {"use": "field-focus", "name": "field-focus to the plane", "parameters": {"worst_field": False}},
    "fourth": {"use": "field-focus-plane", "name": "field-focus-plane"},
}


def write(folder, name, document):
    (folder / name).write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def write_suite(folder, run, module_class):
    level = json.loads((SUITES / "camera_module" / f"{module_class}.json").read_text(encoding="utf-8"))
    level["batch"]["size"] = BATCH
    write(folder, f"level_{module_class}.json", level)
    suite = json.loads((SUITES / "camera_module.json").read_text(encoding="utf-8"))
    suite["name"] = f"camera_{module_class}"
    suite["noise_levels"] = [{"use": f"level_{module_class}.json", "name": module_class.replace("_", ", ")}]
    suite["seed"] = SEEDS[run][module_class]
    suite["instances"] = MODULES
    if run == "third":
        suite["algorithms"].insert(2, TO_THE_PLANE[run])
    else:
        suite["algorithms"] = [TO_THE_PLANE[run]]
        del suite["analysis"]["contrasts"], suite["cost"]["baseline"]
    write(folder, f"{module_class}.json", suite)


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in SEEDS:
        sys.exit(__doc__)
    target = pathlib.Path(sys.argv[2])
    target.mkdir(parents=True, exist_ok=True)
    for each in SEEDS[sys.argv[1]]:
        write_suite(target, sys.argv[1], each)
