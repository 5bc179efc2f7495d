"""The example of a telescope: batoid's rays against the numbers of the real one and against theory, and its procedure."""

import importlib.util
import math
import os
import pathlib
import subprocess
import sys
import unittest

import numpy as np
from support import relign_bench

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "telescope"
BATOID = importlib.util.find_spec("batoid") is not None
NEEDED = "batoid is not installed: tests/python/requirements-others.txt pins it"
F_NUMBER, FOCAL_LENGTH_M = 1.234, 10.31  # of the Rubin telescope (LSST Science Book, 2009)
sys.path.insert(0, str(FOLDER))
import telescope  # noqa: E402

optics = telescope.optics


def moved(axis, value):
    values = [0.0] * len(telescope.AXES)
    values[axis] = value
    return values


def sag(r2, radius, conic, *coefficients):
    """Of a surface of revolution at a squared distance from its axis; coefficients of r^4, r^6, ..."""
    base = r2 / (radius * (1 + np.sqrt(1 - (1 + conic) * r2 / radius**2)))
    return base + sum(c * r2 ** (i + 2) for i, c in enumerate(coefficients))


def meet(p, d, shape):
    """Distances along rays to a surface about the origin by Newton's method, and its normals there."""
    s = -p[:, 2] / d[:, 2]
    step = 1e-4
    for _ in range(12):
        q = p + s[:, None] * d
        r2 = q[:, 0] ** 2 + q[:, 1] ** 2
        bend = (sag(r2 + step, *shape) - sag(r2 - step, *shape)) / step  # by r^2, times two
        normal = np.stack([-q[:, 0] * bend, -q[:, 1] * bend, np.ones_like(s)], axis=1)
        s = s - (q[:, 2] - sag(r2, *shape)) / np.sum(normal * d, axis=1)
    return s, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def glass():
    """Index of fused silica at the wavelength (Sellmeier; Malitson 1965)."""
    l2 = (1e6 * optics.WAVELENGTH_M) ** 2
    terms = ((0.696183020, 0.00467926519), (0.407925877, 0.0135122244), (0.897464057, 97.9323636))
    return math.sqrt(1 + sum(b * l2 / (l2 - c) for b, c in terms))


FLAT = (1e12, 0)
SURFACES = [  # vertex in m, shape, None of a mirror or whether glass is behind it
    ("M1", 0.0, (19.835, -1.215, 0, -1.381e-9), None), ("M2", 6.1562006, (6.788, -0.222, 0, 1.274e-5, 9.68e-7), None),
    ("M3", -0.2338, (8.3445, 0.155, 0, 4.5e-7, 8.15e-9), None),
    *((name, 3.3974725882045593 + z, shape, within) for name, z, shape, within in (
        ("L1", 0, (2.824, 0), True), ("L1", 0.08223, (5.021, 0), False), ("L2", 0.49487202, FLAT, True),
        ("L2", 0.52487202, (2.529, -1.57, 0, -0.001656), False), ("filter", 0.87445202, (5.632, 0), True),
        ("filter", 0.89235202, (5.606, 0), False), ("L3", 0.94345202, (3.169, -0.962), True),
        ("L3", 1.00345202, (-13.36, 0), False), ("detector", 1.03195202, FLAT, False)))]


def by_hand(p, d, m2_shift_m=(0, 0, 0), m2_rx=0.0):
    """Places on the detector and optical paths by a ray tracer of a few lines, from the prescription of the telescope."""
    p, d, path, n = p.copy(), d.copy(), np.zeros(len(p)), 1.0
    c, s = math.cos(m2_rx), math.sin(m2_rx)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    for name, z, shape, within in SURFACES:
        vertex = np.array([0, 0, z]) + (m2_shift_m if name == "M2" else 0)
        frame = turn if name == "M2" else np.eye(3)
        distance, normal = meet((p - vertex) @ frame, d @ frame, shape)
        normal = normal @ frame.T
        p, path = p + distance[:, None] * d, path + n * distance
        cosine = np.sum(d * normal, axis=1, keepdims=True)
        after = n if within is None else glass() if within else 1.0
        if within is None:
            d = d - 2 * cosine * normal
        else:
            d = n / after * d + (np.sqrt(1 - (n / after) ** 2 * (1 - cosine**2)) - n / after * cosine) * normal
        n = after
    return p, path


def rms_nm(values):
    return float(np.sqrt(np.sum(telescope.residuals_nm(values) ** 2)))


@unittest.skipUnless(BATOID, NEEDED)
class Physics(unittest.TestCase):
    def test_rays_equal_those_of_a_ray_tracer_by_hand_when_m2_moves(self):
        rays = optics.launched()[1]
        for shift, rx in (((0, 0, 0), 0.0), ((1e-3, -5e-4, 1e-4), 0.0), ((0, 0, 0), math.radians(30 / 3600))):
            r, _, t = optics.traced(optics.telescope(m2=(*shift, rx, 0)), 1)
            place, path = by_hand(rays.r, rays.v, shift, rx)
            np.testing.assert_allclose(r.reshape(-1, 3)[:, :2], place[:, :2], atol=1e-9)
            np.testing.assert_allclose(t.ravel() - t[0, 0], path - path[0], atol=1e-9)

    def test_the_score_equals_zernike_coefficients_by_batoid(self):
        import batoid
        values = moved(0, 0.5)
        values[8] = 0.005
        optic = telescope.telescope_at(values, {"M1": [0.0, 0.0, 80.0] + [0.0] * 5})
        x, y, weights = optics.FIELDS
        found = (optics.residuals_nm(optic).reshape(len(x), -1) ** 2).sum(1) / weights
        for field in (0, 7, 16):
            angles = np.radians(optics.FIELD_DEG * np.array([x[field], y[field]]))
            waves = batoid.zernike(optic, *angles, optics.WAVELENGTH_M, nx=64, jmax=66, eps=optics.OBSCURED)
            self.assertAlmostEqual(math.sqrt(found[field]), 1e9 * optics.WAVELENGTH_M * np.linalg.norm(waves[4:]), delta=1.0)

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
        self.assertEqual(trial.score.further, (("FWHM", "arcsec"),))
        best, last = trial.summary["own_optimum_further_scores"][0], trial.summary["further_score_1"][-1]
        self.assertGreater(best, 0.04)
        self.assertLess(last, 2 * best)

    def test_a_star_out_of_focus_is_as_wide_as_the_cone(self):
        built, defocus_mm, z = telescope.Built({}), 0.2, 7  # the camera's
        self.assertEqual(telescope.AXES[z][0], "camera_z")
        pose = [0.5] * 10
        pose[z] = 0.5 + defocus_mm / telescope.AXES[z][2] / 2
        # Rays meet at the sine of their place in the pupil: the mean of tan^2 over a ring, half of it along one axis.
        edge, hole = 1 / (2 * F_NUMBER) ** 2, optics.OBSCURED**2
        squares = math.log((1 - edge * hole) / (1 - edge)) / (edge * (1 - hole)) - 1
        deviation_m = 1e-3 * defocus_mm * math.sqrt(squares / 2)
        expected = math.degrees(2.355 * deviation_m / FOCAL_LENGTH_M) * 3600
        self.assertAlmostEqual(built.further_score(pose, 0, 0) / expected, 1, delta=0.03)

    def test_no_pose_near_the_own_optimum_is_better(self):
        random = np.random.default_rng(1)
        drawn = {name: sigma * np.clip(random.standard_normal(), -telescope.CUT, telescope.CUT)
                 for name, (sigma, *_) in telescope.UNCERTAIN.items()}
        built = telescope.Built(drawn)
        pose, score, _ = built.own_optimum(0)
        self.assertLess(score, 0.2 * built.score([0.5] * 10, 0)[0])
        for size in (0.001, 0.02):
            for _ in range(20):
                beside = np.clip(np.asarray(pose) + size * random.standard_normal(len(pose)), 0, 1)
                self.assertGreater(built.score(beside, 0)[0], 0.99 * score)

    def test_bent_mirrors_make_up_for_their_figures(self):
        random = np.random.default_rng(2)
        errors = {f"{mirror}_Z{j}": 20 * random.standard_normal() for mirror in telescope.MIRRORS for j in telescope.ZERNIKES}
        rigid, bent = telescope.Built(errors), telescope.Built(errors, bending=True)
        self.assertEqual(len(telescope.axes(True)), 50)
        self.assertEqual(rigid.score([0.5] * 10, 0), bent.score([0.5] * 50, 0))
        moves = {}  # back to the design: the figure's errors with the other sign
        for axis, (name, _, half) in enumerate(telescope.axes(True)):
            mirror, _, rest = name.partition("_bend_")
            if f"{mirror}_{rest}" in errors:
                moves[axis] = 0.5 - errors[f"{mirror}_{rest}"] / half / 2
        back = [moves.get(axis, 0.5) for axis in range(50)]
        self.assertEqual(len(moves), len(errors))
        self.assertAlmostEqual(bent.score(back, 0)[0], telescope.Built({}).score([0.5] * 10, 0)[0], places=6)
        pose, score, _ = bent.own_optimum(0)
        self.assertLess(score, rigid.own_optimum(0)[1])
        self.assertLess(score, bent.score(back, 0)[0])
        for _ in range(20):
            beside = np.clip(np.asarray(pose) + 0.01 * random.standard_normal(50), 0, 1)
            self.assertGreater(bent.score(beside, 0)[0], 0.99 * score)

    def test_all_fifty_axes_are_moved_and_reported(self):
        bench = relign_bench.Bench(str(FOLDER / "telescope.py"), "declared", scene_parameters={"bending": True},
                                   noise_level_parameters={"start": 0.4}, threads=1)
        trial = bench.run("nlopt-bobyqa", steps=3, protocol="blind", instance=2)
        self.assertTrue(trial.ended_well, trial.message)
        self.assertEqual([len(step["true_pose"]) for step in trial.steps], [50] * 4)

    def test_photons_are_as_many_as_declared_and_scatter_as_photons(self):
        built = telescope.Built({"photons": 2e5})
        frame, mean = (image * 1000.0 for image, _ in (built.capture([0.5] * 10, 7), built.render_noise_free([0.5] * 10)))
        np.testing.assert_array_equal(frame, built.capture([0.5] * 10, 7)[0] * 1000.0)
        self.assertAlmostEqual(((frame - mean) ** 2 / mean).mean(), 1, delta=0.05)
        light = (mean - telescope.BACKGROUND).reshape(2, telescope.TILE, 4, telescope.TILE).sum((1, 3)) / 2e5
        np.testing.assert_allclose(light, 0.925, atol=0.01)  # the lenses at the corner take the rest

    def test_extreme_poses_have_finite_pixels_and_scores(self):
        built = telescope.Built({"M1_Z4": 5e4})
        for pose in ([0.0] * 10, [1.0] * 10, [0.0, 1.0] * 5):
            self.assertTrue(np.isfinite(built.capture(pose, 3)[0]).all())
            self.assertLessEqual(built.score(pose, 0)[0], telescope.WORST_NM)

    def test_unknown_quantities_are_refused(self):
        with self.assertRaisesRegex(ValueError, "unknown quantity 'M4_Z4'"):
            telescope.Telescope().mount({"M4_Z4": {"value": 1.0}})


class Package(unittest.TestCase):
    def test_a_missing_package_is_named(self):
        code = "import sys; sys.modules['batoid'] = None; import telescope; telescope.Telescope().reference()"
        path = os.pathsep.join(filter(None, sys.path))
        done = subprocess.run([sys.executable, "-B", "-c", code], cwd=FOLDER, capture_output=True, text=True, check=False,
                              env={**os.environ, "PYTHONPATH": path})
        self.assertIn("batoid is not installed: pip install batoid", done.stderr.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
