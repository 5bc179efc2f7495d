"""How a policy does on lenses that training never saw."""

import numpy as np

from .lenses import Lenses

LOOKS = (6, 12)  # steps after which the truth is asked for
SLOTS = 100  # lenses, over all levels


def evaluate(moves, scene, levels, size, frames, threads=None):
    """Medians over tuning lenses: {"rmse_6", "rmse_12", "under_0.01", "score"}.

    moves(bytes (n, frames, size, size), step, memory) -> (moves (n, axes), memory). score: mean
    noise-free RMSE after 6 and 12 steps, which a few lost lenses spoil; smaller is better.
    """
    lenses = Lenses(scene, levels, SLOTS // len(levels), size, instances="tuning", threads=threads)
    lenses.reset(0)
    stack = np.zeros((lenses.count, frames, size, size), np.uint8)
    memory, found = None, {}
    for step in range(1, max(LOOKS) + 1):
        stack[:, :-1] = stack[:, 1:]
        stack[:, -1] = lenses.frames()
        move, memory = moves(stack, step, memory)
        lenses.move_by(move)
        if step in LOOKS:
            found[step] = np.sqrt(np.maximum(0, lenses.noise_free_mse()))
    told = {f"rmse_{step}": float(np.median(rmse)) for step, rmse in found.items()}
    told["under_0.01"] = float((found[LOOKS[-1]] < 0.01).mean())
    told["score"] = float(np.mean([rmse.mean() for rmse in found.values()]))
    return told
