"""Lenses to learn from, frames of them, and what a perfect teacher would do."""

import numpy as np

from .._native import binned_parameters
from ..batch import Batch
from ..conventions import to_bytes


class Lenses:
    """Slots of lenses of several noise levels, always those of one family.

    `levels` are values of N in rho_N, `slots` how many lenses of each are held at once.
    """

    def __init__(self, scene, levels, slots, size, instances="training", threads=None):
        self.instances, self.slots = instances, slots
        # What the agent will see: the scene's own captures, binned to `size` columns.
        parameters = binned_parameters(scene, size)
        self.batches = [Batch(slots, scene, "rho", noise_level_parameters={"level": float(level)},
                              scene_parameters=parameters, threads=threads) for level in levels]
        self.levels = list(levels)
        first = self.batches[0]
        self.axes, self.reference, self.white = first.axes, first.reference, first.white
        self.nominal_pose = first.nominal_pose
        self.count = slots * len(self.batches)

    def reset(self, first_number):
        """Lenses number first_number, first_number + 1, ... in the slots of every level. Numbers mean the same draw at
        every level, so each level gets numbers of its own."""
        every = list(range(self.slots))
        for k, batch in enumerate(self.batches):
            batch.reset(every, [first_number + k * self.slots + slot for slot in every], self.instances)

    def _split(self, values):
        return [values[k * self.slots:(k + 1) * self.slots] for k in range(len(self.batches))]

    def _gather(self, name, *arguments):
        every = list(range(self.slots))
        parts = [self._split(argument) for argument in arguments]
        return np.concatenate([getattr(batch, name)(every, *(part[k] for part in parts))
                               for k, batch in enumerate(self.batches)])

    def frames_at(self, true_poses, seeds):
        """Bytes, count x height x width."""
        return to_bytes(self._gather("capture_at", true_poses, seeds), self.white)

    def frames(self):
        return to_bytes(np.concatenate([batch.frames for batch in self.batches]), self.white)

    def move_by(self, moves):
        every = list(range(self.slots))
        for batch, part in zip(self.batches, self._split(moves)):
            batch.move_by(every, part)

    def true_poses(self):
        return self._gather("true_poses")

    def noise_free_mse(self):
        every = list(range(self.slots))
        return np.concatenate([batch.truths(every)[0] for batch in self.batches])

    def offsets(self):
        """What was drawn for the elements, one row a lens: all shifts (mm) and tilts (deg), in a fixed order. Lenses
        without offsets have zeros."""
        drawn = [batch.instance(slot)["elements"] for batch in self.batches for slot in range(self.slots)]
        names = sorted({name for elements in drawn for name in elements}) or ["none"]
        rows = []
        for elements in drawn:
            row = []
            for name in names:
                offset = elements.get(name, {})
                row += list(offset.get("shift_mm", [0, 0, 0])) + list(offset.get("tilt_deg", [0, 0]))
            rows.append(row)
        return np.array(rows)

    def exact_optima(self):
        """True poses of the lenses' own optima, found by the scene's search."""
        every = list(range(self.slots))
        found = [optimum for batch in self.batches for optimum in batch.optima(every)]
        if any(optimum is None for optimum in found):
            raise ValueError("the scene does not look for a lens's own optimum, which is the label to learn")
        return np.array([pose for pose, _ in found]), np.array([mse for _, mse in found])


class OptimumModel:
    """The own optimum as a polynomial of the elements' offsets: exact searches cost a tenth of a second each. Offsets
    move the optimum in proportion; tilts also by their squares and products, mostly its focus."""

    def __init__(self, scene, size, samples, level=0.5, threads=None, seed=0):
        lenses = Lenses(scene, [level], 32, size, threads=threads)
        offsets, optima = [], []
        for first in range(0, samples, lenses.count):
            lenses.reset(2**40 + seed * 2**20 + first)
            offsets.append(lenses.offsets())
            optima.append(lenses.exact_optima()[0])
        offsets, optima = np.concatenate(offsets), np.concatenate(optima)
        self.nominal_pose = lenses.nominal_pose
        # Offsets in units of their spread; those that are never drawn are left out.
        self._spread = offsets.std(axis=0)
        half = len(offsets) // 2
        # The residual is told of lenses that the fit has not seen; then all of them are used.
        held_out = self._fit(offsets[:half], optima[:half])
        self.residual = float(np.sqrt(np.mean((self._apply(held_out, offsets[half:]) - optima[half:]) ** 2)))
        self.matrix = self._fit(offsets, optima)

    def _features(self, offsets):
        drawn = self._spread > 0
        first = offsets[:, drawn] / self._spread[drawn]
        tilts = first[:, np.flatnonzero(drawn) % 5 >= 3]  # rows are shift x, y, z, tilt x, y of each element
        one, other = np.triu_indices(tilts.shape[1])
        return np.concatenate([first, tilts[:, one] * tilts[:, other]], axis=1)

    def _fit(self, offsets, optima):
        return np.linalg.lstsq(self._features(offsets), optima - self.nominal_pose, rcond=None)[0]

    def _apply(self, matrix, offsets):
        return self.nominal_pose + self._features(offsets) @ matrix

    def optima(self, offsets):
        """True poses, shape (n, axes)."""
        if offsets.shape[1] != len(self._spread):  # lenses without offsets
            return np.tile(self.nominal_pose, (len(offsets), 1))
        return np.clip(self._apply(self.matrix, offsets), 0, 1)
