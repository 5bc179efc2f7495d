"""relign-train imitate: a run of a minute, killed and resumed. Needs torch."""

import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from support import np

try:
    import torch  # noqa: F401
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch, from the Python index") from None

from relign_bench.training import cli, policy
from relign_bench.training.folder import RunFolder
from relign_bench.training.imitate import Recipe, Training, near_poses

TINY = dict(size=40, levels="0,0.5", lenses=40, pictures=10, passes=2, rounds=1, round_lenses=40, round_moves=3,
            round_passes=1, optimum_samples=32, batch=32)


def command(folder, **changes):
    settings = [part for name, value in {**TINY, **changes}.items() for part in ("--set", f"{name}={value}")]
    return [sys.executable, "-m", "relign_bench.training", "imitate", "-o", str(folder), "--threads", "1", *settings]


class Imitation(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)

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

    def test_folder_with_another_recipe_is_refused(self):
        recipe = Recipe(size=40, levels=(0.0,), optimum_samples=32)
        Training(recipe, self.folder, threads=1)
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
        self.assertEqual(cli.with_settings(Recipe(), ["rounds=0"]).rounds, 0)

    def test_message_about_another_recipe_lists_the_differences(self):
        folder = self.folder / "kept"
        RunFolder(folder, Recipe())
        RunFolder(folder, Recipe())
        with self.assertRaisesRegex(ValueError, "another recipe \\(rate: 0.001 in the folder, 0.1 given\\)"):
            RunFolder(folder, Recipe(rate=0.1))


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
