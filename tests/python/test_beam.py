"""The example of a particle beam: tracked by Cheetah, compared with products of matrices, and its procedure."""

import importlib.util
import math
import os
import pathlib
import sys
import unittest
from unittest import mock

import numpy as np
from support import relign_bench

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "beam"
sys.path.insert(0, str(FOLDER))
import beam  # noqa: E402

CHEETAH = importlib.util.find_spec("cheetah") is not None
NEEDED = "Cheetah is not installed: tests/python/requirements-others.txt pins it"


def plane(k1, length):
    """The matrix of a quadrupole in one plane: focusing for k1 above 0 (Wiedemann, Particle Accelerator Physics)."""
    root = math.sqrt(abs(k1))
    if root == 0:
        return np.array([[1, length], [0, 1]])
    c, s = (math.cos, math.sin) if k1 > 0 else (math.cosh, math.sinh)
    turn = -math.copysign(root, k1) * s(root * length)
    return np.array([[c(root * length), s(root * length) / root], [turn, c(root * length)]])


def by_matrices(quantities, settings, axis):
    """Mean and size on the screen in um: thick quadrupoles about their own axes, drifts, and kicks."""
    q = {name: quantities.get(name, beam.DESIGN.get(name, 0.0)) for name in beam.UNCERTAIN}
    mean = 1e-3 * np.array([q[f"in_mu_{axis}"], q[f"in_mu_p{axis}"]])
    spread = np.diag((1e-3 * np.array([q[f"in_sigma_{axis}"], q[f"in_sigma_p{axis}"]])) ** 2)
    for place in beam.LATTICE_M:
        name, length = ("drift", place) if isinstance(place, float) else place
        offset, kick, strength = 0.0, 0.0, 0.0
        if name.startswith("Q"):
            strength = settings[name] if axis == "x" else -settings[name]
            offset = 1e-3 * q[f"{name}_{axis}"]
        if name == {"x": "CH", "y": "CV"}[axis]:
            kick = 1e-3 * settings[name]
        matrix = plane(strength, length)
        mean = matrix @ (mean - [offset, 0]) + [offset, kick]
        spread = matrix @ spread @ matrix.T
    return 1e6 * mean[0] - 1000 * q[f"screen_{axis}"], 1e6 * math.sqrt(spread[0, 0])


@unittest.skipUnless(CHEETAH, NEEDED)
class Physics(unittest.TestCase):
    def test_beams_equal_products_of_matrices(self):
        random = np.random.default_rng(5)
        for _ in range(5):
            quantities = {name: random.uniform(low, high) for name, (low, high, *_) in beam.UNCERTAIN.items()}
            pose = random.uniform(0, 1, len(beam.AXES))
            settings = {name: low + p * (high - low) for p, (name, _, low, high) in zip(pose, beam.AXES)}
            found = beam.Area(quantities, 0.0).beam_um(pose)
            expected = [*by_matrices(quantities, settings, "x"), *by_matrices(quantities, settings, "y")]
            np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-3)


@unittest.skipUnless(CHEETAH, NEEDED)
class Scene(unittest.TestCase):
    def test_the_procedure_improves_and_no_pose_is_better_than_the_optimum(self):
        exact = {"start": 0.0, "movement_std": 0.0}
        bench = relign_bench.Bench(str(FOLDER / "beam.py"), "declared", noise_level_parameters=exact, threads=1)
        trial = bench.run(str(FOLDER / "procedure.py"), steps=30, protocol="blind", instance=1)
        self.assertTrue(trial.ended_well, trial.message)
        self.assertEqual(trial.score.label, "beam difference in um")
        self.assertLess(trial.errors()[-1], 0.5 * trial.errors()[0])
        self.assertGreaterEqual(trial.errors("commanded").min() + 1e-6, trial.summary["own_optimum_mse"])


class Package(unittest.TestCase):
    def test_a_missing_package_is_named(self):
        if CHEETAH:
            self.skipTest("Cheetah is installed")
        here = mock.patch.dict(os.environ, {"RELIGN_PYTHON": sys.executable})
        with here, self.assertRaisesRegex(Exception, "pip install cheetah-accelerator"):
            relign_bench.Bench(str(FOLDER / "beam.py"), "declared", threads=1)


if __name__ == "__main__":
    unittest.main()
