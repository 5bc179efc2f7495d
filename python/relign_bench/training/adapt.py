"""Adaptation of a trained policy to a station, from captures at unknown poses.

The network continues to learn from labelled simulated images, and at the same time to give its features the same mean and
standard deviation on the station's captures as on simulated ones at poses over the whole travel (moment matching, the diagonal
form of CORAL: Sun and Saenko, "Deep CORAL", 2016). The station's captures need no labels, but poses spread over the travel.
"""

from __future__ import annotations

import hashlib
import pathlib
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from ..conventions import to_bytes
from .folder import RunFolder
from .imitate import DOUBT_WEIGHT, PRECISIONS, Training, drawn_data, loss_of

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from .._typing import ByteArray


@dataclass
class Recipe:
    """Settings of an adaptation; recipe.json has them under these names, and python/README.md documents them."""

    trained: str = ""  # SHA-256 of the checkpoint of the run that is adapted
    images: str = ""  # SHA-256 of the captures
    captures: int = 0  # their number
    steps: int = 400  # of the optimiser
    rate: float = 1e-4
    weight: float = 0.3  # of the features' moments in the loss
    batch: int = 128
    seed: int = 0


def read_captures(folder: str | os.PathLike[str], white: float | None, size: int, scene_white: float) -> ByteArray:
    """The captures of a folder, as bytes of shape (n, size, size), in order of their names.

    Args:
        folder: Files .npy (one capture or a stack, in the scene's units) or .png (grey).
        white: Grey value of a white pixel in .png files, 0 to 1; None if there are none.
        size: Columns of the network's images; captures are binned to it.
        scene_white: Value of a white pixel in the scene's units.

    Raises:
        ValueError: There are no captures, or one is not square, cannot be binned, or has values that are not finite.
    """
    files = sorted(path for path in pathlib.Path(folder).iterdir() if path.suffix in (".npy", ".png"))
    found = []
    for path in files:
        if path.suffix == ".png":
            if white is None:
                raise ValueError(f"'{path}': --white must say which grey value, 0 to 1, a white pixel has in .png files")
            from matplotlib.image import imread

            values = np.asarray(imread(path), np.float32)
            values = (values if values.ndim == 2 else values[..., :3].mean(axis=-1)) * np.float32(scene_white / white)
        else:
            values = np.asarray(np.load(path, allow_pickle=False), np.float32)
        stack = values[None] if values.ndim == 2 else values
        if stack.ndim != 3 or stack.shape[1] != stack.shape[2] or stack.shape[1] % size:
            raise ValueError(f"'{path}': shape {values.shape} must be square captures, binnable to {size} x {size} pixels")
        if not np.isfinite(stack).all():
            raise ValueError(f"'{path}': values must be finite")
        bins = stack.shape[1] // size
        found.append(stack.reshape(len(stack), size, bins, size, bins).mean(axis=(2, 4)))
    if not found:
        raise ValueError(f"'{folder}' has no captures; expected .npy or .png files")
    return to_bytes(np.concatenate(found), scene_white)


def moments_loss(simulated: torch.Tensor, captured: torch.Tensor) -> torch.Tensor:
    """Squared differences of mean and standard deviation of each feature, in units of its spread; shapes (n, features)."""
    mean, std = simulated.mean(dim=0), simulated.std(dim=0)
    spread = std.detach() + 0.05 * std.detach().mean() + 1e-6
    return (((captured.mean(dim=0) - mean) / spread) ** 2 + ((captured.std(dim=0) - std) / spread) ** 2).mean()


class Adaptation:
    """Adapts the network of a run of `relign-train imitate`; the result is a run that can be exported.

    Args:
        trained: Folder of the run.
        captures: The station's captures, as bytes of shape (n, size, size); see `read_captures`.
        folder: Folder of the adapted run.
        settings: The recipe; its hashes and number of captures are filled in.
        threads: Threads that render and train; None uses all cores.
        log: Gets one line about each part of the work.

    Attributes:
        training: The adapted run.

    Raises:
        ValueError: A folder is not that of a suitable run, or there are fewer than two captures.
    """

    def __init__(self, trained: str | os.PathLike[str], captures: ByteArray, folder: str | os.PathLike[str],
                 settings: Recipe, threads: int | None = None, log: Callable[[str], object] = print) -> None:
        if len(captures) < 2:
            raise ValueError(f"found {len(captures)} capture; moments need at least two")
        source = pathlib.Path(trained)
        settings.trained = hashlib.sha256((source / "checkpoint.pt").read_bytes()).hexdigest()
        settings.images, settings.captures = hashlib.sha256(captures.tobytes()).hexdigest(), len(captures)
        self.settings, self.captures, self.log = settings, captures, log
        self.out = RunFolder(pathlib.Path(folder), settings)
        self.training = Training.open(source, threads, log)

    def run(self) -> Training:
        """Adapts the network; returns the run with it."""
        settings, training, recipe = self.settings, self.training, self.training.recipe
        begun = time.monotonic()
        random = np.random.default_rng([settings.seed, 3])
        torch.manual_seed(settings.seed)
        instances = training.instances()
        optimizer = torch.optim.Adam(training.net.parameters(), lr=settings.rate)
        vectors = training.directions.vectors.astype(np.float32)
        captured = torch.from_numpy(self.captures[:, None])
        rows: list[tuple[int, float, float]] = []
        per_step = settings.batch // 2  # images near the optima, and as many anywhere
        rendered = 10 * instances.count
        for step in range(settings.steps):
            if step % max(1, rendered // per_step) == 0:
                instances.reset(recipe.seed * 2**32 + 2**31 + step * instances.count)
                optima = training.optimum.optima(instances.offsets())
                near = drawn_data(instances, optima, 10, 1.0, training.directions, random)
                anywhere = drawn_data(instances, optima, 10, 0.0, training.directions, random)
            chosen = random.choice(len(near[0]), per_step, replace=False)
            images = torch.from_numpy(np.concatenate([near[0][chosen], anywhere[0][chosen]])[:, None])
            along = torch.from_numpy(np.concatenate([near[1][chosen], anywhere[1][chosen]]) @ vectors)
            station = captured[torch.from_numpy(random.choice(len(captured), min(len(captured), per_step), replace=False))]
            batch = torch.cat([images, station]).contiguous(memory_format=torch.channels_last)
            with torch.autocast("cpu", PRECISIONS[recipe.precision], enabled=recipe.precision != "float32"):
                features = training.net.features(batch)
            features = features.float()
            huber, likelihood = loss_of(training.net.head(features[:len(images)]), along, training.directions.stiff)
            moments = moments_loss(features[per_step:len(images)], features[len(images):])
            optimizer.zero_grad()
            (huber + DOUBT_WEIGHT * likelihood + settings.weight * moments).backward()
            optimizer.step()
            rows.append((step + 1, huber.item(), moments.item()))
            if (step + 1) % 100 == 0:
                last = np.mean(rows[-100:], axis=0)
                self.log(f"step {step + 1} of {settings.steps}: loss {last[1]:.4f}, moments {last[2]:.4f}")
        training.seconds += time.monotonic() - begun
        self.out.keep_text("curve.csv", "step,loss,moments\n" + "".join(f"{k},{a:.6f},{b:.6f}\n" for k, a, b in rows))
        return training

    def cost(self) -> dict[str, Any]:
        """What the side file adds about the adaptation."""
        return {"adapted": {name: getattr(self.settings, name) for name in ("captures", "images", "steps", "rate", "weight")}}

