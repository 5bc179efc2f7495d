"""Writes the suites of the third run (README.md, "Plan of the third run") into a folder, a suite for each class.

    python3 reports/camera_module/plan.py FOLDER
    relign-bench run FOLDER/precision_stepper.json

They are suites/camera_module.json with 100 modules, batches of 12, a seed of its own for each class, and a method that
aligns to the plane of best focus. Standard library only.
"""

import json
import pathlib
import sys

SUITES = pathlib.Path(__file__).resolve().parents[2] / "suites"
SEEDS = {
    "precision_stepper": 2026113001,
    "commercial_stepper": 2026113002,
    "precision_piezo": 2026113003,
    "commercial_piezo": 2026113004,
}
MODULES, BATCH = 100, 12
TO_THE_PLANE = {"use": "field-focus", "name": "field-focus to the plane", "parameters": {"worst_field": False}}


def write(folder, name, document):
    (folder / name).write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def write_suite(folder, module_class, seed):
    level = json.loads((SUITES / "camera_module" / f"{module_class}.json").read_text(encoding="utf-8"))
    level["batch"]["size"] = BATCH
    write(folder, f"level_{module_class}.json", level)
    suite = json.loads((SUITES / "camera_module.json").read_text(encoding="utf-8"))
    suite["name"] = f"camera_{module_class}"
    suite["noise_levels"] = [{"use": f"level_{module_class}.json", "name": module_class.replace("_", ", ")}]
    suite["seed"] = seed
    suite["instances"] = MODULES
    suite["algorithms"].insert(2, TO_THE_PLANE)
    write(folder, f"{module_class}.json", suite)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for each, its_seed in SEEDS.items():
        write_suite(target, each, its_seed)
