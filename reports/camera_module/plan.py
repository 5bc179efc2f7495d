"""Writes the suites of the third, fourth or fifth run (README.md, "Plan of ...") into a folder, a suite for each class.

    python3 reports/camera_module/plan.py third FOLDER
    relign-bench run FOLDER/precision_stepper.json

They are suites/camera_module.json with 100 modules, batches of 12, and a seed of its own for each class. The third run adds a
method that aligns to the plane of best focus; the fourth has `field-focus-plane` alone. The fifth has 24 modules, each with
several kinds of physics. Standard library only.
"""

import json
import os
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
    "fifth": {"precision_piezo": 2026113009},
}
MODULES, BATCH = 100, 12
TO_THE_PLANE = {
    "third": {"use": "field-focus", "name": "field-focus to the plane", "parameters": {"worst_field": False}},
    "fourth": {"use": "field-focus-plane", "name": "field-focus-plane"},
}
FIFTH_MODULES = 24
FIFTH_METHODS = ("field-focus with limits", "sensitivity-linear")
WARPS_UM = (10, -10)
CAMERA = SUITES.parent / "plugins" / "scenes" / "lens_system" / "camera_2mp"


def write(folder, name, document):
    (folder / name).write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def scene_with_diffraction(folder, plain):
    """The camera with diffraction in its MTF by field; its images stay as they are."""
    scene = json.loads((CAMERA / "scene.json").read_text(encoding="utf-8"))
    scene["lens"] = os.path.relpath(CAMERA / "lens.json", folder)
    scene["spec"]["mtf"] = {"lp_per_mm": 41.7, "centre": 0.6, "corner": 0.45, "diffraction": True}
    write(folder, "diffraction.json", scene)
    parameters = plain["parameters"] | {"sampler": "lattice", "samples": 8}  # those of camera_2mp
    return {"use": "diffraction.json", "name": "diffraction", "parameters": parameters}


def write_fifth(folder, suite):
    plain = suite["scenes"][0] | {"name": "plain"}
    warped = [plain | {"name": f"warp {warp:+d} um", "parameters": plain["parameters"] | {"sensor_warp": warp}}
              for warp in WARPS_UM]  # fmt: skip
    suite["scenes"] = [plain, *warped, scene_with_diffraction(folder, plain)]
    suite["instances"] = FIFTH_MODULES
    suite["algorithms"] = [
        method for method in suite["algorithms"] if (method if isinstance(method, str) else method["name"]) in FIFTH_METHODS
    ] + [TO_THE_PLANE["fourth"]]
    suite["analysis"]["contrasts"] = [["field-focus with limits", "sensitivity-linear"]]


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
    elif run == "fifth":
        write_fifth(folder, suite)
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
