"""relign-train imitate: a training of a minute, killed and resumed. Needs torch."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from support import np

try:
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch, from the Python index")

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

    def test_goes_on_to_the_same_curve_and_weights_after_a_kill(self):
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

    def test_another_recipe_needs_another_folder(self):
        recipe = Recipe(size=40, levels=(0.0,), optimum_samples=32)
        Training(recipe, self.folder, threads=1)
        with self.assertRaisesRegex(ValueError, "another recipe"):
            Training(cli.changed(recipe, ["lenses=3"]), self.folder, threads=1)

    def test_mistakes(self):
        told = subprocess.run(command(self.folder, lensez=3), capture_output=True, text=True)
        self.assertEqual(told.returncode, 2)
        self.assertIn("--set lensez=3: allowed: NAME=VALUE", told.stderr)
        for setting, why in (("lenses=x", "'x' is no whole number"), ("levels=0,", "no list of numbers with commas"),
                             ("lenses=0", "allowed: more than 0"), ("rate=-1", "allowed: more than 0"),
                             ("near=1.5", "allowed: 0 to 1"), ("levels=-0.5", "allowed: 0 or more")):
            with self.assertRaisesRegex(ValueError, why):
                cli.changed(Recipe(), [setting])
        self.assertEqual(cli.changed(Recipe(), ["rounds=0"]).rounds, 0)

    def test_another_recipe_in_the_folder_is_told_by_its_settings(self):
        folder = self.folder / "kept"
        RunFolder(folder, Recipe())
        RunFolder(folder, Recipe())
        with self.assertRaisesRegex(ValueError, "another recipe \\(rate 0.001 there, 0.1 here\\)"):
            RunFolder(folder, Recipe(rate=0.1))


class Parts(unittest.TestCase):
    def test_the_gain_averages_later_guesses(self):
        self.assertEqual([policy.gain(step) for step in (1, 4, 5, 6)], [1, 1, 1 / 2, 1 / 3])
        np.testing.assert_allclose(policy.moves(np.array([[0.5, -0.1]]), 1), [[0.2, -0.1]])

    def test_poses_are_spread_along_the_directions(self):
        class Axes:
            vectors, stiff = np.eye(5), 2

        optima = np.full((20000, 5), 0.5)
        spread = np.abs(near_poses(optima, Axes, np.random.default_rng(1)) - 0.5)
        # Half of a log-uniform range of standard deviations lies below its geometric mean.
        self.assertLess(np.median(spread[:, 0]), np.median(spread[:, 3]))
        self.assertGreater(np.quantile(spread[:, 0], 0.99), 0.3)
        self.assertLess(np.quantile(spread[:, 0], 0.1), 0.006)


if __name__ == "__main__":
    unittest.main()
