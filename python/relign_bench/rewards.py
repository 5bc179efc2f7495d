"""Scores and rewards of the paper (arXiv 2503.02075) and of its authors' package, by name.

A score is what is small at the optimum; a reward is made of the scores of an episode. Distances are Euclidean, in
shares of the travel, from the true pose to the nominal pose. `frames` and `reference` are in the scene's units.

score        value
combined     measured RMSE, plus the distance while that is above 0.1 (the paper's)
rmse         measured RMSE
rmse_binary  RMSE of frame and reference, both cut to 0 and 1 at 0.02
distance     the distance alone

reward                   value
paper                    minus the score "combined": the paper's reward, whatever score is chosen
score                    minus the score
potential                score before the move minus score after it
minus_one                -1 a step (the package's default)
minus_one_plus           minus the score where it is below twice the goal, else -1
minus_one_edge           -2 where an axis stands at its limit, else -1
minus_one_edge_package   -2: what the package's code gives, whose test for the limit is always true
"""

import numpy as np

OPTIMUM_REGION = 0.1  # where the paper's distance term ends, shares of the travel
BINARY_THRESHOLD = 0.02

SCORES = ("combined", "rmse", "rmse_binary", "distance")
REWARDS = ("paper", "score", "potential", "minus_one", "minus_one_plus", "minus_one_edge", "minus_one_edge_package")


def check_name(name, known, what):
    """Raises ValueError that lists what there is."""
    if name not in known:
        raise ValueError(f"there is no {what} '{name}'; {what}s: {', '.join(known)}")


def scores(name, measured, true_poses, nominal_pose, frames, reference):
    """Scores of n slots, shape (n,), float64.

    measured (n,), true_poses (n, axes), nominal_pose (axes,), frames (n, height, width), reference (height, width).
    """
    distance = np.linalg.norm(true_poses - nominal_pose, axis=1)
    if name == "combined":
        return measured + np.where(distance > OPTIMUM_REGION, distance, 0.0)
    if name == "rmse":
        return np.array(measured)
    if name == "rmse_binary":
        # Pixels differ by 0 or 1, so that the mean square is the share of those that differ.
        differ = (frames > BINARY_THRESHOLD) != (reference > BINARY_THRESHOLD)
        return np.sqrt(differ.reshape(len(frames), -1).mean(axis=1))
    if name == "distance":
        return distance
    raise ValueError(name)


def rewards(name, before, after, combined, true_poses, goal):
    """Rewards of n slots, shape (n,), float64, from the scores before and after the move, the score "combined" after
    it and the true poses (n, axes). `goal` is needed by minus_one_plus alone."""
    if name == "paper":
        return -combined
    if name == "score":
        return -after
    if name == "potential":
        return before - after
    if name == "minus_one":
        return np.full(len(after), -1.0)
    if name == "minus_one_plus":
        return np.where(after < 2 * goal, -after, -1.0)
    if name == "minus_one_edge":
        return np.where(((true_poses <= 0) | (true_poses >= 1)).any(axis=1), -2.0, -1.0)
    if name == "minus_one_edge_package":
        return np.full(len(after), -2.0)
    raise ValueError(name)
