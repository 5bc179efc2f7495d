"""How a policy combines the answers of a network that predicts its own errors. The agent's plugin has the same rule."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..conventions import LARGEST_MOVE

if TYPE_CHECKING:
    from .._typing import Float64Array

DRIFT = 0.015
"""Error of the stage over a distance, as a share of it: what an answer loses when the stage has moved on."""


@dataclass
class Doubt:
    """What is needed to combine answers.

    Attributes:
        directions: Directions as columns, shape (axes, axes).
        effects: Mean squared change of a pixel per squared unit of travel along each direction, shape (axes,).
        floor: Standard deviation of the error that all answers about an instance share, along each direction, shape (axes,).
    """

    directions: Float64Array
    effects: Float64Array
    floor: Float64Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not self.floor.size:
            self.floor = np.zeros(len(self.effects))

    def calibrate(self, errors: Float64Array, deviations: Float64Array) -> Float64Array:
        """Sets the floor, and returns the factors that make the standard deviations as large as the errors.

        Args:
            errors: Errors of the answers along the directions, shape (steps, instances, axes).
            deviations: Predicted standard deviations, of the same shape.

        Returns:
            One factor per direction, shape (axes,).
        """
        scale = np.sqrt(np.mean((errors / deviations) ** 2, axis=(0, 1)))
        # Of independent errors the mean over the steps has this variance; what it has beyond is shared.
        independent = np.mean((errors - errors.mean(axis=0)) ** 2, axis=(0, 1)) / (len(errors) - 1)
        shared = np.mean(errors.mean(axis=0) ** 2, axis=0) - independent
        self.floor = np.sqrt(np.maximum(shared, 0))
        return scale


class Belief:
    """Where the optima of n instances are, from the answers so far.

    Each answer is a normal distribution along the directions. Its weight falls with the distance that the stage has moved
    since (DRIFT), because the answer is in coordinates of the stage.
    """

    def __init__(self, doubt: Doubt) -> None:
        self.doubt = doubt
        self._poses: list[Float64Array] = []
        self._goals: list[Float64Array] = []
        self._deviations: list[Float64Array] = []

    def add(self, poses: Float64Array, residuals: Float64Array, deviations: Float64Array) -> None:
        """Adds an answer about each instance.

        Args:
            poses: Commanded poses of the captures, shape (n, axes).
            residuals: Predicted residuals to the optima, shape (n, axes).
            deviations: Standard deviations of their errors along the directions, shape (n, axes).
        """
        self._poses.append(poses)
        self._goals.append((poses + residuals) @ self.doubt.directions)
        self._deviations.append(deviations)

    def optimum(self, poses: Float64Array) -> tuple[Float64Array, Float64Array]:
        """The expected optima as commanded poses, and the variances along the directions; both of shape (n, axes).

        Args:
            poses: The stages' commanded poses now, shape (n, axes).
        """
        past = np.array(self._poses)
        moved = np.sum((past - poses) ** 2, axis=-1, keepdims=True)
        weights = 1 / (np.array(self._deviations) ** 2 + DRIFT**2 * moved)
        total = weights.sum(axis=0)
        along = (weights * np.array(self._goals)).sum(axis=0) / total
        return along @ self.doubt.directions.T, 1 / total + self.doubt.floor**2

    def moves(self, poses: Float64Array) -> Float64Array:
        """Commanded moves towards the expected optima, at most LARGEST_MOVE per axis; shape (n, axes)."""
        return np.clip(self.optimum(poses)[0] - poses, -LARGEST_MOVE, LARGEST_MOVE)
