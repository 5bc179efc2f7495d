"""relign-train imitate: a run of a minute, killed and resumed. Needs torch."""

import dataclasses
import io
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from support import Folder, failure, np

try:
    import onnx  # noqa: F401
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch and onnx, from the Python index") from None

from relign_bench.training import cli, policy
from relign_bench.training.adapt import Recipe as AdaptRecipe
from relign_bench.training.adapt import check_captures, moments_loss, read_captures
from relign_bench.training.doubt import Belief, Doubt
from relign_bench.training.export import write_side
from relign_bench.training.folder import RunFolder
from relign_bench.training.imitate import Recipe, Training, loss_of, near_poses
from relign_bench.training.recipe import Recipe as PpoRecipe
from relign_bench.training.settings import kept_recipe

TINY = dict(size=40, levels="0,0.5", lenses=80, pictures=4, passes=4, moves=3, optimum_samples=32, batch=32)


def command(folder, **changes):
    settings = [part for name, value in {**TINY, **changes}.items() for part in ("--set", f"{name}={value}")]
    return [sys.executable, "-m", "relign_bench.training", "imitate", "-o", str(folder), "--threads", "1", *settings]


class Imitation(Folder):
    def test_killed_run_resumes_to_the_same_curve_and_weights(self):
        subprocess.run(command(self.folder / "whole"), check=True, capture_output=True)
        running = subprocess.Popen(command(self.folder / "killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        checkpoint = self.folder / "killed" / "checkpoint.pt"
        for _ in range(1200):
            if checkpoint.is_file() or running.poll() is not None:
                break
            time.sleep(0.05)
        running.send_signal(signal.SIGKILL)
        running.wait()
        self.assertTrue(checkpoint.is_file())
        subprocess.run(command(self.folder / "killed"), check=True, capture_output=True)
        for name in ("curve.csv", "imitation.onnx", "tuning.csv"):
            self.assertEqual((self.folder / "whole" / name).read_bytes(), (self.folder / "killed" / name).read_bytes(), name)
        side = json.loads((self.folder / "whole" / "imitation.json").read_text())
        self.assertEqual((len(side["parity"]["answers"]), side["observation"]["size"]), (64, 40))
        self.assertEqual(len(side["parity"]["answers"][0]), 2 * len(side["axes"]))
        self.assertEqual(len(side["doubt"]["floor"]), len(side["axes"]))

    def test_randomised_run_keeps_its_file_and_adapts_to_captures(self):
        errors = self.folder / "errors.json"
        errors.write_text('{"format": 1, "drawn": "capture", "gain": [0.8, 1.2], "offset": [0, 0.05]}')
        run = self.folder / "randomised"
        subprocess.run([*command(run, passes=2), "--randomise", str(errors)], check=True, capture_output=True)
        self.assertEqual((run / "randomisation.json").read_text(), errors.read_text())
        self.assertIn("--randomise FILE", json.loads((run / "imitation.json").read_text())["command"])
        errors.write_text('{"format": 1, "drawn": "capture", "gain": [0.7, 1.2]}')
        with self.assertRaisesRegex(ValueError, "another recipe"):
            Training(kept_recipe(Recipe, run), run, 1, quiet, errors)

        instances = Training.open(run, 1).instances(10)
        instances.reset(0)
        captures = instances.frames() * (instances.white / 85)  # of 20 instances at their starts, in the scene's units
        images = self.folder / "captures"
        images.mkdir()
        np.save(images / "all.npy", captures.astype(np.float32))
        adapted = [sys.executable, "-m", "relign_bench.training", "adapt", str(run), "--images", str(images), "--threads", "1",
                   "-o", str(self.folder / "adapted"), "--set", "steps=4", "--set", "batch=16"]
        subprocess.run(adapted, check=True, capture_output=True)
        side = json.loads((self.folder / "adapted" / "adapted.json").read_text())
        self.assertEqual(side["trained"]["adapted"]["captures"], 20)
        self.assertEqual(len((self.folder / "adapted" / "curve.csv").read_text().splitlines()), 5)
        np.save(images / "all.npy", 1000 * captures.astype(np.float32))
        refused = subprocess.run(adapted, check=False, capture_output=True, text=True)
        self.assertEqual(refused.returncode, 2)
        self.assertRegex(refused.stderr, "^error: .* of the pixels are brighter than the network can see")

    def test_mistake_in_imaging_errors_leaves_no_folder(self):
        errors = self.folder / "errors.json"
        run = self.folder / "refused"
        for text, why in (("", "errors.json"), ('{"gain": [-0.8, 1.2]}', "/gain/0: expected a number from 0.01 to 100")):
            errors.write_text(text)
            done = subprocess.run([*command(run), "--randomise", str(errors)], check=False, capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(why, done.stderr)
            self.assertNotIn("Traceback", done.stderr)
            self.assertFalse(run.exists())
        done = subprocess.run([*command(run), "--randomise", ""], check=False, capture_output=True, text=True)
        self.assertIn("--randomise: expected a file of imaging errors", done.stderr)

    def test_folder_with_another_recipe_is_refused(self):
        recipe = Recipe(size=40, levels=(0.0,), optimum_samples=32)
        with Training(recipe, self.folder, threads=1).folder.alone():
            pass
        with self.assertRaisesRegex(ValueError, "another recipe"):
            Training(cli.with_settings(recipe, ["lenses=3"]), self.folder, threads=1)

    def test_wrong_settings_name_those_allowed(self):
        done = subprocess.run(command(self.folder, lensez=3), capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--set lensez=3: unknown setting 'lensez'; did you mean 'lenses'?", done.stderr)
        for setting, why in (("lenses", "expected NAME=VALUE"), ("lenses=x", "'x' must be an integer"),
                             ("levels=0,", "must be numbers separated by commas"),
                             ("lenses=0", "lenses must be a positive number"), ("rate=-1", "rate must be a positive number"),
                             ("near=1.5", "near must be from 0 to 1"),
                             ("levels=-0.5", "levels must be a non-negative number")):
            with self.assertRaisesRegex(ValueError, why):
                cli.with_settings(Recipe(), [setting])
        self.assertEqual(cli.with_settings(Recipe(), ["visited=0"]).visited, 0)
        with self.assertRaisesRegex(ValueError, "precision 'half' must be one of float32, bfloat16"):
            Training(Recipe(precision="half"), self.folder)

    def test_message_about_another_recipe_lists_the_differences(self):
        folder = self.folder / "kept"
        for _ in range(2):
            with RunFolder(folder, Recipe()).alone():
                pass
        with self.assertRaisesRegex(ValueError, "another recipe \\(rate: 0.001 in the folder, 0.1 given\\)"):
            RunFolder(folder, Recipe(rate=0.1))

    def test_mistakes_leave_no_folder(self):
        run = self.folder / "refused"
        for wrong, why in ((("--scene", "nope"), "unknown scene 'nope'"),
                           (("--seed", "-1"), "seed must be a non-negative number, not -1"),
                           (("--set", "seed=99999999999999999999"), "seed must be from 0 to 536870911"),
                           (("--threads", "0"), "--threads must be a positive integer, not 0"),
                           (("--set", "moves=2"), "moves 2 must be at least 3: the doubt is calibrated on several answers"),
                           (("--set", "randomise=x"), "'randomise' is not a setting; use --randomise"),
                           (("--scene", "gaussian_spot"), "scene 'gaussian_spot' has a fixed sensor"),
                           (("--randomise", self.folder / "no.json"), "cannot use '.*no.json': no such file or directory; ch"),
                           (("--device", "cpu:x"), "device 'cpu:x' is not supported; expected 'cpu', 'cuda' or 'cuda:N'")):
            with self.subTest(wrong):
                self.assertRegex(failure("imitate", "-o", run, *wrong), why)
                self.assertFalse(run.exists())
        run.write_text("")
        message = failure("imitate", "-o", run, *command(run)[6:], "--set", "passes=1")
        self.assertEqual(message.splitlines()[-1], f"error: cannot use '{run}': file exists; a folder is expected here")

    def test_run_without_a_checkpoint_has_nothing_to_export(self):
        with Training(Recipe(size=40, levels=(0.0,)), self.folder, 1, quiet).folder.alone():
            pass
        self.assertRegex(failure("export", self.folder, "-o", self.folder / "x.onnx"), "^error: nothing trained yet in ")
        self.assertEqual(list(self.folder.glob("x*")), [])

    def test_damaged_recipes_are_named(self):
        kept = dataclasses.asdict(Recipe())
        for content, why in (("{", "cannot be read: Expecting"), ("[]", "cannot be read: not a recipe of relign-train"),
                             (json.dumps({**kept, "colour": 1}), "of this version of relign-train imitate: colour missing or"),
                             (json.dumps({**kept, "size": "100"}), "recipe.json': size cannot be '100'"),
                             (json.dumps({**kept, "levels": []}), r"recipe.json': levels cannot be \[\]"),
                             (json.dumps({**kept, "size": -1}), "recipe.json': size must be a positive number, not -1")):
            (self.folder / "recipe.json").write_text(content)
            with self.subTest(content), self.assertRaisesRegex(ValueError, why):
                kept_recipe(Recipe, self.folder)
        (self.folder / "recipe.json").write_text("{")
        with self.assertRaisesRegex(ValueError, "recipe.json' cannot be read: .*; restore it from a copy, or choose another"):
            RunFolder(self.folder, Recipe())

    def test_folder_of_another_verb_is_named(self):
        for recipe, verb in ((PpoRecipe(), "ppo"), (AdaptRecipe(), "adapt")):
            with RunFolder(self.folder / verb, recipe).alone():
                pass
            with self.assertRaisesRegex(ValueError, f"folder of a run of relign-train {verb}; expected one of .* imitate$"):
                RunFolder(self.folder / verb, Recipe())
            message = failure("adapt", self.folder / verb, "--images", self.folder, "-o", self.folder / "x")
            self.assertIn(f"is the folder of a run of relign-train {verb}; expected one of relign-train imitate", message)
        self.assertIn("expected one of relign-train imitate or ppo", failure("export", self.folder / "adapt", "-o", "x.onnx"))

    def test_damaged_checkpoints_are_named(self):
        training = Training(Recipe(size=40, levels=(0.0,)), self.folder, 1, quiet)
        checkpoint = self.folder / "checkpoint.pt"
        with training.folder.alone():
            training._save(1, torch.optim.Adam(training.net.parameters()))
        whole, foreign = checkpoint.read_bytes(), io.BytesIO()
        torch.save({"policy": {}}, foreign)
        for content in (b"", b"garbage", whole[:len(whole) // 2], foreign.getvalue()):
            checkpoint.write_bytes(content)
            with self.subTest(content[:9]), self.assertRaisesRegex(ValueError, "checkpoint.pt' is damaged or of another run"):
                training.load()


def quiet(_):
    pass


class Doubting(unittest.TestCase):
    def test_a_side_file_has_finite_numbers_only(self):
        with tempfile.TemporaryDirectory() as folder:
            graph = pathlib.Path(folder) / "net.onnx"
            with self.assertRaisesRegex(ValueError, "net.json is not written, because 'doubt' has a number that is not finite"):
                write_side(graph, {"format": 1, "doubt": {"floor": [float("nan")]}})
            self.assertFalse(graph.with_suffix(".json").exists())

    def test_calibration_finds_scale_and_shared_error(self):
        random = np.random.default_rng(3)
        shared = random.normal(size=(1, 4000, 2)) * [0.3, 0.0]
        errors = shared + random.normal(size=(10, 4000, 2)) * [0.4, 2.0]
        doubt = Doubt(np.eye(2), np.ones(2))
        scale = doubt.calibrate(errors, np.ones_like(errors))
        np.testing.assert_allclose(scale, [0.5, 2.0], rtol=0.02)
        np.testing.assert_allclose(doubt.floor, [0.3, 0.0], atol=0.05)

    def test_belief_weights_answers_by_their_variance(self):
        belief = Belief(Doubt(np.eye(2), np.ones(2), np.array([0.1, 0.0])))
        here = np.array([[0.5, 0.5]])
        belief.add(here, np.array([[0.1, 0.2]]), np.array([[1.0, 1.0]]))
        belief.add(here, np.array([[0.2, 0.2]]), np.array([[0.5, 1.0]]))
        optimum, variance = belief.optimum(here)
        np.testing.assert_allclose(optimum, [[0.5 + (0.1 + 4 * 0.2) / 5, 0.7]])
        np.testing.assert_allclose(variance, [[1 / 5 + 0.01, 1 / 2]])
        np.testing.assert_allclose(belief.moves(here), [[0.18, 0.2]])

    def test_likelihood_learns_the_size_of_errors_and_leaves_the_residual_alone(self):
        along = torch.tensor([[0.3, np.log(0.3)]], dtype=torch.float32, requires_grad=True)
        loss_of(along, torch.zeros(1, 1), 1)[1].backward()
        np.testing.assert_allclose(along.grad.numpy(), [[0.0, 0.0]], atol=1e-6)


class Adapting(unittest.TestCase):
    def test_moments_are_zero_for_equal_features_and_grow_with_their_difference(self):
        features = torch.from_numpy(np.random.default_rng(1).normal(size=(500, 8)))
        self.assertAlmostEqual(moments_loss(features, features).item(), 0)
        self.assertGreater(moments_loss(features, features + 0.5).item(), 0.1)
        self.assertGreater(moments_loss(features, 2 * features).item(), 0.5)

    def test_unsuitable_captures_are_refused(self):
        with tempfile.TemporaryDirectory() as kept:
            folder = pathlib.Path(kept)
            for values, why in ((None, "has no captures"), (np.zeros((3, 5)), "must be square captures"),
                                (np.full((20, 20), np.nan), "values must be finite"),
                                (np.zeros((15, 15)), "binnable to 10 x 10 pixels")):
                if values is not None:
                    np.save(folder / "a.npy", values)
                with self.assertRaisesRegex(ValueError, why):
                    read_captures(folder, None, 10, 1.0)
            np.save(folder / "a.npy", np.full((2, 20, 20), 1.0))
            captures = read_captures(folder, None, 10, 1.0)
            self.assertEqual((captures.shape, captures[0, 0, 0]), ((2, 10, 10), 85))
            (folder / "b.png").write_bytes(b"")
            with self.assertRaisesRegex(ValueError, "--white"):
                read_captures(folder, None, 10, 1.0)
            with self.assertRaisesRegex(ValueError, "b.png' cannot be read"):
                read_captures(folder, 0.5, 10, 1.0)
            for white in (0, -1, 2, float("nan")):
                with self.assertRaisesRegex(ValueError, "must be above 0 and at most 1"):
                    read_captures(folder, white, 10, 1.0)
            (folder / "b.png").rename(folder / "b.tiff")
            with self.assertRaisesRegex(ValueError, "neither .npy nor .png"):
                read_captures(folder, None, 10, 1.0)
            (folder / "b.tiff").unlink()
            np.save(folder / "a.npy", np.full((2, 20, 20), 200, np.uint8))
            with self.assertRaisesRegex(ValueError, "values of type uint8"):
                read_captures(folder, None, 10, 1.0)

    def test_captures_without_information_are_refused(self):
        random = np.random.default_rng(1)
        good = random.integers(20, 120, (6, 10, 10)).astype(np.uint8)
        check_captures(good, good[0], "here")
        for bad, why in ((np.full_like(good, 255), "brighter than the network can see"),
                         (good // 8, "times as bright"), (np.full_like(good, 70), "show nothing"),
                         (good[[0, 1, 0, 1]], "only 2 of 4 captures are different")):
            with self.assertRaisesRegex(ValueError, why):
                check_captures(bad, good[0], "here")


class Parts(unittest.TestCase):
    def test_gain_averages_later_residuals(self):
        self.assertEqual([policy.gain(step) for step in (1, 4, 5, 6)], [1, 1, 1 / 2, 1 / 3])
        np.testing.assert_allclose(policy.moves(np.array([[0.5, -0.1]]), 1), [[0.2, -0.1]])

    def test_near_poses_are_spread_along_the_directions(self):
        class Axes:
            vectors, stiff = np.eye(5), 2

        optima = np.full((20000, 5), 0.5)
        spread = np.abs(near_poses(optima, Axes, np.random.default_rng(1)) - 0.5)
        # The standard deviations are log-uniform: half of them are below the geometric mean.
        self.assertLess(np.median(spread[:, 0]), np.median(spread[:, 3]))
        self.assertGreater(np.quantile(spread[:, 0], 0.99), 0.3)
        self.assertLess(np.quantile(spread[:, 0], 0.1), 0.006)


if __name__ == "__main__":
    unittest.main()
