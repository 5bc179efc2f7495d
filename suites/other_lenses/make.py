#!/usr/bin/env python3
"""Writes lenses like relign_od whose radii and indices are off by a supplier's grade: python3 make.py

Every radius by a factor and every index by a sum, uniform within the grade's limits (test plates and melts):
commercial 0.5 % and 0.001, precision 0.1 % and 0.0005. Fixed draws.
"""

import json
import pathlib
import random

HERE = pathlib.Path(__file__).parent
DESIGN = HERE.parents[1] / "plugins/scenes/lens_system/relign_od"
GRADES = {"commercial": (0.005, 0.001), "precision": (0.001, 0.0005)}

for grade, (radius, index) in GRADES.items():
    draw = random.Random(grade)
    lens = json.loads((DESIGN / "lens.json").read_text())
    scene = json.loads((DESIGN / "scene.json").read_text())
    lens["name"] = scene["name"] = f"relign_od_{grade}"
    lens["source"] = f"relign_od, radii off by up to {100 * radius:g} %, indices by up to {index:g} (make.py)"
    del lens["published"]
    for element in lens["elements"]:
        element.pop("glass")
        for face in element["faces"]:
            face["radius_mm"] = round(face["radius_mm"] * (1 + draw.uniform(-radius, radius)), 6)
            if "index_after" in face:
                face["index_after"] = round(face["index_after"] + draw.uniform(-index, index), 6)
    scene["summary"] = f"relign_od as made: radii off by up to {100 * radius:g} %, indices by up to {index:g}."
    folder = HERE / grade
    folder.mkdir(exist_ok=True)
    (folder / "lens.json").write_text(json.dumps(lens, indent=1) + "\n")
    (folder / "scene.json").write_text(json.dumps(scene, indent=1) + "\n")
