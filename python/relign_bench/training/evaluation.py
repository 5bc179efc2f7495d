"""How a policy does on lenses that training never saw."""

import numpy as np

from .lenses import Lenses

LOOKS = (6, 12)  # steps after which the truth is asked for
SLOTS = 100  # lenses, over all levels


def rmse_on_the_way(moves, lenses, frames, looks):
    """Noise-free RMSE of every lens after so many steps: {step: (n,)} for the steps in `looks`, 0 being the start.

    The lenses are the first of their family. moves(bytes (n, frames, size, size), step, memory) -> (moves (n, axes),
    memory); the first step is 1 and its memory None.
    """
    lenses.reset(0)
    seen = lenses.frames()
    stack = np.zeros((len(seen), frames, *seen.shape[1:]), np.uint8)
    memory, found = None, {}
    for step in range(max(looks) + 1):
        if step > 0:
            stack[:, :-1] = stack[:, 1:]
            stack[:, -1] = lenses.frames()
            move, memory = moves(stack, step, memory)
            lenses.move_by(move)
        if step in looks:
            found[step] = np.sqrt(np.maximum(0, lenses.noise_free_mse()))
    return found


def evaluate(moves, scene, levels, size, frames, threads=None):
    """Medians over tuning lenses: {"rmse_6", "rmse_12", "under_0.01", "score"}.

    moves: as in rmse_on_the_way. score: mean noise-free RMSE after 6 and 12 steps, which a few lost lenses spoil;
    smaller is better.
    """
    lenses = Lenses(scene, levels, SLOTS // len(levels), size, instances="tuning", threads=threads)
    found = rmse_on_the_way(moves, lenses, frames, LOOKS)
    told = {f"rmse_{step}": float(np.median(rmse)) for step, rmse in found.items()}
    told["under_0.01"] = float((found[LOOKS[-1]] < 0.01).mean())
    told["score"] = float(np.mean([rmse.mean() for rmse in found.values()]))
    return told
