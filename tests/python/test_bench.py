"""Bench, lenses, trials and results."""

import os
import pathlib
import subprocess
import sys
import unittest

from support import SMALL, np, relign_bench

from relign_bench import Bench


class Lenses(unittest.TestCase):
    def test_captures_are_functions_of_pose_and_frame(self):
        lens = Bench(**SMALL).lens(2)
        pose = [0.5, 0.5, 0.5, 0.5, 0.5]
        self.assertEqual(lens.capture(pose).shape, (20, 20))
        np.testing.assert_array_equal(lens.capture(pose, frame=1), lens.capture(pose, frame=1))
        self.assertFalse(np.array_equal(lens.capture(pose, frame=1), lens.capture(pose, frame=2)))
        with self.assertRaisesRegex(ValueError, "from 0 to 1"):
            lens.capture([0.5, 0.5, 1.5, 0.5, 0.5])

    def test_pictures_without_noise_are_the_mean_of_captures(self):
        bench = Bench(**SMALL)
        lens, pose = bench.lens(2), [0.52, 0.5, 0.5, 0.5, 0.5]
        clean = lens.render(pose)
        mean = np.mean([lens.capture(pose, frame) for frame in range(400)], axis=0)
        lit = clean > 0.2 * clean.max()
        self.assertLess(abs(mean[lit].mean() / clean[lit].mean() - 1), 0.02)
        self.assertLess(np.sqrt(np.mean((mean - clean) ** 2)), 0.2 * clean.max())

    def test_the_own_optimum_is_better_than_the_nominal_pose(self):
        lens = Bench(**SMALL).lens(2)
        pose, rmse = lens.own_optimum()
        self.assertEqual(pose.shape, (5,))
        move = np.linalg.solve(lens.distortion, 0.5 - lens.true_pose)
        lens.move_by(move)
        np.testing.assert_allclose(lens.true_pose, 0.5, atol=1e-12)
        self.assertLess(rmse, lens.noise_free_rmse())

    def test_what_there_is(self):
        bench = Bench(**SMALL)
        self.assertEqual(bench.axes, ["x", "y", "z", "Rx", "Ry"])
        self.assertIn("nlopt-sbplx", relign_bench.list_plugins())
        self.assertIn("relign_od", relign_bench.list_plugins("scene"))


class Trials(unittest.TestCase):
    def test_a_trial_is_the_one_that_the_program_makes(self):
        trial = Bench("gaussian_spot", "rho0").run("nlopt-sbplx", instance=4, steps=6, keep_frames=True)
        self.assertEqual((trial.end, len(trial.steps), trial.frames.shape), ("budget_spent", 7, (7, 50, 50)))
        program = os.environ.get("RELIGN_PROGRAM")
        if not program:
            self.skipTest("RELIGN_PROGRAM does not name the program")
        import json

        told = subprocess.run([program, "try", "nlopt-sbplx", "--scene", "gaussian_spot", "--noise-level", "rho0",
                               "--instance", "4", "--steps", "6", "--json"], capture_output=True, check=True).stdout
        for step, other in zip(trial.steps, json.loads(told)["steps"]):
            self.assertEqual(step["commanded_pose"], other["commanded_pose"])
            self.assertEqual(step["measured"], other["measured"])
            self.assertEqual(step["recommended_mse"], other["recommended_mse"])

    def test_tracks(self):
        trial = Bench("gaussian_spot", "rho0").run("random", steps=4)
        for track in ("recommended", "commanded", "measured"):
            self.assertEqual(trial.rmse(track).shape, (5,))
        self.assertTrue((trial.rmse() <= trial.rmse()[0] + 1e-12).all(), "the best measured one is recommended")

    def test_mistakes(self):
        bench = Bench("gaussian_spot", "rho0")
        with self.assertRaisesRegex(ValueError, "did you mean 'nlopt-sbplx'"):
            bench.run("nlopt-sbplq")
        with self.assertRaisesRegex(ValueError, "protocols: paper, blind"):
            bench.run("random", protocol="pape")
        with self.assertRaisesRegex(ValueError, "first_stride"):
            bench.run("nlopt-sbplx", parameters={"first_strid": 0.1})
        for wrong, why in (({"steps": 0}, "steps=0: allowed: whole numbers from 1"), ({"instance": -1}, "instance=-1"),
                           ({"instance": 1.5}, "instance=1.5")):
            with self.assertRaisesRegex(ValueError, why):
                bench.run("random", **wrong)
        lens = bench.lens(0)
        for pose in ([0.5] * 4, [0.5, 0.5, 0.5, 0.5, float("nan")], [0.5, 0.5, 0.5, 0.5, 1.5]):
            with self.assertRaisesRegex(ValueError, "a true pose is 5 numbers from 0 to 1"):
                lens.capture(pose)
        with self.assertRaisesRegex(ValueError, "tracks: recommended, commanded, measured"):
            bench.run("random", steps=1).rmse("excess")
        with self.assertRaisesRegex(ValueError, "instances: training, tuning, benchmark"):
            relign_bench.AlignmentEnv("gaussian_spot", "rho0", instances="bench")


class Results(unittest.TestCase):
    def test_tables(self):
        try:
            import pandas  # noqa: F401
        except ImportError:
            self.skipTest("pandas is not installed")
        golden = pathlib.Path(__file__).parents[1] / "golden" / "report" / "small"
        steps = relign_bench.read_results(golden, "steps")
        self.assertEqual(set(steps["algorithm"]), {"home", "compass", "random"})
        self.assertEqual(len(steps[steps["trial"] == "00000000000000a0"]), 3)
        with self.assertRaisesRegex(FileNotFoundError, "relign-bench report"):
            relign_bench.read_results(golden, "curves")
        with self.assertRaisesRegex(FileNotFoundError, "manifest.json"):
            relign_bench.read_results(golden.parent)
        self.assertGreater(len(Bench("gaussian_spot", "rho0").run("random", steps=2).table()), 2)


class Imports(unittest.TestCase):
    def test_the_environment_is_registered_in_either_order(self):
        for code in ("import gymnasium, relign_bench", "import relign_bench, gymnasium; relign_bench.register()",
                     "from relign_bench import Bench; import gymnasium"):
            told = subprocess.run([sys.executable, "-c", code + "; print(gymnasium.spec('relign_bench/Alignment-v0').id)"],
                                  capture_output=True, check=True, text=True).stdout
            self.assertEqual(told.strip(), "relign_bench/Alignment-v0")

    def test_modules_are_there_without_an_import(self):
        code = "import relign_bench; print(relign_bench.rewards.__name__, hasattr(relign_bench, 'reward'))"
        told = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True).stdout
        self.assertEqual(told.strip(), "relign_bench.rewards False")

    def test_plugins_need_neither_numpy_nor_the_compiled_part(self):
        code = ("import sys; import relign_bench.plugin; "
                "print(sorted(set(sys.modules) & {'relign_bench._core', 'gymnasium'}))")
        told = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True).stdout
        self.assertEqual(told.strip(), "[]")


if __name__ == "__main__":
    unittest.main()
