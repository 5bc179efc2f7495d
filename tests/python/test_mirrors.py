"""The example of X-ray mirrors: its formulas against exact rays and a diffraction integral, its scene, its procedure."""

import math
import os
import pathlib
import random
import subprocess
import sys
import unittest

from support import np, relign_bench

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "mirrors"
sys.path.insert(0, str(FOLDER))
import mirrors  # noqa: E402
import optics  # noqa: E402

V, H = mirrors.MIRRORS["V"], mirrors.MIRRORS["H"]
PROCEDURE = str(FOLDER / "procedure.py")
# As far as the travel and its zeros go: pitch in rad, height in m, relative curvature at both ends.
POSES = ((0, 0, 0, 0), (8e-4, 0, 0, 0), (-8e-4, 0, 0, 0), (0, 2e-4, 0, 0), (0, -2e-4, 0, 0), (0, 0, 0.4, 0.4),
         (0, 0, -0.4, -0.4), (0, 0, 0.4, -0.4), (0, 0, -0.4, 0.4), (3e-4, 5e-5, 0.1, -0.05), (8e-4, -8e-5, -0.4, -0.4),
         (-8e-4, 8e-5, 0.4, 0.4))


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


class Exact:
    """An elliptical cylinder in three dimensions, by its definition: the sum of the distances to two lines is constant.

    Args:
        centre: Place of the mirror's centre, m.
        beam: Direction of the ray that arrives there from the source.
        normal: Direction across the beam to which the mirror turns it.
        roll: By which the mirror is turned about the beam, rad.
        misplaced: pitch, height and relative curvatures as those of optics.Mirror.rays.
    """

    LENGTH, ANGLE, PIVOT = 0.1, 3e-3, -0.1

    def __init__(self, source, focus, centre, beam, normal, roll=0.0, misplaced=(0, 0, 0, 0)):
        aside = np.cross(beam, normal)
        normal = math.cos(roll) * normal + math.sin(roll) * aside
        s, c = math.sin(self.ANGLE), math.cos(self.ANGLE)
        self.along, self.up = c * beam + s * normal, c * normal - s * beam  # axes of the mirror at its design place
        self.behind = (c * c - s * s) * beam + 2 * s * c * normal  # direction to the focus
        self.centre, self.sum = centre, source + focus
        self.foci = np.array([[-source * c, source * s], [focus * c, focus * s]])
        self.pitch, self.height, upstream, downstream = misplaced
        centre_curvature = s * (1 / source + 1 / focus) / 2  # of the ellipse
        # The change of curvature, linear from end to end, integrated twice.
        self.bend = np.polynomial.Polynomial([centre_curvature * (upstream + downstream) / 2,
                                              centre_curvature * (downstream - upstream) / self.LENGTH]).integ(2)

    def own(self, places):
        """In the ellipse's coordinates: those of the mirror before it was turned about its pivot, lifted and bent."""
        x, z = (places - self.centre) @ self.along - self.PIVOT, (places - self.centre) @ self.up - self.height
        s, c = math.sin(self.pitch), math.cos(self.pitch)
        x, z = self.PIVOT + c * x + s * z, c * z - s * x
        return np.stack([x, z - self.bend(x)], axis=-1)

    def outside(self, places):
        own = self.own(places)
        return sum(np.linalg.norm(own - focus, axis=-1) for focus in self.foci) - self.sum

    def reflect(self, places, directions, slopes=0.0):
        """Where rays meet the mirror, x there, and their directions behind it; slopes are added to those of the surface."""
        low = (self.centre - places) @ self.along / (directions @ self.along) - 0.1
        high = low + 0.2
        for _ in range(60):
            middle = (low + high) / 2
            inside = self.outside(places + middle[:, None] * directions) < 0
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        places = places + low[:, None] * directions
        own = self.own(places)
        gx, gz = sum(unit(own - focus) for focus in self.foci).T
        gx = gx - gz * self.bend.deriv()(own[:, 0])
        turn = self.pitch + np.arctan(-gx / gz) + slopes  # of the surface
        normals = np.cos(turn)[:, None] * self.up - np.sin(turn)[:, None] * self.along
        return places, own[:, 0], directions - 2 * np.sum(directions * normals, axis=1, keepdims=True) * normals


def deviations(mirror, slit, misplaced=(0, 0, 0, 0), slopes=0.0, source_height=0.0):
    """Exact: where rays through these places in the slit miss the focus, and x where they meet the mirror."""
    beam, normal = np.array([0.0, 0, 1]), np.array([0.0, 1, 0])
    exact = Exact(mirror.source, mirror.focus, np.zeros(3), beam, normal, misplaced=misplaced)
    start = np.array([0, source_height, -mirror.source])
    directions = unit(np.outer(slit, normal) - start)
    places, x, directions = exact.reflect(np.tile(start, (len(slit), 1)), directions, slopes)
    return on_screen(places, directions, mirror.focus * exact.behind, exact.behind) @ np.cross(exact.behind, [1.0, 0, 0]), x


def on_screen(places, directions, focus, normal):
    """From the focus to where rays meet the plane across the beam there."""
    way = (focus - places) @ normal / (directions @ normal)
    return places + way[:, None] * directions - focus


def spots(roll, misplaced_v=(0, 0, 0, 0), misplaced_h=(0, 0, 0, 0), rays=31):
    """Exact: y and x in the focal plane of rays through an evenly lit slit, by V and then H."""
    half = mirrors.SLIT_M / 2 * (1 - 1 / rays)
    across, high = (grid.ravel() for grid in np.meshgrid(*[np.linspace(-half, half, rays)] * 2))
    start = np.array([0, 0, -V.source])
    first = Exact(V.source, V.focus, np.zeros(3), np.array([0.0, 0, 1]), np.array([0.0, 1, 0]), misplaced=misplaced_v)
    aside, centre = np.array([1.0, 0, 0]), (H.source - V.source) * first.behind
    second = Exact(H.source, H.focus, centre, first.behind, aside, roll, misplaced_h)
    straight = Exact(H.source, H.focus, centre, first.behind, aside)
    # H's slit is in its own plane, a little farther from the source.
    through = np.stack([across * V.source / H.source, high, np.zeros(len(high))], axis=1)
    places, directions = np.tile(start, (len(high), 1)), unit(through - start)
    for mirror in (first, second):
        places, _, directions = mirror.reflect(places, directions)
    missed = on_screen(places, directions, centre + H.focus * straight.behind, straight.behind)
    y = np.cross(first.behind, aside)
    return missed @ y, missed @ np.cross(y, straight.behind)


def profile(mirror, slit, rays=500):
    """Places in the focal plane and the light there, by the diffraction integral over the mirror in place."""
    beam, normal = np.array([0.0, 0, 1]), np.array([0.0, 1, 0])
    exact = Exact(mirror.source, mirror.focus, np.zeros(3), beam, normal)
    through = slit * ((np.arange(rays) + 0.5) / rays - 0.5)
    start = np.array([0, 0, -mirror.source])
    places, _, _ = exact.reflect(np.tile(start, (rays, 1)), unit(np.outer(through, normal) - start))
    before = np.linalg.norm(places - start, axis=1)
    screen = np.linspace(-5, 5, 501) * mirrors.WAVELENGTH_M * mirror.focus / slit
    points = mirror.focus * exact.behind + np.outer(screen, np.cross(exact.behind, [1.0, 0, 0]))
    after = np.stack([np.linalg.norm(places - point, axis=1) for point in points])
    waves = np.exp(2j * math.pi / mirrors.WAVELENGTH_M * (before + after)) / np.sqrt(after)
    return screen, abs(waves.sum(axis=1)) ** 2


def fwhm(screen, light):
    above = np.flatnonzero(light >= light.max() / 2)
    ends = []
    for inside, outside in ((above[0], above[0] - 1), (above[-1], above[-1] + 1)):
        share = (light[inside] - light.max() / 2) / (light[inside] - light[outside])
        ends.append(screen[inside] + share * (screen[outside] - screen[inside]))
    return ends[1] - ends[0]


class Rays(unittest.TestCase):
    def test_the_ellipse_is_one(self):
        for mirror in (V, H):
            p, q, s, c = mirror.source, mirror.focus, math.sin(mirror.grazing), math.cos(mirror.grazing)
            for x in np.linspace(-0.05, 0.05, 11):
                z, r1, r2 = mirror.ellipse(x)
                self.assertAlmostEqual(r1, math.hypot(x + p * c, z - p * s), delta=1e-12)
                self.assertAlmostEqual(r2, math.hypot(x - q * c, z - q * s), delta=1e-12)
            self.assertAlmostEqual(2 * mirror.ellipse(1e-4)[0] / 1e-8 / mirror.curvature, 1, delta=1e-3)

    def test_rays_equal_exact_ones_over_the_travel(self):
        slit = np.linspace(-128e-6, 128e-6, 33)
        for mirror in (V, H):
            for pose in POSES:
                rays = mirror.rays(*pose)
                for place, missed, x in zip(slit, *deviations(mirror, slit, pose)):
                    found = optics.pencil(rays, place)
                    if abs(abs(x) - 0.05) > 1e-4:
                        self.assertEqual(found is None, abs(x) > 0.05, (pose, place, x))
                    if found is not None:
                        self.assertAlmostEqual(found, missed, delta=4e-8, msg=(pose, place))

    def test_flux_place_and_size_equal_those_of_exact_rays(self):
        slit = 130e-6 * ((np.arange(2000) + 0.5) / 1000 - 1)
        for mirror in (V, H):
            for pose in POSES:
                missed, x = deviations(mirror, slit, pose)
                met = abs(x) < 0.05
                light = optics.beam(mirror.rays(*pose), 260e-6)
                self.assertAlmostEqual(light.share, met.mean(), delta=1.5e-3, msg=pose)
                self.assertAlmostEqual(light.position, missed[met].mean(), delta=4e-8, msg=pose)
                self.assertAlmostEqual(light.deviation, missed[met].std(), delta=5e-9 + 1e-3 * missed[met].std(), msg=pose)
                self.assertAlmostEqual(light.spread, slit[met].std(), delta=2e-7, msg=pose)

    def test_pitch_defocuses_by_the_mirror_equation(self):
        # 1 / p + 1 / q = 2 / (R sin(grazing)): the focus moves along the beam, which converges by the slit's width.
        for mirror in (V, H):
            radius = 1 / mirror.curvature
            pitch, slit = 1e-6, 10e-6
            moved = 1 / (2 / (radius * math.sin(mirror.grazing + pitch)) - 1 / mirror.source) - mirror.focus
            expected = abs(moved) * slit / mirror.focus / math.sqrt(12)
            self.assertAlmostEqual(optics.beam(mirror.rays(pitch), slit).deviation / expected, 1, delta=5e-3)

    def test_mirrors_out_of_the_beam_reflect_nothing(self):
        self.assertEqual(optics.beam(V.rays(height=4e-4), 260e-6).share, 0)
        self.assertEqual(optics.beam(V.rays(pitch=-0.02), 260e-6).share, 0)


class Blur(unittest.TestCase):
    def test_a_roll_blurs_and_moves_the_focus_as_exact_rays_by_both_mirrors(self):
        aligned = (0, 0, 0, 0)
        cases = ((aligned, aligned), ((2e-5, 1e-5, 0, 0.01), (0, -1e-5, 0.01, 0)), ((0, 0, -0.1, -0.1), (0, 0, 0, 0.1)))
        for roll in (0.0, 2e-3, -8e-3):
            for pose_v, pose_h in cases:
                exact = spots(roll, pose_v, pose_h)
                lights = [optics.beam(mirror.rays(*pose), mirrors.SLIT_M) for mirror, pose in ((V, pose_v), (H, pose_h))]
                spreads = (lights[1].spread, lights[0].spread * H.focus / V.focus)
                for light, spread, rays in zip(lights, spreads, exact):
                    expected = math.hypot(light.deviation, optics.skew(roll, H.source, H.focus, spread))
                    self.assertAlmostEqual(expected, rays.std(), delta=1e-9 + 0.03 * rays.std(), msg=(roll, pose_v))
                sideways = optics.sideways(roll, H.grazing, H.focus)
                self.assertAlmostEqual(exact[0].mean() - lights[0].position, sideways, delta=5e-9 + 0.02 * abs(sideways))
                self.assertAlmostEqual(exact[1].mean(), lights[1].position, delta=2e-7)

    def test_diffraction_is_that_of_an_integral_over_the_mirror(self):
        # 2.5 %: the integral has the larger angles of the downstream end, which a slit of the same width has not.
        for mirror, slit in ((V, 260e-6), (H, 260e-6), (V, 120e-6)):
            found = optics.diffraction(mirrors.WAVELENGTH_M, mirror.focus, slit)
            self.assertAlmostEqual(found / fwhm(*profile(mirror, slit)), 1, delta=0.025)

    def test_squares_add_to_the_width_of_the_whole_profile(self):
        # Of a mirror in place: the diffraction integral, convolved with source and figure.
        for mirror, source in ((V, 20e-6), (H, 100e-6)):
            parts = (optics.source_image(source, mirror.source, mirror.focus), optics.figure_blur(2e-7, mirror.focus))
            screen, light = profile(mirror, 260e-6)
            blur = np.exp(-4 * math.log(2) * screen**2 / sum(part**2 for part in parts))
            expected = fwhm(screen, np.convolve(light, blur, "same"))
            aligned = optics.beam(mirror.rays(), 260e-6)
            diffraction = optics.diffraction(mirrors.WAVELENGTH_M, mirror.focus, aligned.width)
            self.assertAlmostEqual(optics.width(aligned, *parts, diffraction) / expected, 1, delta=0.025)

    def test_slope_errors_blur_as_those_of_exact_rays(self):
        slopes = 2e-7 * np.random.default_rng(1).standard_normal(20000)
        for mirror in (V, H):
            missed, _ = deviations(mirror, 260e-6 * ((np.arange(20000) + 0.5) / 20000 - 0.5), slopes=slopes)
            self.assertAlmostEqual(optics.figure_blur(2e-7, mirror.focus) / (optics.FWHM * missed.std()), 1, delta=0.03)

    def test_the_source_is_imaged_as_by_exact_rays(self):
        for mirror in (V, H):
            missed, _ = deviations(mirror, np.linspace(-130e-6, 130e-6, 101), source_height=50e-6)
            self.assertAlmostEqual(missed.mean() / optics.source_image(50e-6, mirror.source, mirror.focus), 1, delta=0.01)


def draw(rng):
    """A pair as the scene declares it."""
    return mirrors.Pair({name: mean + sigma * min(max(rng.gauss(0, 1), -mirrors.CUT), mirrors.CUT)
                         for name, (mean, sigma, *_) in mirrors.UNCERTAIN.items()}, 0.03, 0.1)


class Scene(unittest.TestCase):
    def test_no_pose_is_better_than_the_optimum(self):
        rng = random.Random(3)
        for _ in range(30):
            pair = draw(rng)
            pose, best, error = pair.own_optimum(0)
            self.assertEqual(error, 0)
            self.assertTrue(all(0 < p < 1 for p in pose))
            self.assertLess(best, 0.5)
            for size in (1e-3, 0.01, 0.1, 0.5):
                for _ in range(20):
                    other = [p + size * rng.uniform(-1, 1) for p in pose]
                    self.assertGreaterEqual(pair.score(other, 0)[0], best - 1e-9)

    def test_readings_are_right_on_average(self):
        pair = draw(random.Random(4))
        pose = [p + 0.03 for p in pair.own_optimum(0)[0]]
        exact = pair.render_noise_free(pose)
        self.assertEqual(len(exact), len(mirrors.READINGS))
        self.assertEqual(exact[0], pair.score(pose, 0)[0])
        self.assertEqual(pair.capture(pose, 5), pair.capture(pose, 5))
        mean = np.mean([pair.capture(pose, seed) for seed in range(400)], axis=0)
        np.testing.assert_allclose(mean, exact, rtol=0.01, atol=0.02)

    def test_widths_and_places_equal_those_of_exact_rays_by_both_mirrors(self):
        # Hardly any source and figure, V's benders off by 5 and -3 um, H's pitch by 0.01 mrad and the roll by 6 mrad.
        off = {"V_up": 5.0, "V_down": -3.0, "H_pitch": 0.01, "H_roll": 6.0}
        pair = mirrors.Pair({f"{mirror}_{name}": 1e-6 for mirror in "VH" for name in ("source", "figure")})
        pose = [0.5 + off.get(name, 0.0) / (2 * half) for name, _, half, _ in mirrors.AXES]
        spot, *found = pair.render_noise_free(pose)
        for rays, width, place, mirror in zip(spots(6e-3, (0, 0, 0.005, -0.003), (1e-5, 0, 0, 0)), found, found[3:], (V, H)):
            diffraction = optics.diffraction(mirrors.WAVELENGTH_M, mirror.focus, mirrors.SLIT_M)
            self.assertAlmostEqual(width / (1e6 * math.hypot(optics.FWHM * rays.std(), diffraction)), 1, delta=0.01)
            self.assertAlmostEqual(place, 1e6 * rays.mean(), delta=0.1)
        self.assertAlmostEqual(spot, math.sqrt(found[0] * found[1]), delta=1e-9)  # all light is there

    def test_a_mirror_that_cuts_the_beam_in_half_makes_the_spot_wider(self):
        pose = list(mirrors.NOMINAL_POSE)
        pose[1] += 150 / 400  # V by 150 um: its lower end is in the middle of the beam
        spot, y, x, flux, *_ = mirrors.Pair({}).render_noise_free(pose)
        self.assertAlmostEqual(flux, 0.5, delta=0.03)
        self.assertAlmostEqual(spot / math.sqrt(y * x / 0.5), 1, delta=0.03)

    def test_pencil_beams_that_miss_a_mirror_are_at_the_edge_of_the_camera(self):
        pair = mirrors.Pair({})
        pose = list(mirrors.NOMINAL_POSE)
        pose[1] += 0.25  # V by 100 um: the lowest places of the slit are below the mirror
        pencils = pair.render_noise_free(pose)[6:]
        self.assertEqual(pencils[:2], [mirrors.CAMERA_UM] * 2)
        self.assertTrue(all(abs(y) < 150 for y in pencils[2:5]))
        self.assertTrue(all(abs(x) < 1e-6 for x in pencils[5:]))

    def test_far_poses_are_dark_and_never_nan(self):
        count = len(mirrors.AXES)
        for pose in ([-1] * count, [2] * count, [50, -50, 50] * 3, [1e4] * count, [0.5, 3] + [0.5] * (count - 2)):
            seen = mirrors.Pair({}, 0.03, 0.1).capture(pose, 1)
            self.assertTrue(np.isfinite(seen).all(), pose)
            self.assertEqual(seen[0], mirrors.FIELD_UM, pose)

    def test_unknown_and_impossible_quantities_are_refused(self):
        scene = mirrors.Mirrors.__new__(mirrors.Mirrors)
        with self.assertRaisesRegex(ValueError, "unknown quantity 'V_gian'; quantities: V_pitch_zero, V_height_zero"):
            scene.mount({"V_gian": {"value": 1}})
        with self.assertRaisesRegex(ValueError, "'H_gain' is 0, but must be above 0"):
            scene.mount({"H_gain": {"value": 0.0}})

    def test_the_checks_of_plugins_pass_without_a_warning(self):
        program = os.environ.get("RELIGN_PROGRAM")
        if not program:
            self.skipTest("RELIGN_PROGRAM does not name the program")
        command = [program, "plugin", "check", str(FOLDER / "mirrors.py")]
        environment = {"RELIGN_PYTHON": sys.executable, **os.environ}
        found = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        self.assertIn("0 with a warning, 0 failed", found.stdout)


class Procedure(unittest.TestCase):
    def test_it_brings_all_to_the_specification(self):
        bench = relign_bench.Bench(str(FOLDER / "mirrors.py"), "declared", noise_level_parameters={"start": 0.5}, threads=1)
        above = []
        for instance in range(8):
            trial = bench.run(PROCEDURE, steps=40, protocol="blind", instance=instance)
            self.assertTrue(trial.ended_well, trial.message)
            self.assertEqual(trial.score.label, "spot size in um")
            self.assertLess(len(trial.steps), 35)
            self.assertLess(trial.errors()[-1], 0.5)
            self.assertGreaterEqual(trial.errors("commanded").min() + 1e-9, trial.summary["own_optimum_mse"])
            above.append(trial.errors()[-1] - trial.summary["own_optimum_mse"])
        self.assertLess(sorted(above)[4], 0.04)

    def test_another_scene_is_refused(self):
        trial = relign_bench.Bench(str(FOLDER.parent / "fibre" / "fibre.py"), "declared", threads=1).run(PROCEDURE, steps=3)
        self.assertFalse(trial.ended_well)
        self.assertIn("expected the scene 'mirrors', with 9 axes and 16 readings, found 6 axes and 1 readings", trial.message)


if __name__ == "__main__":
    unittest.main()
