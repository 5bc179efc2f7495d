"""Imitation learning: regression on simulated misalignments and on the images that the policy itself visits.

Images of many instances at poses everywhere and near the optimum are labelled with the residual to the instance's optimum,
along the eigenvectors of the image's derivative (directions.py). A strided network without pooling learns them, and how wrong
it is. From a fraction of the passes on, a part of the images are those that the policy observes while it aligns instances
(DAgger: Ross, Gordon and Bagnell 2011). Every pass renders images of its own, so that no noise is learnt by heart.
"""

from __future__ import annotations

import functools
import hashlib
import pathlib
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from .._native import chosen_threads
from . import policy
from .devices import check_device
from .directions import Directions
from .doubt import Doubt
from .evaluation import belief_policy, rmse_after_steps
from .folder import RunFolder
from .instances import InstanceSet, OptimumModel, joined
from .logs import check_loggers, opened
from .nets import StridedNet
from .passes import PassTraining

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from .._typing import Float32Array, Float64Array
    from .logs import Loggers

    Data = tuple[Any, Float32Array]
    """Images as bytes, an array or a tensor of shape (n, height, width), and residuals to the optimum in shares of the travel,
    shape (n, axes)."""


@dataclass
class Recipe:
    """Settings of a run; recipe.json has them under these names, and python/README.md documents them."""

    scene: str = "relign_od"
    size: int = 100  # columns of the images
    levels: tuple[float, ...] = (0.0, 0.125, 0.25, 0.375, 0.5)
    randomise: str = ""  # SHA-256 of the file of imaging errors; "": none
    lenses: int = 1200  # instances of a pass
    pictures: int = 30  # images of each
    near: float = 0.6  # share of poses near the optimum; the others are uniform
    passes: int = 40
    visited: float = 0.5  # share of the instances that the policy aligns, after the first quarter of the passes
    moves: int = 14  # of an instance that the policy aligns; at least 3
    batch: int = 128
    rate: float = 1e-3
    last_rate: float = 1e-5
    precision: str = "float32"  # of the convolutions: or "bfloat16"
    optimum_samples: int = 384
    seed: int = 0


SLOTS = 20  # instances of each level that are held at once
PRECISIONS = {"float32": torch.float32, "bfloat16": torch.bfloat16}
LEAST_MOVES = 3  # calibration needs two answers about an instance, from its later half
DOUBT_WEIGHT = 0.1  # of the likelihood in the loss


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


def drawn_data(instances: InstanceSet, optima: Float64Array, pictures: int, near: float, directions: Directions,
               random: np.random.Generator) -> Data:
    """Captures of the mounted instances at poses everywhere and near the optima, labelled."""
    images, residuals = [], []
    for _ in range(pictures):
        is_near = random.uniform(size=instances.count) < near
        poses = np.where(is_near[:, None], near_poses(optima, directions, random), random.uniform(size=optima.shape))
        poses = np.clip(poses, 0, 1)
        images.append(instances.frames_at(poses, random.integers(2**63, size=instances.count)))
        residuals.append(optima - poses)
    return joined(images), np.concatenate(residuals).astype(np.float32)


def visited_data(instances: InstanceSet, optima: Float64Array, net: StridedNet, moves: int) -> Data:
    """Captures that the policy observes while it aligns the mounted instances, labelled (DAgger)."""
    images, residuals = [], []
    for step in range(1, moves + 1):
        frames = instances.frames()
        images.append(frames)
        residuals.append(optima - instances.true_poses())
        instances.move_by(policy.moves(predictions(net, frames)[0], step))
    return joined(images), np.concatenate(residuals).astype(np.float32)


def predictions(net: StridedNet, images: Any) -> tuple[Float64Array, Float64Array]:
    """Residuals that the network predicts for images, an array or a tensor of shape (n, height, width), and its doubt.

    Returns:
        Residuals in shares of the travel, shape (n, axes), and standard deviations along the directions, shape (n, axes).
    """
    with torch.no_grad():
        parts = [torch.as_tensor(images[k:k + 256], device=net.vectors.device) for k in range(0, len(images), 256)]
        answers = torch.cat([net(part[:, None]) for part in parts])
    values: Float64Array = answers.double().cpu().numpy()
    return values[:, :net.axes], np.exp(values[:, net.axes:])


def loss_of(along: torch.Tensor, residuals: torch.Tensor, stiff: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Huber loss of the residuals along the directions, relative to their size, and the likelihood of the doubt.

    The likelihood trains the standard deviations only: its errors are constants, so that it cannot trade accuracy for doubt.

    Args:
        along: Output along the directions: residuals, then log standard deviations; shape (batch, 2 * axes).
        residuals: True residuals along the directions, shape (batch, axes).
        stiff: Number of stiff directions.
    """
    axes = residuals.shape[1]
    error, log_std = along[:, :axes] - residuals, along[:, axes:]
    least = torch.full((axes,), 0.02, device=along.device)
    least[:stiff] = 0.01
    huber = torch.nn.functional.huber_loss(error / (least + 0.15 * residuals.abs()), torch.zeros_like(error))
    likelihood = (log_std + 0.5 * (error.detach() * torch.exp(-log_std)) ** 2).mean()
    return huber, likelihood


class Training(PassTraining):
    """A run in a folder, with a checkpoint after every pass, and curve.csv. An interrupted run resumes.

    Args:
        recipe: The recipe.
        folder: Folder of the run.
        threads: Threads that render and train; None uses all cores.
        log: Gets one line about each part of the work.
        randomise: File of imaging errors (docs/formats.md) that every capture gets, or None.
        device: Torch device that trains: "cpu", or "cuda" for a GPU.
        render: Where images are rendered, "cpu" or "cuda".
        loggers: Get the learning curve (logs.py): names, or functions of a pass and its values.

    Attributes:
        net: The network.
        doubt: How the network's answers are combined; calibrated at the end of the run.
        curve: [pass, mean loss] of each pass.
        seconds: Time spent so far, over all sessions of the run.
        trained_on: As devices.trained_on returns it; empty before the first checkpoint.

    Raises:
        ValueError: The folder has a run with another recipe, or the scene does not suit.
    """

    RECIPE, DATA = Recipe, "images"
    net: StridedNet

    def __init__(self, recipe: Recipe, folder: str | os.PathLike[str], threads: int | None = None,
                 log: Callable[[str], object] = print, randomise: str | os.PathLike[str] | None = None,
                 device: str = "cpu", render: str = "cpu", loggers: Loggers = ()) -> None:
        check_device(device, render)
        check_loggers(loggers)
        self.loggers = loggers
        self.device, self.render = device, render
        errors = pathlib.Path(randomise).read_bytes() if randomise else b""
        if randomise:
            InstanceSet(recipe.scene, recipe.levels[:1], 1, recipe.size, threads=threads,
                        scene_parameters={"imaging_errors": str(pathlib.Path(randomise).resolve())}, device=render)
        recipe.randomise = hashlib.sha256(errors).hexdigest() if errors else recipe.randomise
        if recipe.precision not in PRECISIONS:
            raise ValueError(f"precision '{recipe.precision}' must be one of {', '.join(PRECISIONS)}")
        if recipe.moves < LEAST_MOVES:
            raise ValueError(f"moves {recipe.moves} must be at least {LEAST_MOVES}: the doubt is calibrated on several answers")
        self.recipe, self.threads, self.log = recipe, threads, log
        self.folder = RunFolder(folder, recipe)
        self._errors, self.imaging_errors = errors, ""
        if recipe.randomise:
            self.imaging_errors = str((self.folder / "randomisation.json").resolve())
        torch.manual_seed(recipe.seed)
        torch.set_num_threads(chosen_threads(threads))
        self.directions = Directions(recipe.scene, recipe.size)
        self.net = StridedNet(recipe.size, len(self.directions.values), self.directions.vectors, doubt=True)
        self.net.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.doubt = Doubt(self.directions.vectors, self.directions.values)
        self._optimum: OptimumModel | None = None
        self._begin()

    @property
    def optimum(self) -> OptimumModel:
        """The model of optima that the labels come from; fitted on first use."""
        if self._optimum is None:
            self._optimum = OptimumModel(self.recipe.scene, self.recipe.size, self.recipe.optimum_samples,
                                         max(self.recipe.levels), self.threads)
            self.log(f"labels: quadratic fit of {self.recipe.optimum_samples} optima, residual "
                     f"{self._optimum.residual:.4f} of the travel")
        return self._optimum

    @functools.cached_property
    def _training_instances(self) -> InstanceSet:
        return self.instances()

    def instances(self, slots: int = SLOTS, family: str = "training", errors: bool = True) -> InstanceSet:
        """Instances of the recipe's levels, imaged with its errors or ideally."""
        return InstanceSet(self.recipe.scene, self.recipe.levels, slots, self.recipe.size, family, self.threads,
                           {"imaging_errors": self.imaging_errors} if errors and self.imaging_errors else None,
                           device=self.render)

    def run(self) -> StridedNet:
        """Trains to the end; returns the network.

        Raises:
            ValueError: Another process trains in the folder.
        """
        optimizer = torch.optim.Adam(self.net.parameters(), lr=self.recipe.rate)
        done = self.load(optimizer)
        if done <= self.recipe.passes:
            _ = self.optimum  # before the folder exists: the scene may have none
            with self.folder.alone(), opened(self.loggers, self.folder, asdict(self.recipe), done, self.log) as log:
                if self._errors:
                    self.folder.keep("randomisation.json", lambda out: out.write(self._errors))
                self._train_passes(done, optimizer, log)
                self._calibrate()
                self._save(self.recipe.passes + 1, optimizer)
        return self.net

    def _data(self, number: int) -> Data:
        recipe, instances = self.recipe, self._training_instances
        random = np.random.default_rng([recipe.seed, 1, number])
        visited = recipe.visited if number >= recipe.passes / 4 else 0.0
        parts = []
        for first in range(0, recipe.lenses, instances.count):
            instances.reset(recipe.seed * 2**32 + number * 2**20 + first)
            optima = self.optimum.optima(instances.offsets())
            if first < visited * recipe.lenses:
                parts.append(visited_data(instances, optima, self.net, recipe.moves))
            else:
                parts.append(drawn_data(instances, optima, recipe.pictures, recipe.near, self.directions, random))
        return joined([part[0] for part in parts]), np.concatenate([part[1] for part in parts])

    def _pass(self, images: Any, residuals: Float32Array, optimizer: torch.optim.Optimizer, number: int) -> float:
        recipe = self.recipe
        order = np.random.default_rng([recipe.seed, 2, number]).permutation(len(images))
        batches = max(1, len(order) // recipe.batch)
        along = torch.from_numpy(residuals @ self.directions.vectors.astype(np.float32)).to(self.device)
        images, device_type = torch.as_tensor(images, device=self.device), torch.device(self.device).type
        low = recipe.precision != "float32"
        total = 0.0
        for k in range(batches):
            self._set_rate(optimizer, number + k / batches)
            chosen = torch.from_numpy(order[k * recipe.batch:(k + 1) * recipe.batch]).to(self.device)
            batch = images[chosen][:, None].contiguous(memory_format=torch.channels_last)
            with torch.autocast(device_type, PRECISIONS[recipe.precision], enabled=low):
                features = self.net.features(batch)
            huber, likelihood = loss_of(self.net.head(features.float()), along[chosen], self.directions.stiff)
            optimizer.zero_grad()
            (huber + DOUBT_WEIGHT * likelihood).backward()
            optimizer.step()
            total += huber.item()
        return total / batches

    def _calibrate(self) -> None:
        """Scales the doubt so that it is as large as the errors on tuning instances near their optima."""
        recipe, instances = self.recipe, self.instances(family="tuning")
        instances.reset(2**20)
        optima = self.optimum.optima(instances.offsets())
        errors, deviations = [], []
        for step in range(1, recipe.moves + 1):
            residuals, std = predictions(self.net, instances.frames())
            if step > min(policy.FULL_GAIN_STEPS, recipe.moves // 2):
                errors.append((residuals - (optima - instances.true_poses())) @ self.directions.vectors)
                deviations.append(std)
            instances.move_by(policy.moves(residuals, step))
        scale = self.doubt.calibrate(np.array(errors), np.array(deviations))
        with torch.no_grad():
            self.net.head.bias[self.net.axes:] += torch.from_numpy(np.log(scale)).to(self.net.head.bias)
        self.log("doubt: scaled by " + ", ".join(f"{value:.2f}" for value in scale))

    def tuning_rmse(self, per_level: int = 100, steps: int = 12) -> Float64Array:
        """Noise-free RMSE on tuning instances without imaging errors, after each step.

        Returns:
            Shape (levels, per_level, steps + 1).
        """
        recipe = self.recipe
        instances = InstanceSet(recipe.scene, recipe.levels, per_level, recipe.size, "tuning", self.threads,
                                device=self.render)
        follow = belief_policy(lambda frames: predictions(self.net, frames), self.doubt, instances)
        found = rmse_after_steps(follow, instances, 1, range(steps + 1))
        return np.stack(list(found.values()), axis=-1).reshape(len(recipe.levels), per_level, steps + 1)

    def _state(self) -> dict[str, Any]:
        return {"floor": self.doubt.floor.tolist()}

    def _restore(self, state: dict[str, Any]) -> None:
        self.doubt.floor = np.array(state["floor"])
