"""Tests of my_plugin that run trials: python3 test_my_plugin.py (relign-bench must be in PATH)."""
import json
import pathlib
import subprocess
import unittest

PLUGIN = pathlib.Path(__file__).with_name("my_plugin.py")


def trial(algorithm, *options):
    """The steps of one trial."""
    command = ["relign-bench", "try", algorithm, "--scene", str(PLUGIN), "--json", *options]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["steps"]


class MyPluginTest(unittest.TestCase):
    def test_nominal_pose_of_perfect_lenses_improves_on_the_start(self):
        # Method home moves there. The stage is slightly distorted, so that this is nearly the optimum.
        for instance in range(3):
            start, nominal = trial("home", "--noise-level", "rho0", "--instance", str(instance))[:2]
            self.assertLess(nominal["commanded_mse"], start["commanded_mse"])
            self.assertGreater(nominal["measured"], 0.005)  # a capture also has noise

    def test_element_offsets_change_the_error(self):
        perfect = trial("home", "--noise-level", "rho0", "--instance", "2")
        offset = trial("home", "--noise-level", "rho0.5", "--instance", "2")
        self.assertNotEqual(perfect[1]["commanded_mse"], offset[1]["commanded_mse"])

    def test_search_improves_and_equal_trials_have_equal_images(self):
        steps = trial("nlopt-sbplx", "--steps", "80")
        self.assertLess(steps[-1]["recommended_mse"], steps[0]["recommended_mse"])
        self.assertEqual(trial("nlopt-sbplx", "--steps", "80"), steps)


if __name__ == "__main__":
    unittest.main()
