"""The example of an interferometer: fringes against LightPipes and sums, its optimum, its captures, its procedure."""

import importlib.util
import math
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
from support import relign_bench

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "interferometer"
sys.path.insert(0, str(FOLDER))
import interferometer  # noqa: E402
import optics  # noqa: E402

LIGHTPIPES = importlib.util.find_spec("LightPipes") is not None


def draw(random):
    """An interferometer as the scene declares it."""
    drawn = {name: sigma * np.clip(random.standard_normal(), -interferometer.CUT, interferometer.CUT)
             for name, (sigma, *_) in interferometer.UNCERTAIN.items()}
    return interferometer.Interferometer({**drawn, "brightness": 0.7})


def near(pose, random, size):
    return [p + size * random.uniform(-1, 1) for p in pose]


@unittest.skipUnless(LIGHTPIPES, "LightPipes is not installed: tests/python/requirements-others.txt pins it")
class LightPipes(unittest.TestCase):
    SIDE_MM, POINTS = 9.0, 1250

    def test_fringes_equal_those_of_propagated_fields(self):
        import LightPipes as lp

        step, angles, shifts = self.SIDE_MM / self.POINTS, [3e-5, 5e-5], [7, -5]
        waist = [shift * step for shift in shifts]
        x, y = (place - interferometer.TO_WAIST * angle for place, angle in zip(waist, angles))
        quantities = {"laser_x": x, "laser_y": y, "laser_ax": 0.03, "laser_ay": 0.05, "divergence": 0.02, "radius": 5,
                      "magnification": 0.4, "arm": 8, "M1x_zero": 0.1, "Lx_zero": -0.02, "Ly_zero": 0.03, "Lz_zero": 0.7}
        tilts, along, across = [0.1, -0.1, 0.15, 0.05], 0.5, 0.03
        one = interferometer.Interferometer(quantities)
        along_all = interferometer.DESIGN_ALONG + along + 0.7

        def laser():
            field = lp.Begin(self.SIDE_MM, optics.WAVELENGTH, self.POINTS)
            # Moved by whole points, since GaussBeam interpolates.
            field.field = np.roll(lp.GaussBeam(field, 1.05 * interferometer.RADIUS).field, shifts[::-1], axis=(0, 1))
            field = lp.Forvard(self.tilted(field, angles, waist), -interferometer.TO_WAIST)
            return lp.Lens(field, -1000 / 0.02, x_shift=x, y_shift=y)

        turns = [1e-3 * turn for turn in (2 * 0.2, -math.sqrt(2) * 0.1, 2 * 0.15, math.sqrt(2) * 0.05)]
        mirrors = self.tilted(lp.Forvard(laser(), 100), turns[:2])
        mirrors = lp.Forvard(self.tilted(lp.Forvard(mirrors, 400), turns[2:]), 308)
        lens = lp.Lens(lp.Forvard(laser(), 200), 100.4)
        lens = lp.Lens(lp.Forvard(lens, 200.4 + along_all), 100, x_shift=0.01, y_shift=0.03)
        lens = lp.Forvard(lens, 400 - along_all)

        expected = [self.aligned(lens.field, one.telescope(along, across)), self.aligned(mirrors.field, one.mirrors(tilts))]
        found = [self.field(beam) for beam in (one.telescope(along, across), one.mirrors(tilts))]
        for phase in 2 * math.pi * np.arange(16) / 16:
            frames = [abs(a + b * np.exp(1j * phase)) ** 2 for a, b in (expected, found)]
            self.assertLess(abs(frames[0] - frames[1]).max() / frames[1].max(), 2e-6, phase)
        # And so does the overlap.
        lost = 1 - abs(np.vdot(*expected)) / np.linalg.norm(expected[0]) / np.linalg.norm(expected[1])
        self.assertAlmostEqual(optics.lost_visibility(one.telescope(along, across), one.mirrors(tilts)), lost, delta=1e-6)

    def places(self):
        return (np.arange(self.POINTS) - self.POINTS // 2) * self.SIDE_MM / self.POINTS

    def tilted(self, field, angles, centre=(0, 0)):
        waves = [np.exp(1j * optics.WAVE_NUMBER * a * (self.places() - c)) for a, c in zip(angles, centre)]
        field.field = field.field * np.outer(waves[1], waves[0])
        return field

    def field(self, beam):
        """At the grid's points, of unit power."""
        u = self.places()
        return np.outer(optics.profile(beam, 1, u), optics.profile(beam, 0, u)) * math.sqrt(2 / math.pi) / beam.radius

    def aligned(self, field, beam):
        """Of unit power, with the phase of our beam, since the phase of an arm is arbitrary."""
        field = field / np.linalg.norm(field) / (self.SIDE_MM / self.POINTS)
        turn = np.vdot(field, self.field(beam))
        return field * turn / abs(turn)


class Optics(unittest.TestCase):
    def test_overlaps_have_the_known_closed_forms(self):
        def lost(radius=0.9, place=0.0, angle=0.0):
            return 1 - optics.lost_visibility(optics.beam_of(0.9, 0), optics.beam_of(radius, 0, (place, 0), (0, angle)))

        self.assertAlmostEqual(lost(), 1, delta=1e-15)
        self.assertAlmostEqual(lost(place=0.4), math.exp(-0.5 * (0.4 / 0.9) ** 2), delta=1e-12)
        self.assertAlmostEqual(lost(angle=2e-4), math.exp(-((optics.WAVE_NUMBER * 2e-4 * 0.9) ** 2) / 8), delta=1e-9)
        self.assertAlmostEqual(lost(radius=0.5), 2 * 0.9 * 0.5 / (0.9**2 + 0.5**2), delta=1e-12)
        same = optics.beam_of(0.9, 0)
        self.assertAlmostEqual(optics.lost_visibility(same, same, (1, 1.21)), 1 - 2 * 1.1 / 2.21, delta=1e-12)

    def test_visibility_is_that_of_summed_frames(self):
        random = np.random.default_rng(2)
        camera = optics.Camera(128, 0.08)  # sees all the light
        for _ in range(20):
            one = draw(random)
            beams = one.beams(near(one.own_optimum(0)[0], random, 0.04))
            alone, wave = camera.fringes(*beams, one.powers)
            self.assertAlmostEqual(alone.sum() * 0.08**2, sum(one.powers), delta=1e-6)  # the power
            # At the brightest and the darkest phase; wave and light are in the same unit.
            phase = np.angle(wave.sum())
            most, least = ((alone + 2 * (wave * np.exp(-1j * p)).real).sum() for p in (phase, phase + math.pi))
            self.assertAlmostEqual((most - least) / (most + least), 1 - one.score_of(beams), delta=1e-6)
            totals = [(alone + 2 * (wave * np.exp(-2j * math.pi * k / 16)).real).sum() for k in range(16)]
            self.assertAlmostEqual(optics.visibility_of(totals), 1 - one.score_of(beams), delta=1e-6)

    def test_pixels_average_over_their_area(self):
        one, other = optics.beam_of(0.9, 100, (0.1, 0), (1e-3, 0)), optics.beam_of(0.8, -200, (0, 0.2), (0, -2e-3))
        camera = optics.Camera(8, 0.1, (0.3, -0.2))
        places = [c + 0.1 * ((np.arange(8 * 400) + 0.5) / 400 - 4) for c in (0.3, -0.2)]
        fields = [np.outer(optics.profile(beam, 1, places[1]), optics.profile(beam, 0, places[0])) * math.sqrt(2 / math.pi)
                  / beam.radius for beam in (one, other)]
        expected = (fields[0] * fields[1].conj()).reshape(8, 400, 8, 400).mean(axis=(1, 3))
        np.testing.assert_allclose(camera.average(one, other), expected, rtol=0, atol=2e-6)


class Scene(unittest.TestCase):
    def test_the_design_loses_nothing_and_no_pose_is_better_than_the_optimum(self):
        perfect = interferometer.Interferometer({})
        self.assertLess(perfect.score(interferometer.NOMINAL_POSE, 0)[0], 1e-9)
        random = np.random.default_rng(3)
        within = 0
        for _ in range(30):
            one = draw(random)
            pose, best, error = one.own_optimum(0)
            self.assertEqual(error, 0)
            self.assertTrue(all(0 < p < 1 for p in pose))
            within += best < 1e-4
            for size in (1e-4, 1e-3, 0.01, 0.1):
                for _ in range(20):
                    self.assertGreaterEqual(one.score(near(pose, random, size), 0)[0], best - 1e-9)
        self.assertGreaterEqual(within, 28)

    def test_captures_are_frames_of_a_period_and_the_measured_score(self):
        one = interferometer.Interferometer({"brightness": 0.8}, 0.02, 0.01)
        image, (measured,) = one.capture(interferometer.NOMINAL_POSE, 5)
        self.assertEqual((image.shape, image.dtype), ((256, 256), np.float32))
        again, (measured_again,) = one.capture(interferometer.NOMINAL_POSE, 5)
        np.testing.assert_array_equal(image, again)
        self.assertEqual(measured, measured_again)
        self.assertLess(measured, 0.03)
        clean, (exact,) = one.render_noise_free(interferometer.NOMINAL_POSE)
        self.assertAlmostEqual(clean[:64, :64].max(), 0.8, delta=0.02)  # in phase
        self.assertLess(clean[128:192, :64].max(), 1e-3)  # half a period later
        self.assertLess(exact, 1e-5)

    def test_the_measured_visibility_is_right_on_average(self):
        random = np.random.default_rng(4)
        one = interferometer.Interferometer({}, 0.02, 0.01)
        pose = near(interferometer.NOMINAL_POSE, random, 0.03)
        expected = one.render_noise_free(pose)[1][0]
        self.assertAlmostEqual(statistics.fmean(one.capture(pose, seed)[1][0] for seed in range(100)), expected, delta=2e-3)
        self.assertAlmostEqual(one.score(pose, 0)[0], expected, delta=0.01)

    def test_far_poses_are_dark_or_without_fringes_and_never_nan(self):
        one = interferometer.Interferometer({}, 0.02, 0.01)
        for pose in ([-1] * 6, [2] * 6, [0, 1, 1, 0, 0, 1], [50, -50, 50, -50, 5, 50], [1e4] * 6, [0.5] * 4 + [-20, 0.5]):
            image, (measured,) = one.capture(pose, 1)
            self.assertTrue(np.isfinite(image).all(), pose)
            self.assertTrue(0.9 < measured <= 1, pose)
            self.assertTrue(0.9 < one.score(pose, 0)[0] <= 1, pose)

    def test_unknown_and_impossible_quantities_are_refused(self):
        scene = interferometer.MachZehnder.__new__(interferometer.MachZehnder)
        with self.assertRaisesRegex(ValueError, "unknown quantity 'radios'; quantities: M1x_zero, M1y_zero"):
            scene.mount({"radios": {"value": 1}})
        with self.assertRaisesRegex(ValueError, "'balance' is -120, but must be above -100"):
            scene.mount({"balance": {"value": -120.0}})

    def test_a_missing_package_is_named_in_one_sentence(self):
        with mock.patch.object(optics, "np", None), self.assertRaisesRegex(ModuleNotFoundError, "pip install numpy$"):
            interferometer.MachZehnder.__new__(interferometer.MachZehnder).reference()


class Checks(unittest.TestCase):
    def checked(self, folder):
        """What the checks of plugins find in a scene."""
        program = os.environ.get("RELIGN_PROGRAM")
        if not program:
            self.skipTest("RELIGN_PROGRAM does not name the program")
        command = [program, "plugin", "check", str(folder / "interferometer.py")]
        environment = {"RELIGN_PYTHON": sys.executable, **os.environ}
        return subprocess.run(command, capture_output=True, text=True, env=environment, check=False).stdout

    def test_the_scene_passes_them(self):
        self.assertIn("0 with a warning, 0 failed", self.checked(FOLDER))

    def checked_with(self, text, other):
        """The same of a copy with another text."""
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(shutil.copytree(FOLDER, pathlib.Path(folder) / "copy"))
            source = (copy / "interferometer.py").read_text(encoding="utf-8")
            self.assertIn(text, source)
            (copy / "interferometer.py").write_text(source.replace(text, other), encoding="utf-8")
            return self.checked(copy)

    def test_a_reading_that_does_not_measure_the_score_is_found(self):
        found = self.checked_with("[1.0 if dark else 1 - min(visibility_of(totals), 1.0)]", "[visibility_of(totals)]")
        self.assertRegex(found, "its noise-free reading '1 - visibility' is .* at the nominal pose")

    def test_images_without_their_readings_are_refused(self):
        found = self.checked_with(", [1.0 if dark else 1 - min(visibility_of(totals), 1.0)]", "")
        self.assertIn("reference() returned ndarray, expected (pixels, readings), a tuple, since the scene has both", found)


class Environment(unittest.TestCase):
    def test_images_and_readings_are_observed_side_by_side(self):
        env = relign_bench.AlignmentEnv(str(FOLDER / "interferometer.py"), "declared", frame_stack=2, observation_size=128,
                                        threads=1)
        seen, _ = env.reset(seed=3)
        self.assertEqual({name: space.shape for name, space in env.observation_space.items()},
                         {"image": (2, 128, 128), "readings": (2, 1, 1)})
        seen, _, _, _, info = env.step(np.full(6, 0.1, np.float32))
        self.assertTrue(env.observation_space.contains(seen))
        self.assertEqual((seen["image"].dtype, seen["readings"].dtype), (np.uint8, np.float32))
        self.assertAlmostEqual(float(seen["readings"][-1, 0, 0]), float(info["measured_error"]), places=6)
        self.assertNotEqual(*seen["readings"][:, 0, 0])


class Procedure(unittest.TestCase):
    def test_it_brings_most_to_the_goal(self):
        start = {"start": 0.5}
        bench = relign_bench.Bench(str(FOLDER / "interferometer.py"), "declared", noise_level_parameters=start, threads=1)
        above = []
        for instance in range(5):
            trial = bench.run(str(FOLDER / "procedure.py"), steps=40, protocol="blind", instance=instance)
            self.assertTrue(trial.ended_well, trial.message)
            self.assertEqual(trial.score.label, "1 - visibility")
            self.assertGreaterEqual(trial.errors("commanded").min() + 1e-9, trial.summary["own_optimum_mse"])
            above.append(trial.errors()[-1] - trial.summary["own_optimum_mse"])
        self.assertLess(sorted(above)[2], 3e-5)

    def test_the_merit_is_the_measured_visibility(self):
        bench = relign_bench.Bench(str(FOLDER / "interferometer.py"), "declared", threads=1)
        trial = bench.run("random", steps=10, protocol="blind", keep_frames=True)
        measured = trial.errors("measured")
        np.testing.assert_array_equal(measured, [frame[-1, 0] for frame in trial.frames])
        np.testing.assert_array_equal(measured, [trial.score.measured(frame, None) for frame in trial.frames])
        self.assertTrue(np.isfinite(measured).all())


if __name__ == "__main__":
    unittest.main()
