"""Tests of my_plugin that run trials: python3 test_my_plugin.py (relign-bench must be in PATH)."""
import json
import pathlib
import subprocess
import unittest

PLUGIN = pathlib.Path(__file__).with_name("my_plugin.py")
# For a problem of your own: ("--scene", "../pinhole/pinhole.py", "--noise-level", "declared", "--protocol", "blind")
PROBLEM = ("--noise-level", "rho0", "--protocol", "blind")


def trial(*options):
    """The steps of one trial."""
    command = ["relign-bench", "try", str(PLUGIN), *PROBLEM, "--json", *options]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["steps"]


class MyPluginTest(unittest.TestCase):
    def test_last_recommendation_improves_on_the_start_for_most_instances(self):
        # A random search, whose seeds depend on its name, does not improve every instance.
        better = 0
        for instance in range(4):
            steps = trial("--instance", str(instance), "--steps", "30")
            better += steps[-1]["recommended_mse"] < steps[0]["recommended_mse"]
        self.assertGreaterEqual(better, 2)

    def test_same_seed_gives_same_trial(self):
        self.assertEqual(trial("--steps", "10"), trial("--steps", "10"))


if __name__ == "__main__":
    unittest.main()
