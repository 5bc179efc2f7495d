"""Shared by the tests of the package. By hand: PYTHONPATH=BUILD/python python3 -m unittest discover tests/python"""

import contextlib
import importlib
import io
import os
import pathlib
import tempfile
import unittest
import warnings
from unittest import mock

try:
    import gymnasium
    import numpy as np

    import relign_bench  # noqa: F401 (for other tests)
    from relign_bench import _cuda
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


def failure(*arguments):
    """The message of a command of relign-train that fails."""
    from relign_bench.training import cli

    with contextlib.redirect_stderr(io.StringIO()) as errors, contextlib.redirect_stdout(io.StringIO()):
        status = cli.main([str(argument) for argument in arguments])
    if status != 2:
        raise AssertionError(f"status {status} of {arguments}: {errors.getvalue()}")
    return errors.getvalue()


def package(name, pins="requirements-others.txt pins"):
    """A package that only some tests need; skips them where it is missing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # without a network, cocopp's import warns
            return importlib.import_module(name)
    except ImportError as problem:
        raise unittest.SkipTest(f"{problem}: tests/python/{pins} it") from None


class Folder(unittest.TestCase):
    """Tests with an empty folder each."""

    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)


REAL_GPU = os.environ.get("RELIGN_TEST_GPU") == "1"


class OnGpu(unittest.TestCase):
    """Tests on the emulated driver, whose GPU is the process, so that tensors are PyTorch's on the CPU.

    With RELIGN_TEST_GPU=1 they run on a GPU instead.
    """

    def setUp(self):
        super().setUp()
        if REAL_GPU:
            return
        emulated = os.environ.get("RELIGN_EMULATED_DRIVER", "")
        if not emulated:
            self.skipTest("RELIGN_EMULATED_DRIVER is not set")
        chosen = {"RELIGN_LIBCUDA": emulated, "RELIGN_LIBNVRTC": emulated}
        for patch in (mock.patch.dict(os.environ, chosen), mock.patch.object(_cuda, "DEVICE", "cpu")):
            patch.start()
            self.addCleanup(patch.stop)
