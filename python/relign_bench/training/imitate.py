"""Imitation learning: regression on simulated misalignments, then DAgger.

Images of many instances at poses everywhere and near the optimum are labelled with the residual to the instance's own optimum,
along the eigenvectors of the image's derivative (directions.py). A strided network without pooling learns them. Then the policy
aligns further instances, and what it observes is labelled and added to the data (DAgger: Ross, Gordon and Bagnell 2011).
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from . import policy
from .directions import Directions
from .evaluation import rmse_after_steps
from .folder import RunFolder
from .instances import InstanceSet, OptimumModel
from .nets import StridedNet

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from .._typing import ByteArray, Float32Array, Float64Array

    Data = tuple[ByteArray, Float32Array]
    """Images as bytes, shape (n, height, width), and residuals to the optimum in shares of the travel, shape (n, axes)."""


@dataclass
class Recipe:
    """Settings of a run; recipe.json has them under these names, and python/README.md documents them."""

    scene: str = "relign_od"
    size: int = 100  # columns of the images
    levels: tuple[float, ...] = (0.0, 0.125, 0.25, 0.375, 0.5)
    lenses: int = 1600  # instances of the initial data
    pictures: int = 30  # images of each
    near: float = 0.6  # share of poses near the optimum; the others are uniform
    passes: int = 5  # epochs over the initial data
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


SLOTS = 20  # instances of each level that are held at once


def near_poses(optima: Float64Array, directions: Directions, random: np.random.Generator) -> Float64Array:
    """Poses around the optima, with log-uniform distances: 0.004 to 0.4 along stiff directions, 0.01 to 0.3 along the others.

    Args:
        optima: Shape (n, axes).
        directions: The directions.
        random: The generator.

    Returns:
        Shape (n, axes); a pose may leave the travel.
    """
    count, axes = optima.shape
    stiff = np.arange(axes) < directions.stiff
    low, high = np.where(stiff, 0.004, 0.01), np.where(stiff, 0.4, 0.3)
    # One size per pose and group of directions, so that small errors of all directions occur together.
    groups = random.uniform(size=(count, 2))[:, np.where(stiff, 0, 1)]
    sizes = low * (high / low) ** groups
    return optima + (random.normal(size=(count, axes)) * sizes) @ directions.vectors.T


def initial_data(recipe: Recipe, optimum: OptimumModel, directions: Directions, threads: int | None) -> Data:
    """Images at poses everywhere and near the optimum, labelled."""
    instances = InstanceSet(recipe.scene, recipe.levels, SLOTS, recipe.size, threads=threads)
    random = np.random.default_rng([recipe.seed, 1])
    images, residuals = [], []
    for first in range(0, recipe.lenses, instances.count):
        instances.reset(recipe.seed * 2**24 + first)
        optima = optimum.optima(instances.offsets())
        for _ in range(recipe.pictures):
            near = random.uniform(size=instances.count) < recipe.near
            poses = np.where(near[:, None], near_poses(optima, directions, random),
                             random.uniform(size=optima.shape))
            poses = np.clip(poses, 0, 1)
            images.append(instances.frames_at(poses, random.integers(2**63, size=instances.count)))
            residuals.append(optima - poses)
    return np.concatenate(images), np.concatenate(residuals).astype(np.float32)


def dagger_data(recipe: Recipe, net: StridedNet, optimum: OptimumModel, number: int, threads: int | None) -> Data:
    """Images that the policy observes while it aligns instances, labelled: round `number` of DAgger, from 1."""
    instances = InstanceSet(recipe.scene, recipe.levels, SLOTS, recipe.size, threads=threads)
    images, residuals = [], []
    for first in range(0, recipe.round_lenses, instances.count):
        instances.reset(recipe.seed * 2**24 + 2**23 + number * 2**20 + first)
        optima = optimum.optima(instances.offsets())
        for step in range(1, recipe.round_moves + 1):
            frames = instances.frames()
            images.append(frames)
            residuals.append(optima - instances.true_poses())
            instances.move_by(policy.moves(predictions(net, frames), step))
    return np.concatenate(images), np.concatenate(residuals).astype(np.float32)


def predictions(net: StridedNet, images: ByteArray) -> Float64Array:
    """Residuals that the network predicts for images of shape (n, height, width), shape (n, axes)."""
    with torch.no_grad():
        return net(torch.from_numpy(images[:, None])).double().numpy()


def loss_of(net: StridedNet, images: torch.Tensor, residuals: torch.Tensor, stiff: int) -> torch.Tensor:
    """Huber loss of the residuals along the directions.

    Errors along stiff directions are relative to the residual's size, those along the others are in tenths of the travel.

    Args:
        net: The network.
        images: Bytes, shape (batch, 1, height, width).
        residuals: Residuals along the directions, shape (batch, axes).
        stiff: Number of stiff directions.
    """
    error = net.along(images) - residuals
    scale = 0.01 + 0.15 * residuals[:, :stiff].abs()
    huber = torch.nn.functional.huber_loss
    zero = torch.zeros_like(error)
    return (huber(error[:, :stiff] / scale, zero[:, :stiff]) + huber(error[:, stiff:] / 0.1, zero[:, stiff:]))


def tuning_rmse(recipe: Recipe, net: StridedNet, threads: int | None, per_level: int = 100, steps: int = 12,
                ) -> Float64Array:
    """Noise-free RMSE on tuning instances after each step, shape (levels, per_level, steps + 1)."""
    instances = InstanceSet(recipe.scene, recipe.levels, per_level, recipe.size, family="tuning", threads=threads)

    def moves(frames: ByteArray, step: int, memory: Any) -> tuple[Float64Array, Any]:
        return policy.moves(predictions(net, frames[:, -1]), step), memory

    found = rmse_after_steps(moves, instances, 1, range(steps + 1))
    return np.stack(list(found.values()), axis=-1).reshape(len(recipe.levels), per_level, steps + 1)


class Training:
    """A run in a folder: data, a checkpoint after every epoch, and curve.csv. An interrupted run resumes.

    Args:
        recipe: The recipe.
        folder: Folder of the run.
        threads: Threads that render and train; None uses all cores.
        log: Gets one line about each part of the work.

    Attributes:
        net: The network.
        curve: [round, epoch, mean loss] of each epoch.
        seconds: Time spent so far, over all sessions of the run.

    Raises:
        ValueError: The folder has a run with another recipe, or the scene does not suit.
    """

    def __init__(self, recipe: Recipe, folder: str | os.PathLike[str], threads: int | None = None,
                 log: Callable[[str], object] = print) -> None:
        self.recipe, self.threads, self.log = recipe, threads, log
        self.folder = RunFolder(folder, recipe)
        torch.manual_seed(recipe.seed)
        if threads:
            torch.set_num_threads(threads)
        self.directions = Directions(recipe.scene, recipe.size)
        self.net = StridedNet(recipe.size, len(self.directions.values), self.directions.vectors)
        self._optimum: OptimumModel | None = None
        self.curve: list[list[Any]] = []
        self.seconds = 0.0

    @property
    def optimum(self) -> OptimumModel:
        """The model of own optima that the labels come from; fitted on first use."""
        if self._optimum is None:
            self._optimum = OptimumModel(self.recipe.scene, self.recipe.size, self.recipe.optimum_samples,
                                         max(self.recipe.levels), self.threads)
            self.log(f"labels: quadratic fit of {self.recipe.optimum_samples} own optima, residual "
                     f"{self._optimum.residual:.4f} of the travel")
        return self._optimum

    # ---- files ---------------------------------------------------------------------------------

    def _data(self, number: int) -> Data:
        path = self.folder / f"data-{number}.npz"
        if not path.is_file():
            begun = time.monotonic()
            made = (initial_data(self.recipe, self.optimum, self.directions, self.threads) if number == 0 else
                    dagger_data(self.recipe, self.net, self.optimum, number, self.threads))
            self.folder.keep(path.name, lambda out: np.savez(out, pictures=made[0], ways=made[1]))
            self.seconds += time.monotonic() - begun
            self.log(f"data {number}: {len(made[0])} images in {time.monotonic() - begun:.0f} s")
        kept = np.load(path)
        return kept["pictures"], kept["ways"]

    def run(self) -> StridedNet:
        """Trains to the end; returns the network."""
        passes = [self.recipe.passes] + [self.recipe.round_passes] * self.recipe.rounds
        state = self.load()
        for number, count in enumerate(passes):
            if number < state["number"]:
                continue
            parts = [self._data(k) for k in range(number + 1)]
            images = np.concatenate([part[0] for part in parts])
            residuals = np.concatenate([part[1] for part in parts])
            rate = self.recipe.rate if number == 0 else self.recipe.round_rate
            optimizer = torch.optim.Adam(self.net.parameters(), lr=rate)
            if state["number"] == number and state["optimizer"] is not None:
                optimizer.load_state_dict(state["optimizer"])
            for done in range(state["passes"] if state["number"] == number else 0, count):
                self._pass(images, residuals, optimizer, rate, number, done, count)
                self._save(number, done + 1, optimizer)
            self._save(number + 1, 0, None)
            state = {"number": number + 1, "passes": 0, "optimizer": None}
        return self.net

    def _pass(self, images: ByteArray, residuals: Float32Array, optimizer: torch.optim.Optimizer, rate: float, number: int,
              done: int, count: int) -> None:
        """One epoch: pass `done` + 1 of `count` in round `number`."""
        begun = time.monotonic()
        order = np.random.default_rng([self.recipe.seed, 2, number, done]).permutation(len(images))
        batches = len(order) // self.recipe.batch
        along = residuals @ self.directions.vectors.astype(np.float32)
        total = 0.0
        for k in range(batches):
            share = (done * batches + k) / (count * batches)
            for group in optimizer.param_groups:  # cosine decay from the first rate to the last
                group["lr"] = self.recipe.last_rate + (rate - self.recipe.last_rate) * 0.5 * (1 + math.cos(math.pi * share))
            chosen = order[k * self.recipe.batch:(k + 1) * self.recipe.batch]
            loss = loss_of(self.net, torch.from_numpy(images[chosen][:, None]), torch.from_numpy(along[chosen]),
                           self.directions.stiff)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            total += loss.item()
        seconds = time.monotonic() - begun
        self.log(f"round {number}, pass {done + 1} of {count}: loss {total / max(1, batches):.4f}, "
                 f"{len(order) / seconds:.0f} images/s")
        self.curve.append([number, done + 1, total / max(1, batches)])
        self.seconds += time.monotonic() - begun

    def _save(self, number: int, passes: int, optimizer: torch.optim.Optimizer | None) -> None:
        # The curve is kept with the weights, so that a resumed run does not write a line twice.
        state = {"net": self.net.state_dict(), "number": number, "passes": passes, "curve": self.curve,
                 "seconds": self.seconds, "optimizer": optimizer.state_dict() if optimizer else None}
        self.folder.keep("checkpoint.pt", lambda out: torch.save(state, out))
        lines = "".join(f"{row[0]},{row[1]},{row[2]:.6f}\n" for row in self.curve)
        self.folder.keep_text("curve.csv", "round,pass,loss\n" + lines)

    def load(self) -> dict[str, Any]:
        """Loads the checkpoint, if there is one.

        Returns:
            Where to resume: number (round), passes (that are done in it) and optimizer (its state, or None).
        """
        path = self.folder / "checkpoint.pt"
        if not path.is_file():
            return {"number": 0, "passes": 0, "optimizer": None}
        state: dict[str, Any] = torch.load(path, weights_only=True)
        self.net.load_state_dict(state["net"])
        self.curve, self.seconds = state["curve"], state["seconds"]
        self.log(f"resuming in round {state['number']}, after pass {state['passes']}")
        return state
