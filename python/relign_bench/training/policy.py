"""From a network's guesses to moves: the rule that the agent's plugin follows, too."""

import numpy as np

from ..conventions import LARGEST_MOVE

WHOLE_GUESSES = 4  # so many guesses are followed whole: what a far start needs


def gain(step):
    """Share of the guess at step 1, 2, ... that is moved. Later guesses are averaged: noise falls as one over the root
    of their number."""
    return 1.0 if step <= WHOLE_GUESSES else 1.0 / (step - WHOLE_GUESSES + 1)


def moves(guesses, step):
    """Moves for guesses (n, axes) at step 1, 2, ..."""
    return np.clip(gain(step) * guesses, -LARGEST_MOVE, LARGEST_MOVE)
