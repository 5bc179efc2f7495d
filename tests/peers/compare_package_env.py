"""Our agents inside the authors' LensEnv, beside the same agents in our scene: noise-free RMSE after each step.

    RELIGN_BENCH=build/release/bin/relign-bench .peers/bin/python tests/peers/compare_package_env.py imitation

Twenty lenses, ten steps: some ten minutes, all of it the package's renderer. Both columns are the RMSE of our own
noise-free image (relign_od, no ghosts) at the pose and elements that were there.
"""

import csv
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
import package_images
import program

INSTANCES, STEPS, LEVEL = 20, 10, 0.25


def run(folder, name, scene, level, agent):
    suite = Path(folder) / f"{name}.json"
    suite.write_text(json.dumps({
        "scenes": [scene], "noise_levels": [level], "instances": INSTANCES, "steps": STEPS, "protocol": "blind",
        # Random search stands in every suite: one step of it, which takes the package three seconds.
        "algorithms": [{"use": agent, "name": "agent", "parameters": {"other_scenes": True}}, {"use": "random", "steps": 1}]}))
    program.call("run", suite, "-o", Path(folder) / name)
    return Path(folder) / name


def in_the_package(folder, agent):
    log = Path(folder) / "log.jsonl"
    scene = {"use": str(Path(__file__).parent / "package_station.py"), "name": "package",
             "parameters": {"level": LEVEL, "log": str(log)}}
    run(folder, "package", scene, "none", agent)
    target = package_images.pattern_file("siemens")
    wanted = program.render(folder, [0.5] * 5, {}, target)
    found = {}
    trials = {}
    for line in map(json.loads, log.read_text().splitlines()):
        trials.setdefault(line["trial"], []).append(line)
    for lines in trials.values():
        if len(lines) != STEPS + 1:
            continue
        for line in lines:
            image = program.render(folder, line["pose"], line["elements"], target)
            found.setdefault(line["step"], []).append(np.sqrt(np.mean((image - wanted) ** 2)))
    return {step: (*np.quantile(errors, [0.25, 0.5, 0.75]), len(errors)) for step, errors in found.items()}


def in_our_scene(folder, agent):
    results = run(folder, "ours", "relign_od", f"rho{LEVEL}-package", agent)
    with open(results / "curves.csv") as table:
        return {int(row["step"]): (*(float(row[f"commanded_{q}"]) for q in ("q25", "median", "q75")), int(row["n"]))
                for row in csv.DictReader(table) if row["algorithm"] == "agent"}


def main():
    agent = sys.argv[1] if len(sys.argv) > 1 else "imitation"
    with tempfile.TemporaryDirectory() as folder:
        package, ours = in_the_package(folder, agent), in_our_scene(folder, agent)
    print(f"{agent}, N = {LEVEL}: median noise-free RMSE (quartiles)")
    for step in range(STEPS + 1):
        columns = []
        for found in (package, ours):
            q25, median, q75, count = found[step]
            columns.append(f"{median:.4f} ({q25:.4f} - {q75:.4f}), n = {count}")
        print(f"step {step:2}: in the package {columns[0]}; in our scene {columns[1]}")


if __name__ == "__main__":
    main()
