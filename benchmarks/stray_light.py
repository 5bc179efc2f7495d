#!/usr/bin/env python3
"""Measures the stray light of a scene, from which the ranges of randomisation.json come.

    PYTHONPATH=build/release/python python3 benchmarks/stray_light.py --scene relign_od-package --instances 20

Renders noise-free images with transport `ghost` and without reflections (`fresnel`) at the own optimum of each instance and at
a uniform pose. Prints quantiles over the images of the difference: its mean and its 99.9th percentile over smooth pixels (means
of 8 x 8) in units of white, its centroid relative to that of the image, and the radius that half of it lies within, both as
shares of the side.
"""

import argparse

import numpy as np
from relign_bench.batch import Batch

SMOOTH = 8


def statistics(stray, image, white):
    side = stray.shape[0]
    smooth = stray.reshape(side // SMOOTH, SMOOTH, side // SMOOTH, SMOOTH).mean(axis=(1, 3)) / white
    rows, columns = np.indices(stray.shape)
    centre = [(rows * stray).sum() / stray.sum(), (columns * stray).sum() / stray.sum()]
    apart = np.hypot(centre[0] - (rows * image).sum() / image.sum(), centre[1] - (columns * image).sum() / image.sum())
    radius = np.hypot(rows - centre[0], columns - centre[1]).ravel()
    order = np.argsort(radius)
    within = np.cumsum(stray.ravel()[order])
    half = radius[order][np.searchsorted(within, within[-1] / 2)]
    return stray.mean() / white, smooth.max(), apart / side, half / side


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="relign_od-package")
    parser.add_argument("--instances", type=int, default=20)
    parser.add_argument("--level", type=float, default=0.25)
    given = parser.parse_args()
    level = {"noise_level": "rho", "noise_level_parameters": {"level": given.level}}
    ghosts = Batch(given.instances, given.scene, **level)
    direct = Batch(given.instances, given.scene, scene_parameters={"transport": "fresnel"}, **level)
    slots = list(range(given.instances))
    for batch in (ghosts, direct):
        batch.reset(slots, slots, "training")
    optima = np.array([found[0] for found in direct.optima(slots)])
    uniform = np.random.default_rng(1).uniform(size=optima.shape)
    print(f"{given.scene}, N = {given.level:g}, {given.instances} instances: 5, 50 and 95 % of the images")
    for name, poses in (("own optimum", optima), ("uniform pose", uniform)):
        images = direct.render_at(slots, poses)
        found = np.array([statistics(stray, image, direct.white) for stray, image in
                          zip(ghosts.render_at(slots, poses) - images, images) if image.mean() > 0])
        for label, values in zip(("mean, of white", "largest 8 x 8, of white", "centroid, of the side", "half within, of the side"),
                                 found.T):
            low, median, high = np.quantile(values, [0.05, 0.5, 0.95])
            print(f"{name:13} {label:25} {low:.4f} {median:.4f} {high:.4f}")


if __name__ == "__main__":
    main()
