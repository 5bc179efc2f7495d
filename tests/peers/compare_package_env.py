"""An agent of relign-bench in the authors' LensEnv and in relign-bench's scenes: noise-free RMSE after each step.

    RELIGN_BENCH=build/release/bin/relign-bench .peers/bin/python tests/peers/compare_package_env.py results/package_env

Twenty instances with ten steps are 260 captures of the package, 3 s each on two idle cores. An interrupted comparison resumes
in the same folder. Two scenes of relign-bench are compared: relign_od-package has the reflections of the package's lens;
relign_od, on which the agents were trained, has none. The printed values are also in curve-AGENT-LEVEL.csv in the folder.
"""

import argparse
import csv
import json
import os
import shutil
from pathlib import Path

import numpy as np
import package_images
import program


def run(folder, scene, level, given, instances, seed=1):
    suite = folder.with_suffix(".json")
    suite.write_text(json.dumps({
        "seed": seed, "scenes": [scene], "noise_levels": [level], "instances": instances, "steps": given.steps,
        "protocol": "blind",
        "algorithms": [{"use": given.agent, "name": "agent", "parameters": {"other_scenes": True}},
                       # The runner adds it to every suite; one step is the minimum.
                       {"use": "random", "steps": 1}]}))
    program.call("run", suite, "-o", folder)
    return folder


def package_log(given, instance):
    """Poses and elements at every step of the agent's trial; from the folder if they are already there."""
    log = given.folder / f"package-{given.agent}-{given.level:g}-{instance}.jsonl"
    if not log.is_file():
        results, writing = given.folder / "running", log.with_suffix(".part")
        shutil.rmtree(results, ignore_errors=True)
        writing.unlink(missing_ok=True)
        scene = {"use": str(Path(__file__).parent.resolve() / "package_station.py"), "name": "package",
                 "parameters": {"level": given.level, "log": str(writing.resolve())}}
        run(results, scene, "none", given, 1, seed=instance + 1)
        writing.rename(log)
    trials = {}
    for line in map(json.loads, log.read_text().splitlines()):
        trials.setdefault(line["trial"], []).append(line)
    found = [lines for lines in trials.values() if len(lines) == given.steps + 1]
    if len(found) != 1:
        raise RuntimeError(f"{log}: expected one trial of {given.steps} steps, found {len(found)}; delete the file")
    return found[0]


def in_the_package(given):
    """RMSE of relign_od at the package's poses and with its elements: the package has no noise-free images."""
    target = package_images.pattern_file("siemens")
    wanted = program.render(given.folder, [0.5] * 5, {}, target)
    rmse = []
    for instance in range(given.instances):
        images = [program.render(given.folder, line["pose"], line["elements"], target)
                  for line in package_log(given, instance)]
        rmse.append([np.sqrt(np.mean((image - wanted) ** 2)) for image in images])
        print(f"package, instance {instance + 1}: {' '.join(f'{value:.4f}' for value in rmse[-1])}", flush=True)
    return rows("package", np.array(rmse))


def rows(where, rmse):
    """Quartiles by step; rmse has shape (instances, steps + 1)."""
    return [[where, step, len(rmse), *np.quantile(rmse[:, step], [0.25, 0.5, 0.75])] for step in range(rmse.shape[1])]


def in_our_scene(given, scene, instances):
    folder = given.folder / f"{scene}-{given.agent}-{given.level:g}-{instances}"
    results = run(folder, scene, f"rho{given.level:g}-package", given, instances)
    with open(results / "curves.csv") as table:
        return [[scene, int(row["step"]), int(row["n"]), *(float(row[f"commanded_{q}"]) for q in ("q25", "median", "q75"))]
                for row in csv.DictReader(table) if row["algorithm"] == "agent"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--agent", default="imitation")
    parser.add_argument("--level", type=float, choices=[0, 0.25, 0.5], default=0.25, help="N of the element offsets")
    parser.add_argument("--instances", type=int, default=20, help="instances of the package")
    parser.add_argument("--with-reflections", type=int, default=20, help="instances of relign_od-package")
    parser.add_argument("--steps", type=int, default=10)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("RELIGN_CALL_SECONDS", "600")  # the package is slow on a busy machine
    found = (in_our_scene(given, "relign_od", 100) + in_our_scene(given, "relign_od-package", given.with_reflections) +
             in_the_package(given))
    with open(given.folder / f"curve-{given.agent}-{given.level:g}.csv", "w", newline="") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(["where", "step", "lenses", "q25", "median", "q75"])
        table.writerows([*row[:3], *(f"{value:.5f}" for value in row[3:])] for row in found)
    print(f"{given.agent}, N = {given.level:g}: median noise-free RMSE (quartiles)")
    for where, step, count, q25, median, q75 in found:
        print(f"{where}, {count} instances, step {step}: {median:.4f} ({q25:.4f} - {q75:.4f})")


if __name__ == "__main__":
    main()
