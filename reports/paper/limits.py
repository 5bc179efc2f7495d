"""What separates trainings of the paper's recipe from the optimum, on tuning instances that chose no network:

    PYTHONPATH=build/release/python python3 reports/paper/limits.py NETWORK.onnx... > reports/paper/trainings/limits.csv

A network makes fifty moves on each of 48 instances of its own noise level, without exploration: in full, as trained, and
then from the fifth on scaled by 4 / move, so that they settle where the mean move is zero. (Of 4, 8 and 16, four was best
for two networks on other tuning instances.) Images and errors are of 200 x 200 pixels, as in training and in the study;
only what the network observes is binned. A row has:

    rmse              noise-free RMSE at the last pose, the median with a bootstrap interval of 95 %
    change            that of shrinking moves divided by that of full ones, the median over the instances, likewise
    corrected         rmse without the mean offset from the own optima, as estimated on the other half of the instances
    in_spec_10, ...   share of the instances in the specification at the pose after 10, 20 and 50 images
    distance          median distance of the last pose from the nominal one; of the own optimum, `optimum_distance`
    goal              share of the instances on which one of the fifty moves ends at the goal of training
    x, ..., Ry        median of the last pose along each axis, in shares of the travel; 0.5 is nominal

Moves that do not shrink amplify differences of the last digit: on another kind of processor `seed-0` has 0.0213 instead of
0.0196 after full moves, 0.0145 as before after shrinking ones. limits.csv and ablation_limits.csv lack the axes.

Needs numpy and onnxruntime. About a minute of one core for a network.
"""

import csv
import json
import pathlib
import sys

import numpy as np
import onnxruntime
from specification import SPECIFICATION

from relign_bench._stacks import Stacks
from relign_bench.batch import Batch
from relign_bench.conventions import LARGEST_MOVE
from relign_bench.rewards import scores

INSTANCES, FULL = 48, 4
IMAGES = (10, 20, 50)
FIRST_NUMBER = 10_000  # networks were chosen on those from 0, FULL on those from 20,000
GAINS = {"full": lambda move: 1.0, "shrinking": lambda move: min(1.0, FULL / move)}
AXES = ("x", "y", "z", "Rx", "Ry")
COLUMNS = ("training", "noise_level", "moves", "rmse", "rmse_lo95", "rmse_hi95", "change", "change_lo95", "change_hi95",
           "corrected", *(f"in_spec_{images}" for images in IMAGES), "distance", "optimum_distance", "goal", *AXES)


def median(values):
    draws = np.random.default_rng(1).integers(0, len(values), (10_000, len(values)))
    return [float(np.median(values)), *np.quantile(np.median(values[draws], axis=1), (0.025, 0.975))]


class Policy:
    """The moves of a network, from captures of shape (n, height, width)."""

    def __init__(self, path, observation):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(path, options)
        self.input = self.session.get_inputs()[0].name
        white = None if observation.get("values") == "irradiance" else observation["white"]
        self.stacks = Stacks(INSTANCES, (observation["frames"], observation["size"], observation["size"]),
                             observation["captured"][0] // observation["size"], white, np.inf)

    def moves(self, captures):
        self.stacks.push(range(INSTANCES), captures)
        stacks = self.stacks.all().astype(np.float32)
        answers = [self.session.run(None, {self.input: stack[None]})[0] for stack in stacks]
        return np.clip(np.concatenate(answers).astype(np.float64), -LARGEST_MOVE, LARGEST_MOVE)


def rows(path):
    about = json.loads(path.with_suffix(".json").read_text())
    recipe, every = about["trained"]["recipe"], list(range(INSTANCES))
    batch = Batch(INSTANCES, recipe["scene"], "rho", noise_level_parameters={"level": recipe["level"]})
    nominal, full = batch.nominal_pose, None
    assert [axis["name"] for axis in batch.description["axes"]] == list(AXES)

    def errors_at(poses, step):
        return np.sqrt(np.maximum(0, batch.noise_free_mse_at(every, poses, [step] * INSTANCES)[0]))

    for name, gain in GAINS.items():
        batch.reset(every, [FIRST_NUMBER + slot for slot in every], "tuning")
        optima = np.array([pose for pose, _ in batch.optima(every)])
        policy, errors, reached = Policy(path, about["observation"]), {}, np.zeros(INSTANCES, bool)
        for move in range(1, IMAGES[-1] + 1):
            batch.move_by(every, gain(move) * policy.moves(np.asarray(batch.frames)))
            poses = batch.true_poses(every)
            reached |= scores("combined", batch.measured_error(every), poses, nominal, None, None) < recipe["goal"]
            if move in IMAGES:
                errors[move] = errors_at(poses, move)
        assert batch.instance(0)["number"] == FIRST_NUMBER
        half = INSTANCES // 2
        offsets = (poses - optima).reshape(2, half, -1).mean(axis=1)[::-1].repeat(half, axis=0)
        corrected = np.median(errors_at(np.clip(poses - offsets, 0, 1), IMAGES[-1]))
        last = errors[IMAGES[-1]]
        full = last if full is None else full
        distance, optimum = (np.median(np.linalg.norm(at - nominal, axis=1)) for at in (poses, optima))
        yield (path.stem, f"rho{recipe['level']:g}", name,
               *(f"{value:.6g}" for value in (*median(last), *median(last / full), corrected,
                                              *((error <= SPECIFICATION).mean() for error in errors.values()),
                                              distance, optimum, reached.mean(), *np.median(poses, axis=0))))


def main(paths):
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(COLUMNS)
    for path in paths:
        table.writerows(rows(pathlib.Path(path)))
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
