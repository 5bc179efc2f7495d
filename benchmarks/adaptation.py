#!/usr/bin/env python3
"""What captures without labels buy: relign-train adapt with 10, 100 and 1,000 captures of three stations.

    export PATH=build/release/bin:$PATH PYTHONPATH=build/release/python
    python3 benchmarks/adaptation.py training/randomised -o results/adaptation

The stations: reflections (`relign_od-package`), another sensor and a target printed 1 % too large. Captures are of up to 50
training instances at uniform true poses, N = 0.25. Every adapted network and the one that it started from then align
`--instances` benchmark instances of the station. Prints median excess RMSE after 6 and 12 images with the 95 % interval, and
writes them to adaptation.csv. Adapted networks that are already in the folder are kept.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys

import numpy as np
from relign_bench.batch import Batch

STATIONS = {"reflections": "relign_od-package", "sensor": "relign_od-sensor", "target": "relign_od-target"}
LENSES = 50


def captures(scene, count):
    """Captures of training instances at uniform true poses; shape (count, height, width)."""
    lenses = min(count, LENSES)
    batch = Batch(lenses, scene, "rho0.25")
    batch.reset(range(lenses), range(7_000_000, 7_000_000 + lenses))
    poses = np.random.default_rng(count).uniform(size=(count, 5))
    slots = np.arange(count) % lenses
    parts = [batch.capture_at(slots[first:first + lenses], poses[first:first + lenses],
                              np.arange(first, min(first + lenses, count))) for first in range(0, count, lenses)]
    return np.concatenate(parts)


def adapted(given, station, count):
    out = given.out / f"{station}-{count}"
    if not (out / "adapted.onnx").is_file():
        images = given.out / f"captures-{station}-{count}"
        images.mkdir(parents=True, exist_ok=True)
        np.save(images / "captures.npy", captures(STATIONS[station], count).astype(np.float32))
        subprocess.run([sys.executable, "-m", "relign_bench.training", "adapt", given.run, "--images", images, "-o", out,
                        *(["--threads", str(given.threads)] if given.threads else [])], check=True)
    return out / "adapted.onnx"


def evaluated(given, station):
    """(name, steps) -> excess errors of all instances."""
    models = {"0": given.run / "imitation.onnx", **{str(count): adapted(given, station, count) for count in given.captures}}
    suite = given.out / f"{station}.json"
    suite.write_text(json.dumps({
        "name": f"adaptation_{station}", "scenes": [STATIONS[station]], "noise_levels": ["rho0.25"],
        "instances": given.instances, "protocol": "blind", "steps": 12,
        "algorithms": [{"use": "imitation", "name": f"after-{name}",
                        "parameters": {"model": str(model.resolve()), "other_scenes": True}}
                       for name, model in models.items()]}))
    names = [f"--only=algorithm=after-{name}" for name in models]
    results = given.out / f"trials-{station}"
    subprocess.run(["relign-bench", "run", suite, "-o", results, *names, "--progress", "none"], check=True,
                   stdout=subprocess.DEVNULL)
    rows = [row for row in csv.DictReader((results / "matrix.csv").open()) if row["rule"] == "own"]
    for row in rows:
        if not row["algorithm"].startswith("after-"):
            continue
        yield {"station": station, "captures": row["algorithm"].removeprefix("after-"), "images": row["images"],
               "instances": row["n"], "excess_median": row["excess_median"], "lo95": row["excess_lo95"],
               "hi95": row["excess_hi95"], "excess_q75": row["excess_q75"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=pathlib.Path, help="folder of a run of relign-train imitate")
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    parser.add_argument("--captures", type=int, nargs="+", default=[10, 100, 1000])
    parser.add_argument("--stations", nargs="+", choices=list(STATIONS), default=list(STATIONS))
    parser.add_argument("--threads", type=int, help="of the adaptations")
    parser.add_argument("--instances", type=int, default=20)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    found = [row for station in given.stations for row in evaluated(given, station)]
    with (given.out / "adaptation.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(found[0]))
        writer.writeheader()
        writer.writerows(found)
    for row in found:
        print(f"{row['station']:12} {row['captures']:>5} captures, {row['images']:>2} images: "
              f"{float(row['excess_median']):.4f} ({float(row['lo95']):.4f} to {float(row['hi95']):.4f})")


if __name__ == "__main__":
    main()
