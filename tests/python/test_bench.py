"""Bench, instances, trials and results."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

from support import SMALL, np

import relign_bench
from relign_bench import Bench


class Instances(unittest.TestCase):
    def test_captures_are_functions_of_pose_and_frame(self):
        instance = Bench(**SMALL).instance(2)
        pose = [0.5, 0.5, 0.5, 0.5, 0.5]
        self.assertEqual(instance.capture(pose).shape, (20, 20))
        np.testing.assert_array_equal(instance.capture(pose, frame=1), instance.capture(pose, frame=1))
        self.assertFalse(np.array_equal(instance.capture(pose, frame=1), instance.capture(pose, frame=2)))
        with self.assertRaisesRegex(ValueError, "from 0 to 1"):
            instance.capture([0.5, 0.5, 1.5, 0.5, 0.5])
        with self.assertRaisesRegex(ValueError, "^frame must be a non-negative integer, not -1$"):
            instance.capture(pose, frame=-1)

    def test_seeds_of_captures(self):
        batch = Bench(**SMALL).batch(1)
        pose = [[0.5] * 5]
        batch.reset([0], [0])
        batch.capture_at([0], pose, np.array([2**64 - 1], np.uint64))
        for seed, allowed in ((-1, "a non-negative integer"), (1.5, "a non-negative integer"),
                              (2**64, f"an integer from 0 to {2**64 - 1}")):
            with self.assertRaisesRegex(ValueError, f"^seed must be {allowed}, not {seed}$"):
                batch.capture_at([0], pose, [seed])
        with self.assertRaisesRegex(ValueError, "^step must be a non-negative integer, not -1$"):
            batch.noise_free_mse_at([0], pose, [-1])

    def test_noise_free_image_is_the_mean_of_captures(self):
        bench = Bench(**SMALL)
        instance, pose = bench.instance(2), [0.52, 0.5, 0.5, 0.5, 0.5]
        clean = instance.render(pose)
        mean = np.mean([instance.capture(pose, frame) for frame in range(400)], axis=0)
        lit = clean > 0.2 * clean.max()
        self.assertLess(abs(mean[lit].mean() / clean[lit].mean() - 1), 0.02)
        self.assertLess(np.sqrt(np.mean((mean - clean) ** 2)), 0.2 * clean.max())

    def test_own_optimum_has_a_lower_error_than_the_nominal_pose(self):
        instance = Bench(**SMALL).instance(2)
        pose, rmse = instance.own_optimum()
        self.assertEqual(pose.shape, (5,))
        move = np.linalg.solve(instance.distortion, 0.5 - instance.true_pose)
        instance.move_by(move)
        np.testing.assert_allclose(instance.true_pose, 0.5, atol=1e-12)
        self.assertLess(rmse, instance.noise_free_error())

    def test_instances_have_the_errors_of_their_stage(self):
        self.assertEqual(Bench(**SMALL).instance(2).stage, {})
        stage = Bench(**{**SMALL, "noise_level": "tolerances-stepper-stage"}).instance(2).stage
        self.assertEqual(sorted(stage), ["backlash", "drift", "drift_seconds", "encoder_step", "repeatability"])
        self.assertEqual((len(stage["drift"]), stage["drift_seconds"]), (5, 1200))

    def test_axes_and_plugins_are_listed(self):
        bench = Bench(**SMALL)
        self.assertEqual(bench.axes, ["x", "y", "z", "Rx", "Ry"])
        self.assertIn("nlopt-sbplx", relign_bench.list_plugins())
        self.assertIn("relign_od", relign_bench.list_plugins("scene"))


class Trials(unittest.TestCase):
    def test_trial_equals_that_of_the_program(self):
        trial = Bench("gaussian_spot", "rho0").run("nlopt-sbplx", instance=4, steps=6, keep_frames=True)
        self.assertEqual((trial.end, len(trial.steps), trial.frames.shape), ("budget_spent", 7, (7, 50, 50)))
        program = os.environ.get("RELIGN_PROGRAM")
        if not program:
            self.skipTest("RELIGN_PROGRAM does not name the program")

        output = subprocess.run([program, "try", "nlopt-sbplx", "--scene", "gaussian_spot", "--noise-level", "rho0",
                               "--instance", "4", "--steps", "6", "--json"], capture_output=True, check=True).stdout
        for step, other in zip(trial.steps, json.loads(output)["steps"]):
            self.assertEqual(step["commanded_pose"], other["commanded_pose"])
            self.assertEqual(step["measured"], other["measured"])
            self.assertEqual(step["recommended_mse"], other["recommended_mse"])

    def test_rmse_has_a_value_per_step_for_each_track(self):
        trial = Bench("gaussian_spot", "rho0").run("random", steps=4)
        for track in ("recommended", "commanded", "measured"):
            self.assertEqual(trial.errors(track).shape, (5,))
        self.assertTrue((trial.errors() <= trial.errors()[0] + 1e-12).all(), "the best measured pose is recommended")

    def test_wrong_arguments_name_those_allowed(self):
        bench = Bench("gaussian_spot", "rho0")
        with self.assertRaisesRegex(ValueError, "did you mean 'nlopt-sbplx'"):
            bench.run("nlopt-sbplq")
        with self.assertRaisesRegex(ValueError, "protocols: paper, blind"):
            bench.run("random", protocol="pape")
        with self.assertRaisesRegex(ValueError, "first_stride"):
            bench.run("nlopt-sbplx", parameters={"first_strid": 0.1})
        for wrong, why in (({"steps": 0}, "steps must be a positive integer, not 0"),
                           ({"steps": 10**7}, "steps must be an integer from 1 to 100000, not 10000000"),
                           ({"instance": 2**63}, "instance must be an integer from 0 to 9223372036854775807"),
                           ({"instance": -1}, "instance must be a non-negative integer, not -1"),
                           ({"instance": 1.5}, "instance must be a non-negative integer, not 1.5")):
            with self.assertRaisesRegex(ValueError, why):
                bench.run("random", **wrong)
        instance = bench.instance(0)
        for pose in ([0.5] * 4, [0.5, 0.5, 0.5, 0.5, float("nan")], [0.5, 0.5, 0.5, 0.5, 1.5]):
            with self.assertRaisesRegex(ValueError, "a true pose must be 5 numbers from 0 to 1"):
                instance.capture(pose)
        with self.assertRaisesRegex(ValueError, "tracks: recommended, commanded, measured"):
            bench.run("random", steps=1).errors("excess")
        with self.assertRaisesRegex(ValueError, "instances: training, tuning, benchmark"):
            relign_bench.AlignmentEnv("gaussian_spot", "rho0", instances="bench")


class Plugins(unittest.TestCase):
    """A scene, noise level or algorithm as an object, as in a suite."""

    def test_an_object_is_the_plugin_with_its_parameters(self):
        spot = {"use": "gaussian_spot", "parameters": {"photons": 1000}}
        level = {"use": "rho0", "parameters": {"movement_std": 0.1}}
        named = Bench("gaussian_spot", "rho0", scene_parameters=spot["parameters"], noise_level_parameters=level["parameters"])
        other, plain = Bench(spot, level), Bench("gaussian_spot", {"use": "rho0"})
        one, same, different = (bench.instance(3) for bench in (named, other, plain))
        self.assertEqual(one.distortion.tolist(), same.distortion.tolist())
        self.assertNotEqual(one.distortion.tolist(), different.distortion.tolist())
        np.testing.assert_array_equal(one.capture([0.5] * 5), same.capture([0.5] * 5))
        self.assertGreater(np.abs(same.capture([0.5] * 5) - different.capture([0.5] * 5)).max(), 0)
        search = {"use": "cma-es", "parameters": {"first_stride": 0.3}}
        self.assertEqual(other.run(search, steps=6).steps, named.run("cma-es", steps=6, parameters=search["parameters"]).steps)
        self.assertNotEqual(other.run("cma-es", steps=6).steps, other.run(search, steps=6).steps)
        first, _ = relign_bench.AlignmentEnv(spot, level).reset(seed=1)
        expected, _ = relign_bench.AlignmentEnv("gaussian_spot", "rho0", scene_parameters=spot["parameters"],
                                                noise_level_parameters=level["parameters"]).reset(seed=1)
        np.testing.assert_array_equal(first, expected)

    def test_anything_else_is_refused(self):
        for arguments, why in (
            ((None,), "scene must be an id, a preset, a path, or an object .*, not None"),
            (("gaussian_spot", None), "noise level must be an id, .*, not None"),
            (("gaussian_spot", 0.25), "noise level must be an id, .*, not 0.25"),
            (("gaussian_spot", {"level": 0.25}), "unknown key 'level'; keys: use, parameters"),
            (("gaussian_spot", {"parameters": {"level": 0.25}}), "noise level must be an id"),
            (("gaussian_spot", {"use": "rho", "parameters": [1]}), r"parameters of the noise level must be .*, not \[1\]"),
            (("gaussian_spot", {"use": "rho", "parameters": {"lvl": 1}}), "has no parameter 'lvl'"),
        ):
            with self.subTest(arguments=arguments), self.assertRaisesRegex(ValueError, why):
                Bench(*arguments)
        with self.assertRaisesRegex(ValueError, "has parameters of its own: give no others, not {'level': 0.5}"):
            Bench("gaussian_spot", {"use": "rho", "parameters": {"level": 0.75}}, noise_level_parameters={"level": 0.5})
        with self.assertRaisesRegex(ValueError, "algorithm must be an id, .*, not None"):
            Bench("gaussian_spot", "rho0").run(None)
        with self.assertRaisesRegex(ValueError, "scene must be an id"):
            relign_bench.AlignmentEnv(None)


class Results(unittest.TestCase):
    def test_tables_are_data_frames(self):
        try:
            import pandas  # noqa: F401
        except ImportError:
            self.skipTest("pandas is not installed")
        golden = pathlib.Path(__file__).parents[1] / "golden" / "report" / "small"
        steps = relign_bench.Results(golden).table("steps")
        self.assertEqual(set(steps["algorithm"]), {"home", "compass", "random"})
        self.assertEqual(len(steps[steps["trial"] == "00000000000000a0"]), 3)
        self.assertIn("budget_spent", set(steps["end"]))
        self.assertNotIn("centre_px", steps, "no trial has it")
        with self.assertRaisesRegex(FileNotFoundError, "relign-bench report"):
            relign_bench.Results(golden).table("curves")
        with self.assertRaisesRegex(FileNotFoundError, "manifest.json"):
            relign_bench.Results(golden.parent)
        with tempfile.TemporaryDirectory() as place:
            forged = pathlib.Path(place) / "forged"
            shutil.copytree(golden, forged)
            records = forged / "trials" / "0000.jsonl"
            text = records.read_text()
            records.write_text(text.replace('"recommended_mse":', '"recommended_mse":0.5,"recommended_mse":', 1))
            with self.assertRaisesRegex(ValueError, "0000.jsonl:1: key 'recommended_mse' is there twice in one object"):
                relign_bench.Results(forged).table("steps")
            judged = text.replace('"message":', '"centre_px":[3,null,1],"criterion_optimum_deficit":-0.5,"message":', 1)
            records.write_text(judged)
            steps_of = relign_bench.Results(forged).table("steps").set_index("trial").loc["00000000000000a0"]
            self.assertEqual(steps_of["centre_px"].fillna(-1).tolist(), [3, -1, 1])
            self.assertEqual(steps_of["criterion_optimum_deficit"].tolist(), [-0.5] * 3)
            records.write_text(text + '{"trial":"half')  # of a run that was killed
            self.assertEqual(len(relign_bench.Results(forged).table("steps")), len(steps))
            for file in records.parent.iterdir():
                file.unlink()
            empty = relign_bench.Results(forged).table("steps")
            schema = json.loads((pathlib.Path(__file__).parents[2] / "docs" / "schemas" / "trials.schema.json").read_text())
            self.assertEqual((len(empty), list(empty)[6:]), (0, schema["definitions"]["step"]["required"]))
            self.assertEqual(list(empty)[:6], list(steps)[:6])
        # From the source tree, which has no compiled module.
        code = ("import sys; from relign_bench import Results; "
                f"print(len(Results({str(golden)!r}).table('steps')), 'relign_bench._core' in sys.modules)")
        source = pathlib.Path(__file__).parents[2] / "python"
        output = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True,
                                env={**os.environ, "PYTHONPATH": str(source)}).stdout
        self.assertEqual(output.split(), [str(len(steps)), "False"])
        self.assertGreater(len(Bench("gaussian_spot", "rho0").run("random", steps=2).table()), 2)

    def test_polars_has_the_values_of_pandas(self):
        try:
            import pandas
            import polars
        except ImportError as problem:
            self.skipTest(f"{problem}: tests/python/requirements-others.txt pins it")
        golden = pathlib.Path(__file__).parents[1] / "golden" / "report" / "small"
        with tempfile.TemporaryDirectory() as place:
            folder = pathlib.Path(place) / "results"
            shutil.copytree(golden, folder)
            # The id of a trial may look like a number.
            table = "trial,algorithm,recommended\n0000000000000010,home,0.5\n0000000000000011,home,\n"
            (folder / "instances.csv").write_text(table)
            results = relign_bench.Results(folder)
            for what in ("steps", "instances"):
                ours, theirs = results.table(what), results.table(what, library="polars")
                self.assertIsInstance(theirs, polars.DataFrame)
                self.assertEqual(list(ours.columns), theirs.columns)
                for name in theirs.columns:
                    for one, other in zip(ours[name], theirs[name].to_list()):
                        if other is None or isinstance(one, float) and pandas.isna(one):
                            self.assertTrue(other is None and pandas.isna(one), name)
                        else:
                            self.assertEqual(one, other, name)
            self.assertEqual(results.table("instances")["trial"][0], "0000000000000010")
        with self.assertRaisesRegex(ValueError, "modules: pandas, polars"):
            results.table("steps", library="arrow")
        with mock.patch.dict(sys.modules, {"polars": None}), self.assertRaisesRegex(ImportError, "pip install polars"):
            results.table("steps", library="polars")


class Imports(unittest.TestCase):
    def test_the_version_is_the_project_s(self):
        project = (pathlib.Path(__file__).parents[2] / "CMakeLists.txt").read_text()
        self.assertIn(f"project(relign-bench VERSION {relign_bench.__version__} ", project)

    def test_environment_is_registered_in_either_order(self):
        for code in ("import gymnasium, relign_bench", "import relign_bench, gymnasium; relign_bench.register()",
                     "from relign_bench import Bench; import gymnasium"):
            output = subprocess.run([sys.executable, "-c", code + "; print(gymnasium.spec('relign_bench/Alignment-v0').id)"],
                                    capture_output=True, check=True, text=True).stdout
            self.assertEqual(output.strip(), "relign_bench/Alignment-v0")

    def test_submodules_need_no_import(self):
        code = "import relign_bench; print(relign_bench.rewards.__name__, hasattr(relign_bench, 'reward'))"
        output = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True).stdout
        self.assertEqual(output.strip(), "relign_bench.rewards False")

    def test_plugins_import_the_standard_library_only_and_not_typing(self):
        # -S: without site-packages, whose start-up files import modules of their own.
        code = ("import sys; import relign_bench.plugin; "
                "print(sorted(set(sys.modules) & {'relign_bench._core', 'gymnasium', 'numpy', 'typing'}))")
        output = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, check=True, text=True).stdout
        self.assertEqual(output.strip(), "[]")

    def test_every_public_name_can_be_imported(self):
        for name in relign_bench.__all__:
            self.assertEqual(getattr(relign_bench, name).__name__, name)
        from relign_bench import plugin

        for name in plugin.__all__:
            self.assertEqual(getattr(plugin, name).__module__, "relign_bench.plugin")


if __name__ == "__main__":
    unittest.main()
