"""What a policy with a memory observes: earlier captures' poses and readings, as rows of numbers, and its network.

relign-bench's agents have the same rules (core/training/policies/history.hpp).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import nn

from ..conventions import BYTE_WHITES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._typing import AnyArray, Float32Array, Float64Array

FINE_MOVE = 0.005
"""Of the signed logarithm of moves, in shares of the travel."""


def signed_log(values: AnyArray, fine: Any) -> Float64Array:
    """sign(x) log(1 + |x| / fine) of an array: resolves what is near zero, and spans what is far."""
    found: Float64Array = np.copysign(np.log(1 + np.abs(values) / fine), values)
    return found


@dataclass
class HistoryFormat:
    """How captures become numbers.

    Attributes:
        axes: Number of axes.
        last: Slots for the latest captures, the newest last.
        best: Slots before them for the captures with the lowest score, the lowest first.
        mean: Per reading, shape (readings,); empty for a scene with images, whose slots have poses only.
        deviation: The first number of a reading is (value - mean) / deviation.
        fine: Of the signed logarithm of a reading, in its unit.
        score: Place of the reading that measures the score; None: none does.
    """

    axes: int
    last: int
    best: int
    mean: Float64Array
    deviation: Float64Array
    fine: Float64Array
    score: int | None = None

    @property
    def slot(self) -> int:
        """Numbers of a slot."""
        return 1 + 2 * self.axes + 2 * len(self.mean)

    @property
    def count(self) -> int:
        """Numbers of an input."""
        return (self.last + self.best) * self.slot

    def inputs(self, poses: Float64Array, values: Float32Array) -> Float32Array:
        """The network's input after the latest of several captures.

        Args:
            poses: Commanded poses in shares of the travel, shape (n, captures, axes), the newest last.
            values: Readings, shape (n, captures, readings).

        Returns:
            Shape (n, count). Each slot: 1; per axis the pose minus the latest one and its signed logarithm; per reading the
            normalised value and its signed logarithm. A slot that is not filled is all zeros.
        """
        rows, captures = poses.shape[:2]
        found = np.zeros((rows, self.last + self.best, self.slot), np.float32)
        latest = min(self.last, captures)
        chosen = [(self.best + self.last - latest, np.tile(np.arange(captures - latest, captures), (rows, 1)))]
        if self.best:
            lowest = np.argsort(values[:, :, self.score], axis=1, kind="stable")[:, :self.best]
            chosen.append((0, lowest))
        for first, places in chosen:
            slots = found[:, first:first + places.shape[1]]
            away = np.take_along_axis(poses, places[:, :, None], 1) - poses[:, -1:]
            read = np.take_along_axis(values, places[:, :, None], 1).astype(np.float64)
            slots[:, :, 0] = 1
            slots[:, :, 1:1 + 2 * self.axes:2] = away
            slots[:, :, 2:2 + 2 * self.axes:2] = signed_log(away, FINE_MOVE)
            slots[:, :, 1 + 2 * self.axes::2] = (read - self.mean) / self.deviation
            slots[:, :, 2 + 2 * self.axes::2] = signed_log(read, self.fine)
        return found.reshape(rows, -1)


class HistoryNet(nn.Module):
    """Hidden layers on the history and, for a scene with images, on what strided convolutions make of the latest ones.

    Output: shares of the travel, shape (batch, axes).

    Args:
        inputs: Numbers of a history.
        axes: Number of axes.
        hidden: Widths of the hidden layers.
        images: Frames, rows and columns of the images; None for a scene of readings.
    """

    def __init__(self, inputs: int, axes: int, hidden: Sequence[int], images: tuple[int, int, int] | None = None) -> None:
        super().__init__()
        self.encoder: nn.Sequential | None = None
        if images is not None:
            channels, rows, columns = images
            layers: list[nn.Module] = []
            for k, width in enumerate((16, 32, 64, 64)):
                kernel = 5 if k == 0 else 3
                layers += [nn.Conv2d(channels, width, kernel, 2, kernel // 2), nn.ReLU()]
                channels, rows, columns = width, (rows + 1) // 2, (columns + 1) // 2
            self.encoder = nn.Sequential(*layers, nn.Flatten(), nn.Linear(channels * rows * columns, hidden[0]))
        self.first = nn.Linear(inputs, hidden[0])
        body: list[nn.Module] = [nn.ReLU()]
        for before, width in zip(hidden, hidden[1:]):
            body += [nn.Linear(before, width), nn.ReLU()]
        self.body = nn.Sequential(*body)
        self.head = nn.Linear(hidden[-1], axes)

    def forward(self, *inputs: torch.Tensor) -> torch.Tensor:
        """The output for histories, shape (batch, count), after images, shape (batch, frames, rows, columns), if any."""
        values = self.first(inputs[-1])
        if self.encoder is not None:
            values = values + self.encoder(inputs[0].float() * (BYTE_WHITES / 255))
        return self.head(self.body(values))
