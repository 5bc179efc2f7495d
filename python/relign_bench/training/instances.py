"""Instances to train on, their captures, and their optima as labels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from .._native import binned_parameters
from ..batch import Batch
from ..conventions import to_bytes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._typing import AnyArray, Float64Array, Parameters

OFFSETS = 5  # per element: shift x, y, z (mm), tilt x, y (deg)
FIRST_TILT = 3  # index of the first tilt among them


class InstanceSet:
    """Instances of several noise levels and one family, in slots.

    Captures are the scene's own, binned to `size` columns, as agents observe them.

    Args:
        scene: Id, preset or path of a scene.
        levels: Values of N in rho_N.
        slots: Instances of each level that are held at once.
        size: Columns of the images.
        family: "training", "tuning" or "benchmark".
        threads: Threads that render; None uses all cores.
        scene_parameters: Further parameters of the scene, or None.
        noise_level: Id or preset of the noise level.
        observation: What `frames` returns: "uint8" or "float32".
        device: "cuda" renders on the first GPU, with the bits of "cpu" (transport "ghost": the
            distribution). Captures are then tensors there.

    Attributes:
        count: Number of slots over all levels; arrays below have this many rows, level by level.
        axes: Number of axes.
        reference: Reference image, shape (height, width), in the scene's units.
        white: Value of a white pixel.
        nominal_pose: Nominal pose, shape (axes,).
    """

    def __init__(self, scene: str, levels: Sequence[float], slots: int, size: int, family: str = "training",
                 threads: int | None = None, scene_parameters: Parameters | None = None, noise_level: str = "rho",
                 observation: str = "uint8", device: str = "cpu") -> None:
        self.family, self.slots, self.observation = family, slots, observation
        parameters = {**binned_parameters(scene, size), **(scene_parameters or {})}
        self.batches = [Batch(slots, scene, noise_level, noise_level_parameters={"level": float(level)},
                              scene_parameters=parameters, threads=threads, device=device) for level in levels]
        self.levels = list(levels)
        first = self.batches[0]
        self.axes, self.reference, self.white = first.axes, first.reference, first.white
        self.nominal_pose = first.nominal_pose
        self.count = slots * len(self.batches)

    def reset(self, first_number: int) -> None:
        """Fills the slots with the instances number first_number, first_number + 1, ...

        Equal numbers are equal draws at every level, so each level gets numbers of its own.
        """
        every = list(range(self.slots))
        for k, batch in enumerate(self.batches):
            batch.reset(every, [first_number + k * self.slots + slot for slot in every], self.family)

    def _split(self, values: AnyArray) -> list[AnyArray]:
        return [values[k * self.slots:(k + 1) * self.slots] for k in range(len(self.batches))]

    def _gather(self, name: str, *arguments: AnyArray) -> AnyArray:
        every = list(range(self.slots))
        parts = [self._split(argument) for argument in arguments]
        return joined([getattr(batch, name)(every, *(part[k] for part in parts)) for k, batch in enumerate(self.batches)])

    def frames_at(self, true_poses: Float64Array, seeds: AnyArray) -> Any:
        """Captures at true poses of shape (count, axes), with frame seeds of shape (count,).

        Returns:
            Bytes, shape (count, height, width).
        """
        return to_bytes(self._gather("capture_at", true_poses, seeds), self.white)

    def frames(self) -> Any:
        """The latest captures, shape (count, height, width): bytes, or floats in the scene's units."""
        captures = joined([batch.frames for batch in self.batches])
        return to_bytes(captures, self.white) if self.observation == "uint8" else captures

    def move_by(self, moves: Float64Array) -> None:
        """Moves the stages by commanded moves, shape (count, axes), and captures."""
        every = list(range(self.slots))
        for batch, part in zip(self.batches, self._split(moves)):
            batch.move_by(every, part)

    def true_poses(self) -> Float64Array:
        """True poses, shape (count, axes)."""
        return self._gather("true_poses")

    def commanded_poses(self) -> Float64Array:
        """Poses by the stages' encoders, shape (count, axes)."""
        return self._gather("commanded_poses")

    def noise_free_mse(self) -> Float64Array:
        """Ground truth: noise-free MSE at the true poses, shape (count,)."""
        every = list(range(self.slots))
        return np.concatenate([batch.noise_free_mse(every)[0] for batch in self.batches])

    def offsets(self) -> Float64Array:
        """Offsets of the elements: one row per instance, shifts (mm) and tilts (deg) in a fixed order.

        Instances without offsets have zeros.
        """
        return offsets_of([batch.instance(slot)["elements"] for batch in self.batches for slot in range(self.slots)])

    def exact_optima(self) -> tuple[Float64Array, Float64Array]:
        """The instances' optima, by the scene's search.

        Returns:
            True poses, shape (count, axes), and noise-free MSE there, shape (count,).

        Raises:
            ValueError: The scene does not search for optima.
        """
        every = list(range(self.slots))
        found = [optimum for batch in self.batches for optimum in batch.optima(every)]
        known = [optimum for optimum in found if optimum is not None]
        if len(known) < len(found):
            raise ValueError("the scene does not search for optima, which training needs as labels")
        return np.array([pose for pose, _ in known]), np.array([mse for _, mse in known])


def joined(parts: Sequence[Any]) -> Any:
    """Arrays or tensors, one after the other along their first axis."""
    return torch.cat(list(parts)) if isinstance(parts[0], torch.Tensor) else np.concatenate(parts)


def stacked(parts: Sequence[Any]) -> Any:
    """Arrays or tensors of shape (n, ...), in one of shape (n, parts, ...)."""
    return torch.stack(list(parts), 1) if isinstance(parts[0], torch.Tensor) else np.stack(parts, 1)


def offsets_of(drawn: list[dict[str, Any]]) -> Float64Array:
    """Offsets as rows, see `InstanceSet.offsets`, from the "elements" of instances."""
    names = sorted({name for elements in drawn for name in elements}) or ["none"]
    rows = []
    for elements in drawn:
        row: list[float] = []
        for name in names:
            offset: dict[str, Any] = elements.get(name, {})
            row += list(offset.get("shift_mm", [0, 0, 0])) + list(offset.get("tilt_deg", [0, 0]))
        rows.append(row)
    return np.array(rows)


class OptimumModel:
    """An instance's optimum as a polynomial of its element offsets, fitted by least squares.

    An exact search takes a tenth of a second. All offsets enter linearly; tilts also by their squares and products, which move
    mostly the focus.

    Args:
        scene: Id, preset or path of a scene.
        size: Columns of the images.
        samples: Exact optima to fit.
        level: Noise level N of the samples.
        threads: Threads that render; None uses all cores.
        seed: Decides the samples.
        noise_level: Id or preset of the noise level.

    Attributes:
        residual: RMS error on the half of the samples that a fit of the other half has not used, in shares of the travel.
    """

    def __init__(self, scene: str, size: int, samples: int, level: float = 0.5, threads: int | None = None,
                 seed: int = 0, noise_level: str = "rho") -> None:
        instances = InstanceSet(scene, [level], 32, size, threads=threads, noise_level=noise_level)
        all_offsets, all_optima = [], []
        for first in range(0, samples, instances.count):
            instances.reset(2**40 + seed * 2**20 + first)
            all_offsets.append(instances.offsets())
            all_optima.append(instances.exact_optima()[0])
        offsets, optima = np.concatenate(all_offsets), np.concatenate(all_optima)
        self.nominal_pose = instances.nominal_pose
        # Offsets are in units of their spread; those that are never drawn are left out.
        self._spread = offsets.std(axis=0)
        half = len(offsets) // 2
        fitted = self._fit(offsets[:half], optima[:half])
        self.residual = float(np.sqrt(np.mean((self._apply(fitted, offsets[half:]) - optima[half:]) ** 2)))
        self.matrix = self._fit(offsets, optima)

    def _features(self, offsets: Float64Array) -> Float64Array:
        drawn = self._spread > 0
        first = offsets[:, drawn] / self._spread[drawn]
        tilts = first[:, np.flatnonzero(drawn) % OFFSETS >= FIRST_TILT]
        one, other = np.triu_indices(tilts.shape[1])
        return np.concatenate([first, tilts[:, one] * tilts[:, other]], axis=1)

    def _fit(self, offsets: Float64Array, optima: Float64Array) -> Float64Array:
        solution: Any = np.linalg.lstsq(self._features(offsets), optima - self.nominal_pose, rcond=None)[0]
        return solution

    def _apply(self, matrix: Float64Array, offsets: Float64Array) -> Float64Array:
        return self.nominal_pose + self._features(offsets) @ matrix

    def optima(self, offsets: Float64Array) -> Float64Array:
        """True poses of the optima, shape (n, axes), for rows of `InstanceSet.offsets`."""
        if offsets.shape[1] != len(self._spread):  # instances without offsets
            return np.tile(self.nominal_pose, (len(offsets), 1))
        return np.clip(self._apply(self.matrix, offsets), 0, 1)
