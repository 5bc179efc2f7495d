"""Adaptation of a trained policy to a station, from captures at unknown poses.

The network continues to learn from labelled simulated images, and at the same time to give its features the same mean and
standard deviation on the station's captures as on ideal simulated ones at poses over the whole travel (moment matching, the
diagonal form of CORAL: Sun and Saenko, "Deep CORAL", 2016). The station's captures need no labels, but poses spread over the
travel.
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

    from .._typing import ByteArray, Float32Array


@dataclass
class Recipe:
    """Settings of an adaptation; recipe.json has them under these names, and python/README.md documents them."""

    trained: str = ""  # SHA-256 of the checkpoint of the run that is adapted
    images: str = ""  # SHA-256 of the captures
    captures: int = 0  # their number
    steps: int = 400  # of the optimiser
    rate: float = 1e-4  # at first; it falls linearly to 0
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
    if white is not None and not 0 < white <= 1:
        raise ValueError(f"--white {white:g}: must be above 0 and at most 1")
    files = sorted(path for path in pathlib.Path(folder).iterdir() if path.is_file())
    found = []
    for path in files:
        if path.suffix.lower() == ".png":
            if white is None:
                raise ValueError(f"'{path}': --white must say which grey value, 0 to 1, a white pixel has in .png files")
            values = _grey_of(path) * np.float32(scene_white / white)
        elif path.suffix.lower() == ".npy":
            values = _array_of(path)
        else:
            raise ValueError(f"'{path}' is neither .npy nor .png; put the captures into a folder of their own")
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


def _grey_of(path: pathlib.Path) -> Float32Array:
    """The grey values of a PNG file, 0 to 1."""
    from matplotlib.image import imread

    try:
        values = np.asarray(imread(path), np.float32)
    except Exception as problem:  # the decoder's exceptions are of many kinds
        raise ValueError(f"'{path}' cannot be read: {problem}") from None
    if values.ndim == 3:
        colours = values[..., :3] if values.shape[2] > 2 else values[..., :1]  # without transparency
        if np.ptp(colours, axis=-1).max() > 0:
            raise ValueError(f"'{path}' is a colour image; expected grey values")
        values = colours[..., 0]
    return values


def _array_of(path: pathlib.Path) -> Float32Array:
    try:
        values = np.load(path, allow_pickle=False)
    except (ValueError, EOFError) as problem:
        raise ValueError(f"'{path}' cannot be read: {problem}") from None
    if not np.issubdtype(values.dtype, np.floating):
        raise ValueError(f"'{path}' has values of type {values.dtype}; expected floating-point numbers in the scene's units, "
                         "as relign-bench render writes them")
    return values.astype(np.float32)


def check_captures(captures: ByteArray, reference: ByteArray, where: str) -> None:
    """Checks that captures may be of the lens that a network was trained on.

    Args:
        captures: As `read_captures` returns them.
        reference: The scene's reference image as bytes, shape (size, size).
        where: Names the captures in messages.

    Raises:
        ValueError: Their brightness is not that of the scene, they hold no picture, or they are all the same.
    """
    clipped = float((captures == 255).mean())
    if clipped > 0.02:
        raise ValueError(f"{where}: {clipped:.0%} of the pixels are brighter than the network can see; is white as bright as "
                         "in the scene? (.npy: the scene's units; .png: --white)")
    mean, expected = float(captures.mean()), float(reference.mean())
    if not expected / 3 < mean < 3 * expected:
        raise ValueError(f"{where}: the captures are {mean / expected:.2g} times as bright as the scene's reference image; is "
                         "white as bright as in the scene? (.npy: the scene's units; .png: --white)")
    flat = int((captures.std(axis=(1, 2)) < 1).sum())
    if flat > 0:
        raise ValueError(f"{where}: {flat} of {len(captures)} captures show nothing")
    different = len(np.unique(captures.reshape(len(captures), -1), axis=0))
    if different < len(captures):
        raise ValueError(f"{where}: only {different} of {len(captures)} captures are different")


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
        if settings.batch < 8:
            raise ValueError(f"batch {settings.batch} must be at least 8: half of it gives a mean and a standard deviation")
        self.training = Training.open(trained, threads, log)
        settings.trained = hashlib.sha256((self.training.folder / "checkpoint.pt").read_bytes()).hexdigest()
        settings.images, settings.captures = hashlib.sha256(captures.tobytes()).hexdigest(), len(captures)
        self.settings, self.captures, self.log = settings, captures, log
        self.out = RunFolder(folder, settings)

    def run(self) -> Training:
        """Adapts the network; returns the run with it."""
        settings, training, recipe = self.settings, self.training, self.training.recipe
        begun = time.monotonic()
        random = np.random.default_rng([settings.seed, 3])
        torch.manual_seed(settings.seed)
        instances, ideal = training.instances(), training.instances(errors=False)
        optimizer = torch.optim.Adam(training.net.parameters(), lr=settings.rate)
        vectors = training.directions.vectors.astype(np.float32)
        captured = torch.from_numpy(self.captures[:, None])
        rows: list[tuple[int, float, float]] = []
        per_step = settings.batch // 2  # images near the optima, and as many anywhere
        rendered = 10 * instances.count
        if per_step > rendered:
            raise ValueError(f"batch {settings.batch} must be at most {2 * rendered}, twice the images rendered at once")
        for step in range(settings.steps):
            optimizer.param_groups[0]["lr"] = settings.rate * (1 - step / settings.steps)
            if step % max(1, rendered // per_step) == 0:
                first = recipe.seed * 2**32 + 2**31 + step * instances.count
                instances.reset(first)
                ideal.reset(first)
                optima = training.optimum.optima(instances.offsets())
                near = drawn_data(instances, optima, 10, 1.0, training.directions, random)
                anywhere = drawn_data(ideal, optima, 10, 0.0, training.directions, random)
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
            loss = huber + DOUBT_WEIGHT * likelihood + settings.weight * moments
            if not torch.isfinite(loss):
                raise ValueError(f"step {step + 1}: the loss is not finite; reduce rate or weight")
            loss.backward()
            optimizer.step()
            rows.append((step + 1, huber.item(), moments.item()))
            if (step + 1) % 100 == 0:
                last = np.mean(rows[-100:], axis=0)
                self.log(f"step {step + 1} of {settings.steps}: loss {last[1]:.4f}, moments {last[2]:.4f}")
        training.seconds += time.monotonic() - begun
        with self.out.alone():
            self.out.keep_text("curve.csv", "step,loss,moments\n" + "".join(f"{k},{a:.6f},{b:.6f}\n" for k, a, b in rows))
        return training

    def cost(self) -> dict[str, Any]:
        """What the side file adds about the adaptation."""
        return {"adapted": {name: getattr(self.settings, name) for name in ("captures", "images", "steps", "rate", "weight")}}

