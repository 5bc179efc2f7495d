"""What my_plugin promises, checked by running trials: python3 test_my_plugin.py (relign-bench must be in PATH)."""
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
    def test_what_it_recommends_at_last_is_better_than_the_start_on_most_instances(self):
        # Chance is in it, and its seeds change with its name: a promise for every single instance would not hold.
        better = 0
        for instance in range(4):
            steps = trial("--instance", str(instance), "--protocol", "blind", "--steps", "30")
            better += steps[-1]["recommended_mse"] < steps[0]["recommended_mse"]
        self.assertGreaterEqual(better, 2)

    def test_same_seed_same_trial(self):
        self.assertEqual(trial("--steps", "10"), trial("--steps", "10"))


if __name__ == "__main__":
    unittest.main()
