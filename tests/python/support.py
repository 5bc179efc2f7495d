"""Shared by the tests of the package. By hand: PYTHONPATH=BUILD/python python3 -m unittest discover tests/python"""

import unittest

try:
    import gymnasium
    import numpy as np

    import relign_bench  # noqa: F401
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: these tests need numpy, gymnasium and the compiled module of relign_bench") from None

ID = "relign_bench/Alignment-v0"
# The paper's scene with 20 x 20 pixels, for speed.
SMALL = dict(scene="relign_od", noise_level="rho0.25", size=20)


def make(**arguments):
    """One environment without gymnasium's wrappers."""
    return gymnasium.make(ID, **{**SMALL, **arguments}).unwrapped


def make_vector(count, **arguments):
    return gymnasium.make_vec(ID, num_envs=count, **{**SMALL, **arguments}).unwrapped


def same(one, other):
    """Whether two observations or infos are equal: arrays, numbers or dictionaries."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return np.array_equal(one, other)
