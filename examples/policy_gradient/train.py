"""Trains a policy by analytic policy gradient: the error of the images flows back through the simulator to the moves.

It needs no labels, rewards or critic. A policy makes a few moves; the loss is the error of the image after each of them, and
its gradient passes the images of all earlier moves (as in Wiedemann et al., arXiv 2209.13052). The same command resumes a run.

    python3 train.py --minutes 2 --seed 1 -o training/policy-gradient/1
"""

from __future__ import annotations

import argparse
import csv
import os
import pathlib
import sys
import time

import numpy as np
import torch
from torch import nn

import relign_bench
from relign_bench.conventions import BYTE_WHITES, LARGEST_MOVE
from relign_bench.differentiable import render
from relign_bench.training import export
from relign_bench.training.evaluation import evaluate, tuning_instances
from relign_bench.training.nets import StridedNet

SCENE, LEVEL = "relign_od", 0.25
SIZE = 100  # columns of the images, as presets of relign-train have
SLOTS, MOVES, RAYS = 16, 4, 2  # instances of one update, moves of each, rays per pixel: about the noise of a capture
BLOCK = 5  # the loss compares means over blocks of pixels, which hides most of that noise
CHECKS = 4  # evaluations on tuning instances in a run


class Policy(nn.Module):
    """The network of imitation learning, here from the difference from the reference image to the next move.

    Input: irradiances, shape (batch, 1, height, width). Output: moves in shares of the travel, shape (batch, axes).
    """

    def __init__(self, batch: relign_bench.Batch):
        super().__init__()
        self.register_buffer("reference", torch.from_numpy(batch.reference.copy()))
        self.unit = 255 / (BYTE_WHITES * batch.white)  # what StridedNet expects
        self.net = StridedNet(batch.reference.shape[1], batch.axes, np.eye(batch.axes))
        nn.init.zeros_(self.net.head.weight)  # begins without moves
        nn.init.zeros_(self.net.head.bias)

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """The moves."""
        return LARGEST_MOVE * torch.tanh(self.net((images - self.reference) * self.unit))


def rollout_loss(policy: Policy, batch: relign_bench.Batch, seeds: np.random.Generator,
                 moves: int = MOVES, rays: int = RAYS, block: int = BLOCK) -> torch.Tensor:
    """Mean over instances and moves of the logarithm of the squared error, from the start poses; a scalar with gradient.

    Args:
        policy: The policy.
        batch: The instances; their stages do not move.
        seeds: Draws the seeds of the rays.
        moves: Number of moves.
        rays: Rays per pixel.
        block: Side of the blocks of pixels whose means are compared.
    """
    slots = range(batch.slots)
    distortion = torch.from_numpy(np.array([batch.instance(slot)["distortion"] for slot in slots])).float()
    poses = torch.from_numpy(batch.true_poses(slots)).float()
    losses = []
    for move in range(moves + 1):
        images = render(batch, slots, poses, seeds.integers(2**62, size=batch.slots), rays)
        if move > 0:
            difference = nn.functional.avg_pool2d((images - policy.reference)[:, None] / batch.white, block)
            losses.append(torch.log((difference**2).mean(dim=(1, 2, 3)) + 1e-4))
        if move < moves:
            # Beyond the travel nothing moves, and no gradient passes.
            poses = (poses + torch.einsum("nij,nj->ni", distortion, policy(images[:, None]))).clamp(0, 1)
    return torch.stack(losses).mean()


class Training:
    """A run in a folder: checkpoint.pt and curve.csv after every check, best.pt where the score was lowest."""

    def __init__(self, folder: pathlib.Path, seed: int, minutes: float):
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        self.folder, self.seed, self.minutes = folder, seed, minutes
        self.batch = relign_bench.Batch(SLOTS, SCENE, f"rho{LEVEL}", size=SIZE, threads=1)
        self.tuning = tuning_instances(SCENE, [LEVEL], SIZE, threads=1, observation="float32")
        self.policy = Policy(self.batch)
        self.optimizer = torch.optim.Adam(self.policy.parameters(), lr=1e-3)
        self.updates, self.spent, self.rows = 0, 0.0, []
        checkpoint = folder / "checkpoint.pt"
        if checkpoint.is_file():
            state = torch.load(checkpoint, weights_only=True)
            if state["seed"] != seed or state["minutes"] != minutes:
                sys.exit(f"error: '{folder}' has a run with seed {state['seed']} and {state['minutes']} minutes; choose "
                         "another folder, or repeat these")
            self.policy.load_state_dict(state["policy"])
            self.optimizer.load_state_dict(state["optimizer"])
            self.updates, self.spent, self.rows = state["updates"], state["spent"], state["rows"]
        self.before = self.spent  # in earlier processes

    def used(self) -> float:
        """Processor minutes so far, start and evaluations included."""
        return self.before + time.process_time() / 60

    def moves(self, frames: np.ndarray, step: int, memory: None) -> tuple[np.ndarray, None]:
        """The policy as `evaluate` calls it."""
        with torch.no_grad():
            return self.policy(torch.from_numpy(frames)).double().numpy(), None

    def update(self) -> None:
        """One step of the optimizer, on new instances."""
        seeds = np.random.default_rng([self.seed, self.updates])  # so that a resumed run draws the same
        self.batch.reset(range(SLOTS), seeds.integers(2**62, size=SLOTS).tolist(), "training")
        self.optimizer.param_groups[0]["lr"] = 1e-3 * max(0.02, 1 - self.used() / self.minutes)
        self.optimizer.zero_grad()
        rollout_loss(self.policy, self.batch, seeds).backward()
        nn.utils.clip_grad_norm_(self.policy.parameters(), 1.0)
        self.optimizer.step()
        self.updates += 1

    def check(self) -> None:
        """Evaluates on tuning instances, and writes the files."""
        found = evaluate(self.moves, self.tuning, 1)
        best = all(found["score"] < row[-1] for row in self.rows)
        self.spent = self.used()
        self.rows.append([self.spent, self.updates, found["rmse_6"], found["rmse_12"], found["score"]])
        state = {"policy": self.policy.state_dict(), "optimizer": self.optimizer.state_dict(), "updates": self.updates,
                 "spent": self.spent, "rows": self.rows, "seed": self.seed, "minutes": self.minutes}
        for name in ("best.pt", "checkpoint.pt") if best else ("checkpoint.pt",):
            torch.save(state, self.folder / "half.pt")
            os.replace(self.folder / "half.pt", self.folder / name)
        with open(self.folder / "curve.csv", "w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["minutes", "updates", "rmse_6", "rmse_12", "score"])
            table.writerows([f"{row[0]:.2f}", row[1], *(f"{value:.6f}" for value in row[2:])] for row in self.rows)
        print(f"{self.spent:.2f} processor minutes, {self.updates} updates: tuning RMSE {found['rmse_6']:.4f} after 6 moves, "
              f"{found['rmse_12']:.4f} after 12", flush=True)

    def run(self) -> None:
        """Trains to the end, and exports the networks of the last and of the best check."""
        self.folder.mkdir(parents=True, exist_ok=True)
        lasted = 0.05  # of a check, in minutes: the last one shall end within the time
        while self.spent + lasted < self.minutes:
            until = min(self.spent + self.minutes / CHECKS, self.minutes - lasted)
            while self.used() < until:
                self.update()
            begun = self.used()
            self.check()
            lasted = self.used() - begun
        for name, chosen_on in (("best", "tuning"), ("last", "none")):
            state = torch.load(self.folder / ("best.pt" if name == "best" else "checkpoint.pt"), weights_only=True)
            self.policy.load_state_dict(state["policy"])
            write(self.policy, self.folder / name, state, chosen_on)


def write(policy: Policy, path: pathlib.Path, state: dict, chosen_on: str) -> None:
    """Writes PATH.onnx and its side file, for the agent `network`."""
    trained = {"recipe": {"seed": state["seed"], "minutes": state["minutes"], "updates": state["updates"]},
               "hours": round(state["spent"] / 60, 3), "steps": state["updates"] * SLOTS * MOVES,
               "machine": "one processor core"}
    _, side = export.write(policy, path, SCENE, SIZE, 1, "move", trained,
                           f"python3 examples/policy_gradient/train.py --minutes {state['minutes']:g} --seed {state['seed']}",
                           values="irradiance", chosen_on=chosen_on)
    side.write_text(side.read_text().replace("{", '{\n "use": "network",', 1))  # its path is then a method


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=2.0, help="processor time of the run [default: %(default)s]")
    parser.add_argument("--seed", type=int, default=1, help="seed of weights, instances and rays [default: %(default)s]")
    parser.add_argument("-o", "--out", type=pathlib.Path, default="training", help="folder of the run [default: %(default)s]")
    given = parser.parse_args()
    Training(given.out, given.seed, given.minutes).run()


if __name__ == "__main__":
    main()
