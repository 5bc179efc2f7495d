"""Scores and rewards of the paper (arXiv 2503.02075) and of its authors' package, by name.

A score is small at the optimum; a reward is computed from the scores of an episode. Distances are Euclidean, from the true
pose to the nominal pose, in shares of the travel.

score        value
combined     measured RMSE, plus the distance where it exceeds 0.1 (the paper's)
rmse         measured RMSE
rmse_binary  RMSE between capture and reference, both thresholded to 0 and 1 at 0.02
distance     the distance alone

reward                   value
paper                    minus the score "combined", whichever score is chosen: the paper's reward
score                    minus the score
potential                score before the move minus score after it
minus_one                -1 per step (the package's default)
minus_one_plus           minus the score where it is below twice the goal, else -1
minus_one_edge           -2 where an axis is at its limit, else -1
minus_one_edge_package   -2: what the package's code returns, since its test for the limit is always true
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._errors import unknown_name

if TYPE_CHECKING:
    from ._typing import Float32Array, Float64Array

OPTIMUM_REGION = 0.1
"""Distance above which the score "combined" includes it, in shares of the travel (the paper's)."""

BINARY_THRESHOLD = 0.02
"""Threshold of the score "rmse_binary", in the scene's units (the package's)."""

SCORES = ("combined", "rmse", "rmse_binary", "distance")
REWARDS = ("paper", "score", "potential", "minus_one", "minus_one_plus", "minus_one_edge", "minus_one_edge_package")


def scores(name: str, measured: Float64Array, true_poses: Float64Array, nominal_pose: Float64Array,
           frames: Float32Array | None, reference: Float32Array | None) -> Float64Array:
    """Scores of n slots.

    Args:
        name: One of SCORES.
        measured: Measured RMSE, shape (n,).
        true_poses: True poses in shares of the travel, shape (n, axes).
        nominal_pose: Nominal pose, shape (axes,).
        frames: Captures in the scene's units, shape (n, height, width); used by "rmse_binary" only.
        reference: Reference image, shape (height, width); used by "rmse_binary" only.

    Returns:
        Scores, shape (n,).

    Raises:
        ValueError: The name is not in SCORES, or "rmse_binary" has no images.
    """
    distance = np.linalg.norm(true_poses - nominal_pose, axis=1)
    if name == "combined":
        return measured + np.where(distance > OPTIMUM_REGION, distance, 0.0)
    if name == "rmse":
        return np.array(measured)
    if name == "rmse_binary":
        if frames is None or reference is None:
            raise ValueError("score 'rmse_binary' needs frames and reference")
        # Thresholded pixels differ by 0 or 1, so the mean square is the share of pixels that differ.
        differ = (frames > BINARY_THRESHOLD) != (reference > BINARY_THRESHOLD)
        return np.sqrt(differ.reshape(len(frames), -1).mean(axis=1))
    if name == "distance":
        return distance
    raise ValueError(unknown_name("score", name, SCORES))


def rewards(name: str, before: Float64Array, after: Float64Array, combined: Float64Array, true_poses: Float64Array,
            goal: float | None) -> Float64Array:
    """Rewards of n slots for one move.

    Args:
        name: One of REWARDS.
        before: Scores before the move, shape (n,).
        after: Scores after the move, shape (n,).
        combined: Score "combined" after the move, shape (n,).
        true_poses: True poses after the move, in shares of the travel, shape (n, axes).
        goal: The score below which an episode ends; needed by "minus_one_plus" only.

    Returns:
        Rewards, shape (n,).

    Raises:
        ValueError: The name is not in REWARDS, or "minus_one_plus" has no goal.
    """
    if name == "paper":
        return -combined
    if name == "score":
        return -after
    if name == "potential":
        return before - after
    if name == "minus_one":
        return np.full(len(after), -1.0)
    if name == "minus_one_plus":
        if goal is None:
            raise ValueError("reward 'minus_one_plus' needs a goal, such as goal=0.05")
        return np.where(after < 2 * goal, -after, -1.0)
    if name == "minus_one_edge":
        return np.where(((true_poses <= 0) | (true_poses >= 1)).any(axis=1), -2.0, -1.0)
    if name == "minus_one_edge_package":
        return np.full(len(after), -2.0)
    raise ValueError(unknown_name("reward", name, REWARDS))
