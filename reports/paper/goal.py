"""What the goal of training, a score of the package, says about a pose, on tuning instances:

    PYTHONPATH=build/release/python python3 reports/paper/goal.py > reports/paper/trainings/goal.csv

Six random poses of each of 48 instances at each level, uniform in shells around the nominal pose. A row has the share of
poses whose measured RMSE is below the goal, and of those whose noise-free RMSE is within the specification of the study.
Needs numpy. A minute of one core.
"""

import csv
import sys

import numpy as np
from specification import SPECIFICATION

from relign_bench.batch import Batch
from relign_bench.training.recipe import GOALS

INSTANCES, POSES = 48, 6
FIRST_NUMBER = 30_000  # no network was chosen on them
SHELLS = ((0.0, 0.1), (0.1, 0.2), (0.2, 0.4))  # shares of the travel


def main():
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(("noise_level", "goal", "from", "to", "poses", "measured_below_goal", "in_spec", "median_rmse"))
    every, random = list(range(INSTANCES)), np.random.default_rng(5)
    for level, goal in GOALS.items():
        batch = Batch(INSTANCES, "relign_od", "rho", noise_level_parameters={"level": level})
        batch.reset(every, [FIRST_NUMBER + slot for slot in every], "tuning")
        nominal = np.asarray(batch.nominal_pose)
        # The camera's noise, the same at every pose.
        noise = np.median(np.array(batch.measured_error(every)) ** 2 - batch.noise_free_mse(every)[0])
        for low, high in SHELLS:
            mse = []
            for seed in range(1, POSES + 1):
                way = random.normal(size=(INSTANCES, len(nominal)))
                axes = len(nominal)
                radius = (low**axes + random.random(INSTANCES) * (high**axes - low**axes)) ** (1 / axes)
                poses = nominal + way / np.linalg.norm(way, axis=1, keepdims=True) * radius[:, None]
                mse.append(batch.noise_free_mse_at(every, poses, [seed] * INSTANCES)[0])
            mse = np.concatenate(mse)
            table.writerow((f"rho{level:g}", goal, low, high, len(mse), f"{(mse + noise < goal**2).mean():.3g}",
                            f"{(np.sqrt(np.maximum(mse, 0)) <= SPECIFICATION).mean():.3g}",
                            f"{np.sqrt(np.median(mse)):.4g}"))


if __name__ == "__main__":
    main()
