"""Tests of my_plugin that run trials: python3 test_my_plugin.py (relign-bench must be in PATH)."""
import json
import pathlib
import subprocess
import unittest

PLUGIN = pathlib.Path(__file__).with_name("my_plugin.py")


def trial(*options):
    """The steps of one trial."""
    command = ["relign-bench", "try", "home", "--noise-level", str(PLUGIN), "--json", *options]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["steps"]


class MyPluginTest(unittest.TestCase):
    def test_starts_differ_and_are_near_the_middle_of_the_travel(self):
        starts = [trial("--instance", str(instance))[0]["true_pose"] for instance in range(5)]
        coordinates = [coordinate for start in starts for coordinate in start]
        self.assertGreaterEqual(min(coordinates), 0.2)
        self.assertLessEqual(max(coordinates), 0.8)
        self.assertEqual(len(set(coordinates)), len(coordinates))

    def test_an_instance_is_a_pure_function_of_its_number(self):
        self.assertEqual(trial("--instance", "4"), trial("--instance", "4"))


if __name__ == "__main__":
    unittest.main()
