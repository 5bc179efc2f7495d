"""Tests of my_plugin that run trials: python3 test_my_plugin.py (relign-bench must be in PATH)."""
import json
import pathlib
import subprocess
import unittest

PLUGIN = pathlib.Path(__file__).with_name("my_plugin.py")
NOISE = 0.5  # in the unit of the score, dB: more than a reading differs from it


def trial(algorithm, *options):
    """The steps of one trial."""
    command = ["relign-bench", "try", algorithm, "--scene", str(PLUGIN), "--noise-level", "declared", "--protocol", "blind",
               "--json", *options]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["steps"]


class MyPluginTest(unittest.TestCase):
    def test_readings_are_the_score_with_noise(self):
        for step in trial("coordinate-walk", "--steps", "10"):
            self.assertNotEqual(step["measured"], step["commanded_mse"])
            self.assertAlmostEqual(step["measured"], step["commanded_mse"], delta=NOISE)

    def test_devices_differ(self):
        first, second = (trial("random", "--steps", "1", "--instance", str(number))[0] for number in (0, 1))
        self.assertNotEqual(first["commanded_mse"], second["commanded_mse"])

    def test_search_improves_and_equal_trials_have_equal_readings(self):
        steps = trial("nlopt-neldermead", "--steps", "60")
        self.assertLess(steps[-1]["recommended_mse"], steps[0]["recommended_mse"])
        self.assertEqual(trial("nlopt-neldermead", "--steps", "60"), steps)


if __name__ == "__main__":
    unittest.main()
