"""Tests of my_plugin that run trials: python3 test_my_plugin.py (relign-bench must be in PATH)."""
import json
import pathlib
import subprocess
import unittest

PLUGIN = pathlib.Path(__file__).with_name("my_plugin.py")


def trial(*options):
    """The steps of one trial."""
    command = ["relign-bench", "try", str(PLUGIN), "--noise-level", "rho0", "--json", *options]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["steps"]


class MyPluginTest(unittest.TestCase):
    def test_some_step_improves_on_the_start(self):
        # An image can be sharp in the wrong place, so the best step need not be the last. With a trained policy it should be.
        steps = trial("--instance", "1", "--steps", "30")
        self.assertLess(min(step["commanded_mse"] for step in steps), steps[0]["commanded_mse"])
        self.assertEqual(steps[-1]["recommendation"], "current")

    def test_same_seed_gives_same_trial(self):
        self.assertEqual(trial("--steps", "10"), trial("--steps", "10"))


if __name__ == "__main__":
    unittest.main()
