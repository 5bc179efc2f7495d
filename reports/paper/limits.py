"""What separates trainings of the paper's recipe from the optimum, on tuning instances that chose no network:

    PYTHONPATH=build/release/python python3 reports/paper/limits.py NETWORK.onnx... > reports/paper/trainings/limits.csv

A network makes fifty moves on each of 48 instances of its own noise level, without exploration: in full, as trained, and
then from the fifth on scaled by 4 / move, so that they settle where the mean move is zero. (Of 4, 8 and 16, four was best
for two networks on other tuning instances.) A row has:

    rmse              noise-free RMSE at the last pose, the median with a bootstrap interval of 95 %
    corrected         the same without the mean offset from the own optima, as estimated on the other half of the instances
    in_spec_10, ...   share of the instances in the specification at the pose after 10, 20 and 50 images
    distance          median distance of the last pose from the nominal one; of the own optimum, `optimum_distance`
    goal              share of the instances on which one of the fifty poses reaches the goal of training

Needs numpy, torch and onnxruntime. About a minute of one core for a network.
"""

import csv
import json
import pathlib
import sys

import numpy as np
import onnxruntime

from relign_bench.conventions import LARGEST_MOVE
from relign_bench.rewards import scores
from relign_bench.training.evaluation import rmse_after_steps
from relign_bench.training.instances import InstanceSet

INSTANCES, FULL = 48, 4
IMAGES = (10, 20, 50)
SPECIFICATION = 0.0142  # of the study, docs/reproduction.md
FIRST_NUMBER = 10_000  # networks were chosen on those from 0, FULL on those from 20,000
GAINS = {"full": lambda move: 1.0, "shrinking": lambda move: min(1.0, FULL / move)}
COLUMNS = ("training", "noise_level", "moves", "rmse", "rmse_lo95", "rmse_hi95", "corrected", "corrected_lo95",
           "corrected_hi95", *(f"in_spec_{images}" for images in IMAGES), "distance", "optimum_distance", "goal")


def median(values):
    draws = np.random.default_rng(1).integers(0, len(values), (10_000, len(values)))
    return [float(np.median(values)), *np.quantile(np.median(values[draws], axis=1), (0.025, 0.975))]


def rows(path):
    about = json.loads(path.with_suffix(".json").read_text())
    recipe, seen = about["trained"]["recipe"], about["observation"]
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, options)
    network = session.get_inputs()[0].name
    instances = InstanceSet(recipe["scene"], [recipe["level"]], INSTANCES, seen["size"], family="tuning",
                            observation="float32" if seen.get("values") == "irradiance" else "uint8")
    batch, every, nominal = instances.batches[0], list(range(INSTANCES)), instances.nominal_pose
    instances.reset(FIRST_NUMBER)
    optima, _ = instances.exact_optima()
    for name, gain in GAINS.items():
        reached = np.zeros(INSTANCES, bool)

        def policy(frames, move, memory, gain=gain, reached=reached):
            answers = np.concatenate([session.run(None, {network: one[None].astype(np.float32)})[0] for one in frames])
            merit = scores("combined", batch.measured_rmse(every), instances.true_poses(), nominal, None, None)
            reached |= merit < recipe["goal"]
            return gain(move) * np.clip(answers.astype(np.float64), -LARGEST_MOVE, LARGEST_MOVE), memory

        errors = rmse_after_steps(policy, instances, seen["frames"], IMAGES)
        poses = instances.true_poses()
        half = INSTANCES // 2
        offsets = (poses - optima).reshape(2, half, -1).mean(axis=1)[::-1].repeat(half, axis=0)
        mse, _ = batch.noise_free_mse_at(every, np.clip(poses - offsets, 0, 1), [IMAGES[-1]] * INSTANCES)
        distance, optimum = (np.median(np.linalg.norm(at - nominal, axis=1)) for at in (poses, optima))
        yield (path.stem, f"rho{recipe['level']:g}", name,
               *(f"{value:.6g}" for value in (
                   *median(errors[IMAGES[-1]]), *median(np.sqrt(np.maximum(0, mse))),
                   *((error <= SPECIFICATION).mean() for error in errors.values()), distance, optimum, reached.mean())))


def main(paths):
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    for path in paths:
        table.writerows(rows(pathlib.Path(path)))
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
