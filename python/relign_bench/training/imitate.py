"""Regression on simulated misalignments with each lens's own optimum as label, then rounds on what the policy meets.

The recipe: pictures of many lenses at poses everywhere and near the optimum; the label is the way to that lens's own
optimum, along the eigen-directions of the picture's derivative; a strided network without pooling. Then DAgger (Ross,
Gordon and Bagnell 2011): the policy aligns lenses, what it saw is labelled and learnt with all the rest.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
import torch

from . import policy
from .directions import Directions
from .evaluation import rmse_on_the_way
from .folder import RunFolder
from .lenses import Lenses, OptimumModel
from .nets import StridedNet


@dataclass
class Recipe:
    scene: str = "relign_od"
    size: int = 100
    levels: tuple = (0.0, 0.125, 0.25, 0.375, 0.5)
    lenses: int = 1600  # to begin with
    pictures: int = 30  # a lens
    near: float = 0.6  # share of poses near the optimum; the others are everywhere
    passes: int = 5
    rounds: int = 2  # of DAgger
    round_lenses: int = 500
    round_moves: int = 14
    round_passes: int = 4
    batch: int = 128
    rate: float = 1e-3
    round_rate: float = 5e-4
    last_rate: float = 3e-5
    optimum_samples: int = 384
    seed: int = 0


SLOTS = 20  # lenses held at once, per level


def near_poses(optima, directions, random):
    """Around the optimum, spread logarithmically: along stiff directions 0.004 to 0.4, along the others 0.01 to 0.3."""
    count, axes = optima.shape
    stiff = np.arange(axes) < directions.stiff
    low, high = np.where(stiff, 0.004, 0.01), np.where(stiff, 0.4, 0.3)
    # One size per group and pose, so that small errors of all directions come together.
    groups = random.uniform(size=(count, 2))[:, np.where(stiff, 0, 1)]
    sizes = low * (high / low) ** groups
    return optima + (random.normal(size=(count, axes)) * sizes) @ directions.vectors.T


def first_pictures(recipe, optimum, directions, threads):
    """Bytes (n, height, width), ways to the optimum (n, axes)."""
    lenses = Lenses(recipe.scene, recipe.levels, SLOTS, recipe.size, threads=threads)
    random = np.random.default_rng([recipe.seed, 1])
    pictures, ways = [], []
    for first in range(0, recipe.lenses, lenses.count):
        lenses.reset(recipe.seed * 2**24 + first)
        optima = optimum.optima(lenses.offsets())
        for _ in range(recipe.pictures):
            near = random.uniform(size=lenses.count) < recipe.near
            poses = np.where(near[:, None], near_poses(optima, directions, random),
                             random.uniform(size=optima.shape))
            poses = np.clip(poses, 0, 1)
            pictures.append(lenses.frames_at(poses, random.integers(2**63, size=lenses.count)))
            ways.append(optima - poses)
    return np.concatenate(pictures), np.concatenate(ways).astype(np.float32)


def followed_pictures(recipe, net, optimum, number, threads):
    """What the policy sees when it aligns lenses: bytes and ways to the optimum."""
    lenses = Lenses(recipe.scene, recipe.levels, SLOTS, recipe.size, threads=threads)
    pictures, ways = [], []
    for first in range(0, recipe.round_lenses, lenses.count):
        lenses.reset(recipe.seed * 2**24 + 2**23 + number * 2**20 + first)
        optima = optimum.optima(lenses.offsets())
        for step in range(1, recipe.round_moves + 1):
            seen = lenses.frames()
            pictures.append(seen)
            ways.append(optima - lenses.true_poses())
            lenses.move_by(policy.moves(guesses(net, seen), step))
    return np.concatenate(pictures), np.concatenate(ways).astype(np.float32)


def guesses(net, pictures):
    """Moves to the optimum as the network sees it, (n, axes) float64."""
    with torch.no_grad():
        return net(torch.from_numpy(pictures[:, None])).double().numpy()


def loss_of(net, pictures, ways, stiff):
    """Huber of the stiff errors, relative to their size, and of the others in tenths of the travel."""
    error = net.along(pictures) - ways
    scale = 0.01 + 0.15 * ways[:, :stiff].abs()
    huber = torch.nn.functional.huber_loss
    zero = torch.zeros_like(error)
    return (huber(error[:, :stiff] / scale, zero[:, :stiff]) + huber(error[:, stiff:] / 0.1, zero[:, stiff:]))


def tuning_rmse(recipe, net, threads, lenses_a_level=100, steps=12):
    """Noise-free RMSE after each step, shape (levels, lenses, steps + 1), of lenses that training never saw."""
    lenses = Lenses(recipe.scene, recipe.levels, lenses_a_level, recipe.size, instances="tuning", threads=threads)

    def moves(frames, step, memory):
        return policy.moves(guesses(net, frames[:, -1]), step), memory

    found = rmse_on_the_way(moves, lenses, 1, range(steps + 1))
    return np.stack(list(found.values()), axis=-1).reshape(len(recipe.levels), lenses_a_level, steps + 1)


class Training:
    """One run in a folder: data, checkpoint after every pass, curve.csv. Goes on where it was stopped or killed."""

    def __init__(self, recipe, folder, threads=None, tell=print):
        self.recipe, self.threads, self.tell = recipe, threads, tell
        self.folder = RunFolder(folder, recipe)
        torch.manual_seed(recipe.seed)
        if threads:
            torch.set_num_threads(threads)
        self.directions = Directions(recipe.scene, recipe.size)
        self.net = StridedNet(recipe.size, len(self.directions.values), self.directions.vectors)
        self._optimum = None
        self.curve, self.seconds = [], 0.0  # loss after every pass; time spent, over all stretches

    @property
    def optimum(self):
        if self._optimum is None:
            self._optimum = OptimumModel(self.recipe.scene, self.recipe.size, self.recipe.optimum_samples,
                                         max(self.recipe.levels), self.threads)
            self.tell(f"labels: own optima of {self.recipe.optimum_samples} lenses, a quadratic to "
                      f"{self._optimum.residual:.4f} of the travel")
        return self._optimum

    # ---- what is kept --------------------------------------------------------------------------

    def _data(self, number):
        path = self.folder / f"data-{number}.npz"
        if not path.is_file():
            begun = time.monotonic()
            made = (first_pictures(self.recipe, self.optimum, self.directions, self.threads) if number == 0 else
                    followed_pictures(self.recipe, self.net, self.optimum, number, self.threads))
            self.folder.keep(path.name, lambda out: np.savez(out, pictures=made[0], ways=made[1]))
            self.seconds += time.monotonic() - begun
            self.tell(f"data {number}: {len(made[0])} pictures in {time.monotonic() - begun:.0f} s")
        kept = np.load(path)
        return kept["pictures"], kept["ways"]

    def run(self):
        """Trains to the end; returns the network."""
        passes = [self.recipe.passes] + [self.recipe.round_passes] * self.recipe.rounds
        state = self.load()
        pictures, ways = None, None
        for number, count in enumerate(passes):
            if number < state["number"]:
                continue
            parts = [self._data(k) for k in range(number + 1)]
            pictures, ways = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
            rate = self.recipe.rate if number == 0 else self.recipe.round_rate
            optimizer = torch.optim.Adam(self.net.parameters(), lr=rate)
            if state["number"] == number and state["optimizer"] is not None:
                optimizer.load_state_dict(state["optimizer"])
            for done in range(state["passes"] if state["number"] == number else 0, count):
                self._pass(pictures, ways, optimizer, rate, number, done, count)
                self._save(number, done + 1, optimizer)
            self._save(number + 1, 0, None)
            state = {"number": number + 1, "passes": 0, "optimizer": None}
        return self.net

    def _pass(self, pictures, ways, optimizer, rate, number, done, count):
        begun = time.monotonic()
        order = np.random.default_rng([self.recipe.seed, 2, number, done]).permutation(len(pictures))
        batches = len(order) // self.recipe.batch
        along = ways @ self.directions.vectors.astype(np.float32)
        total = 0.0
        for k in range(batches):
            share = (done * batches + k) / (count * batches)
            for group in optimizer.param_groups:  # a cosine from the first rate to the last
                group["lr"] = self.recipe.last_rate + (rate - self.recipe.last_rate) * 0.5 * (1 + math.cos(math.pi * share))
            chosen = order[k * self.recipe.batch:(k + 1) * self.recipe.batch]
            loss = loss_of(self.net, torch.from_numpy(pictures[chosen][:, None]), torch.from_numpy(along[chosen]),
                           self.directions.stiff)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            total += loss.item()
        seconds = time.monotonic() - begun
        self.tell(f"round {number}, pass {done + 1} of {count}: loss {total / max(1, batches):.4f}, "
                  f"{len(order) / seconds:.0f} pictures/s")
        self.curve.append([number, done + 1, total / max(1, batches)])
        self.seconds += time.monotonic() - begun

    def _save(self, number, passes, optimizer):
        # The curve is kept with the weights, so that a run that was killed writes no line twice.
        state = {"net": self.net.state_dict(), "number": number, "passes": passes, "curve": self.curve,
                 "seconds": self.seconds, "optimizer": optimizer.state_dict() if optimizer else None}
        self.folder.keep("checkpoint.pt", lambda out: torch.save(state, out))
        lines = "".join(f"{row[0]},{row[1]},{row[2]:.6f}\n" for row in self.curve)
        self.folder.keep_text("curve.csv", "round,pass,loss\n" + lines)

    def load(self):
        """What the last whole pass left; where to go on."""
        path = self.folder / "checkpoint.pt"
        if not path.is_file():
            return {"number": 0, "passes": 0, "optimizer": None}
        state = torch.load(path, weights_only=True)
        self.net.load_state_dict(state["net"])
        self.curve, self.seconds = state["curve"], state["seconds"]
        self.tell(f"goes on at round {state['number']}, after pass {state['passes']}")
        return state
