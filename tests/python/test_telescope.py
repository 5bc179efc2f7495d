"""The example of a telescope: batoid's rays against the numbers of the real one and against theory, and its procedure."""

import importlib.util
import math
import pathlib
import sys
import unittest

import numpy as np
from support import relign_bench

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "telescope"
BATOID = importlib.util.find_spec("batoid") is not None
NEEDED = "batoid is not installed: pip install batoid"
F_NUMBER, FOCAL_LENGTH_M = 1.234, 10.31  # of the Rubin telescope (LSST Science Book, 2009)
sys.path.insert(0, str(FOLDER))
import telescope  # noqa: E402

optics = telescope.optics


def moved(axis, value):
    values = [0.0] * len(telescope.AXES)
    values[axis] = value
    return values


def rms_nm(values):
    return float(np.sqrt(np.sum(telescope.residuals_nm(values) ** 2)))


@unittest.skipUnless(BATOID, NEEDED)
class Physics(unittest.TestCase):
    def test_focal_length_is_that_of_the_telescope(self):
        import batoid
        small = math.radians(0.01)
        ends = []
        for field in (-small, small):
            rays = batoid.RayVector.asPolar(optics.design(), theta_x=field, theta_y=0.0, wavelength=optics.WAVELENGTH_M,
                                            outer=0.5, inner=0.0, nrad=5, naz=20)
            optics.design().trace(rays)
            ends.append(rays.x.mean())
        self.assertAlmostEqual(abs(ends[1] - ends[0]) / (2 * small) / FOCAL_LENGTH_M, 1, delta=0.005)

    def test_a_donut_is_as_large_as_the_cone_of_light(self):
        """The rim is at the tangent of the angle whose sine is 1 / 2N, and the hole's share of it that of the first mirror."""
        places = optics.footprints_m(optics.design())
        x, y, open_, *_ = optics.pupil()
        radius = np.hypot(x, y)
        for corner in range(4):
            for half in range(2):
                away = places[corner, half] - places[corner, half].mean(0)
                distance = np.hypot(*away.T)
                rim = np.median(distance[radius > 0.995])
                hole = np.median(distance[radius < optics.OBSCURED + 0.005])
                self.assertAlmostEqual(rim / optics.DEFOCUS_M / math.tan(math.asin(0.5 / F_NUMBER)), 1, delta=0.03)
                self.assertAlmostEqual(hole / rim, optics.OBSCURED, delta=0.05)
            self.assertGreater(open_[corner].mean(), 0.5)

    def test_defocus_of_the_camera_bends_the_wave_by_the_law_of_the_cone(self):
        """A shift dz changes the path of the ray at the angle u by dz (1 - cos u): weighted over the pupil, without piston."""
        dz = 1e-5
        slope = (telescope.residuals_nm(moved(7, 1e3 * dz)) - telescope.residuals_nm(moved(7, -1e3 * dz))) / 2
        x, y, weights = optics.APERTURE
        sine = np.hypot(x, y) / (2 * F_NUMBER)  # the sine condition
        wave = 1e9 * dz * (1 - np.sqrt(1 - sine**2))
        wave -= weights @ wave
        self.assertAlmostEqual(np.sqrt(np.sum(slope**2)) / np.sqrt(weights @ wave**2), 1, delta=0.05)

    def test_the_design_is_at_its_best(self):
        best = rms_nm([0.0] * len(telescope.AXES))
        self.assertLess(best, 160)
        for axis, (_, _, half) in enumerate(telescope.AXES):
            for sign in (-1, 1):
                self.assertGreater(rms_nm(moved(axis, sign * 0.2 * half)), best)

    def test_effects_of_small_moves_add_up(self):
        design = telescope.residuals_nm([0.0] * len(telescope.AXES))
        one, other = moved(0, 0.1), moved(8, 0.002)
        both = [a + b for a, b in zip(one, other)]
        parts = telescope.residuals_nm(one) + telescope.residuals_nm(other) - 2 * design
        whole = telescope.residuals_nm(both) - design
        self.assertLess(np.linalg.norm(whole - parts), 0.02 * np.linalg.norm(whole))

    def test_tiles_keep_the_light(self):
        image = optics.donuts(optics.design(), 0.7)
        self.assertEqual(image.shape, (2 * telescope.TILE, 4 * telescope.TILE))
        self.assertAlmostEqual(image.sum(), 2 * optics.pupil()[2].mean(1).sum(), delta=0.01)


@unittest.skipUnless(BATOID, NEEDED)
class Scene(unittest.TestCase):
    def bench(self):
        return relign_bench.Bench(str(FOLDER / "telescope.py"), "declared", noise_level_parameters={"start": 0.4}, threads=1)

    def test_the_procedure_ends_near_the_own_optimum(self):
        trial = self.bench().run(str(FOLDER / "procedure.py"), steps=5, protocol="blind", instance=2)
        self.assertTrue(trial.ended_well, trial.message)
        self.assertEqual(trial.score.label, "wavefront error in nm")
        self.assertLess(trial.errors()[-1], 250)
        self.assertLess(trial.errors()[-1], 1.5 * trial.summary["own_optimum_mse"])

    def test_no_pose_near_the_own_optimum_is_better(self):
        random = np.random.default_rng(1)
        drawn = {name: sigma * np.clip(random.standard_normal(), -telescope.CUT, telescope.CUT)
                 for name, (sigma, *_) in telescope.UNCERTAIN.items()}
        built = telescope.Built(drawn)
        pose, score, _ = built.own_optimum(0)
        self.assertLess(score, 0.2 * built.score(telescope.NOMINAL_POSE, 0)[0])
        for size in (0.001, 0.02):
            for _ in range(20):
                beside = np.clip(np.asarray(pose) + size * random.standard_normal(len(pose)), 0, 1)
                self.assertGreater(built.score(beside, 0)[0], 0.99 * score)

    def test_extreme_poses_have_finite_pixels_and_scores(self):
        built = telescope.Built({"M1_Z4": 5e4})
        for pose in ([0.0] * 10, [1.0] * 10, [0.0, 1.0] * 5):
            self.assertTrue(np.isfinite(built.capture(pose, 3)).all())
            self.assertLessEqual(built.score(pose, 0)[0], telescope.WORST_NM)

    def test_unknown_quantities_are_refused(self):
        with self.assertRaisesRegex(ValueError, "unknown quantity 'M4_Z4'"):
            telescope.Telescope().mount({"M4_Z4": {"value": 1.0}})


class Package(unittest.TestCase):
    def test_a_missing_package_is_named(self):
        if BATOID:
            self.skipTest("batoid is installed")
        with self.assertRaisesRegex(Exception, "pip install batoid"):
            relign_bench.Bench(str(FOLDER / "telescope.py"), "declared", threads=1)


if __name__ == "__main__":
    unittest.main()
