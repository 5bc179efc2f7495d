"""The residual gain schedule: from a network's residual output to a move. The agent's plugin has the same rule."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..conventions import LARGEST_MOVE

if TYPE_CHECKING:
    from .._typing import Float64Array

FULL_GAIN_STEPS = 4
"""Moves at the start that follow the residual in full, so that distant starts come close."""


def gain(step: int) -> float:
    """Share of the residual that is moved at step 1, 2, ...

    After FULL_GAIN_STEPS it is 1/2, 1/3, ...: this averages the residuals, and their noise falls with the square root of
    their number.
    """
    return 1.0 if step <= FULL_GAIN_STEPS else 1.0 / (step - FULL_GAIN_STEPS + 1)


def moves(residuals: Float64Array, step: int) -> Float64Array:
    """Commanded moves for residuals to the optimum, both of shape (n, axes), in shares of the travel.

    Args:
        residuals: Outputs of the network.
        step: Number of the step, from 1.
    """
    return np.clip(gain(step) * residuals, -LARGEST_MOVE, LARGEST_MOVE)
