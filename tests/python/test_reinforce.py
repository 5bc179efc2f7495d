"""relign-train ppo: trainings of a minute, stopped and resumed. Needs torch and Stable-Baselines3."""

import dataclasses
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

from support import np

try:
    import stable_baselines3  # noqa: F401
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: this training needs torch and stable-baselines3, from the Python index")

from relign_bench.training import export
from relign_bench.training.cli import changed, with_goal
from relign_bench.training.directions import Directions
from relign_bench.training.guided import EPISODE, FLOOR, GuidedEnv, exploration
from relign_bench.training.imitate import Recipe as ImitateRecipe
from relign_bench.training.imitate import Training
from relign_bench.training.policies import PackageFeatures
from relign_bench.training.reinforce import PRESETS, Reinforcement
from relign_bench.training.stable_baselines import StableBaselinesEnv

PAPER = dataclasses.replace(PRESETS["paper"], size=100, environments=2, steps=20, batch=40, epochs=1, episode=10, total=120,
                            stretch=40)
TUNED = dataclasses.replace(PRESETS["tuned"], size=40, environments=10, batch=60, epochs=1, total=360, stretch=120,
                            optimum_samples=32)


def quiet(_):
    pass


class Folder(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)

    def warm_start(self):
        """The folder of an imitation that has learnt nothing yet."""
        recipe = ImitateRecipe(size=40, levels=(0.0,), optimum_samples=32)
        training = Training(recipe, self.folder / "warm", threads=1, tell=quiet)
        training.seconds = 1800.0
        training._save(0, 0, None)
        return self.folder / "warm"

    def expect_same(self, whole, resumed):
        for name, value in whole.model.policy.state_dict().items():
            np.testing.assert_array_equal(value.numpy(), resumed.model.policy.state_dict()[name].numpy(), name)
        rows = [[{k: v for k, v in row.items() if k != "hours"} for row in run.rows] for run in (whole, resumed)]
        self.assertEqual(*rows)


class Stretches(Folder):
    def test_the_papers_recipe_goes_on_to_the_same_weights(self):
        whole = Reinforcement(PAPER, self.folder / "whole", threads=1, tell=quiet)
        whole.run()
        Reinforcement(PAPER, self.folder / "parts", threads=1, tell=quiet).run(until=1)
        resumed = Reinforcement(PAPER, self.folder / "parts", threads=1, tell=quiet)
        self.assertEqual(resumed.done, 1)
        resumed.run()
        self.expect_same(whole, resumed)
        self.assertEqual([row["steps"] for row in whole.rows], [40, 80, 120])
        self.assertEqual((self.folder / "whole/curve.csv").read_text().count("\n"), 4)
        self.assertTrue((self.folder / "whole/curve.png").read_bytes().startswith(b"\x89PNG"))

    def test_goes_on_beyond_its_end_when_the_rate_does_not_fall(self):
        whole = Reinforcement(PAPER, self.folder / "whole", threads=1, tell=quiet)
        whole.run()
        less = dataclasses.replace(PAPER, total=80)
        Reinforcement(less, self.folder / "longer", threads=1, tell=quiet).run()
        longer = Reinforcement(PAPER, self.folder / "longer", threads=1, tell=quiet)
        self.assertEqual((longer.done, json.loads((self.folder / "longer/recipe.json").read_text())["total"]), (2, PAPER.total))
        longer.run()
        self.expect_same(whole, longer)
        with self.assertRaisesRegex(ValueError, "another recipe \\(total 120 there, 80 here\\)"):
            Reinforcement(less, self.folder / "longer", threads=1, tell=quiet)
        Reinforcement(dataclasses.replace(less, last_rate=0.0), self.folder / "falls", threads=1, tell=quiet)
        with self.assertRaisesRegex(ValueError, "another recipe \\(total 80 there, 120 here\\)"):
            Reinforcement(dataclasses.replace(PAPER, last_rate=0.0), self.folder / "falls", threads=1, tell=quiet)

    def test_the_tuned_recipe_goes_on_to_the_same_weights_and_warms_up_its_critic(self):
        warm = self.warm_start()
        whole = Reinforcement(TUNED, self.folder / "whole", warm, threads=1, tell=quiet)
        first = {name: value.clone() for name, value in whole.model.policy.net.state_dict().items()}
        whole.run(until=1)
        for name, value in whole.model.policy.net.state_dict().items():
            np.testing.assert_array_equal(value.numpy(), first[name].numpy(), name)  # the critic alone has learnt
        whole.run()
        changed = [name for name, value in whole.model.policy.net.state_dict().items() if not torch.equal(value, first[name])]
        self.assertIn("head.weight", changed)
        Reinforcement(TUNED, self.folder / "parts", warm, threads=1, tell=quiet).run(until=2)
        resumed = Reinforcement(TUNED, self.folder / "parts", warm, threads=1, tell=quiet)
        resumed.run()
        self.expect_same(whole, resumed)

    def test_the_others_that_the_paper_compared(self):
        for algorithm in ("a2c", "trpo", "recurrent-ppo"):
            with self.subTest(algorithm):
                if algorithm != "a2c":
                    try:
                        import sb3_contrib  # noqa: F401
                    except ImportError as problem:
                        self.skipTest(f"{problem}: needs sb3-contrib, from the Python index")
                recipe = dataclasses.replace(PAPER, algorithm=algorithm, total=40)
                training = Reinforcement(recipe, self.folder / algorithm, threads=1, tell=quiet)
                training.run()
                self.assertEqual(training.rows[-1]["steps"], 40)

    def test_the_goal_is_the_packages_at_each_of_its_levels(self):
        def goal(*settings, preset="paper"):
            return with_goal(changed(PRESETS[preset], settings), settings).goal

        self.assertEqual([goal(f"level={level}") for level in (0, 0.25, 0.5)], [0.051, 0.0555, 0.06])
        self.assertEqual(goal("level=0.5", "goal=0.02"), 0.02)
        self.assertEqual(goal("level=0.5", "goal=0"), 0)
        self.assertEqual(goal("level=0.3", preset="tuned"), 0)
        with self.assertRaisesRegex(ValueError, "goals for 0, 0.25, 0.5 alone; add --set goal="):
            goal("level=0.3")

    def test_mistakes(self):
        with self.assertRaisesRegex(ValueError, "size=40.*needs 64 columns"):
            Reinforcement(dataclasses.replace(PAPER, size=40), self.folder / "z", threads=1, tell=quiet)
        with self.assertRaisesRegex(ValueError, "--warm-start FOLDER of relign-train imitate"):
            Reinforcement(TUNED, self.folder / "x", threads=1, tell=quiet)
        Reinforcement(PAPER, self.folder / "y", threads=1, tell=quiet)
        with self.assertRaisesRegex(ValueError, "another recipe"):
            Reinforcement(dataclasses.replace(PAPER, rate=1e-3), self.folder / "y", threads=1, tell=quiet)


class Export(Folder):
    def test_of_both_recipes(self):
        command = [sys.executable, "-m", "relign_bench.training"]
        Reinforcement(PAPER, self.folder / "paper", threads=1, tell=quiet).run(until=1)
        subprocess.run([*command, "export", self.folder / "paper", "-o", self.folder / "paper.onnx"], check=True,
                       capture_output=True)
        side = json.loads((self.folder / "paper.json").read_text())
        self.assertEqual((side["output"], side["observation"]["frames"], side["trained"]["steps"]), ("move", 5, 40))
        Reinforcement(TUNED, self.folder / "tuned", self.warm_start(), threads=1, tell=quiet).run(until=2)
        subprocess.run([*command, "export", self.folder / "tuned", "-o", self.folder / "tuned.onnx"], check=True,
                       capture_output=True)
        side = json.loads((self.folder / "tuned.json").read_text())
        self.assertEqual((side["output"], side["observation"]["frames"]), ("way", 1))
        self.assertEqual(side["trained"]["warm_start"], {"hours": 0.5})  # it counts in what the network has cost
        self.assertEqual(len(side["parity"]["inputs"]), 64)
        self.assertEqual(len(side["reference"]["means"]), 400)

    def test_of_no_training(self):
        told = subprocess.run([sys.executable, "-m", "relign_bench.training", "export", self.folder, "-o", "x.onnx"],
                              capture_output=True, text=True)
        self.assertEqual(told.returncode, 2)
        self.assertIn("holds no training", told.stderr)

    def test_parity_inputs_are_blocks(self):
        blocks = export.parity_blocks(2)
        shown = export.shown(blocks, 40)
        self.assertEqual(shown.shape, (64, 2, 40, 40))
        np.testing.assert_array_equal(shown[3, 1, 8:12, 36:40], np.full((4, 4), blocks[3, 1, 2, 9]))


class Environments(unittest.TestCase):
    def test_stable_baselines_gets_what_gymnasium_gets(self):
        settings = dict(size=40, noise_free=False, action="move", max_episode_steps=2, reward="paper")
        from relign_bench.vector_environment import AlignmentVectorEnv

        ours = AlignmentVectorEnv(2, autoreset_mode="SameStep", **settings)
        theirs = StableBaselinesEnv(2, **settings)
        theirs.seed(5)
        first, _ = ours.reset(seed=5)
        np.testing.assert_array_equal(theirs.reset(), first)
        moves = np.full((2, 5), 0.05, np.float32)
        ours.step(moves)
        theirs.step(moves)
        seen, rewards, _, truncated, told = ours.step(moves)
        observations, got, over, infos = theirs.step(moves)
        np.testing.assert_array_equal(observations, seen)
        np.testing.assert_allclose(got, rewards, rtol=1e-6)
        np.testing.assert_array_equal(over, truncated)
        np.testing.assert_array_equal(infos[1]["terminal_observation"], told["final_obs"][1])
        self.assertTrue(infos[0]["TimeLimit.truncated"])
        self.assertEqual(infos[0]["episode"]["l"], 2)

    def test_a_perfect_guess_earns_most(self):
        class Optimum:
            def optima(self, offsets):
                return np.tile(np.full(5, 0.5), (len(offsets), 1))

        directions = Directions("relign_od", 40)
        env = GuidedEnv("relign_od", (0.0,), 4, 40, directions, Optimum(), seed=1, threads=1)
        env.reset()
        for step in range(1, EPISODE + 1):
            _, rewards, over, infos = env.step(env._along / exploration(directions))
        # What is left is the stage's distortion of the last, small moves.
        self.assertGreater(rewards.min(), -np.log10(3))
        self.assertTrue(over.all())
        self.assertEqual(infos[0]["episode"]["l"], EPISODE)
        self.assertFalse(infos[0]["TimeLimit.truncated"])

    def test_first_steps_cost_no_more_than_the_floor(self):
        directions = Directions("relign_od", 40)
        cost = np.sqrt(directions.values) * exploration(directions)
        self.assertLess(cost.max(), FLOOR * 1.0001)


class PackageNetwork(unittest.TestCase):
    def test_is_that_of_the_package(self):
        from gymnasium import spaces

        features = PackageFeatures(spaces.Box(0, 255, (5, 200, 200), np.uint8))
        convolutions = [layer for layer in features.convolutions if isinstance(layer, torch.nn.Conv2d)]
        self.assertEqual([(c.out_channels, c.kernel_size, c.stride) for c in convolutions],
                         [(32, (3, 3), (2, 2)), (64, (3, 3), (2, 2)), (128, (3, 3), (2, 2))])
        self.assertEqual(features.linear[0].in_features, 128 * 3 * 3)
        # ReLU before the pooling, as the package has it, gives the same.
        pictures = torch.rand(2, 5, 200, 200)
        x = pictures
        for convolution in convolutions:
            x = torch.nn.functional.max_pool2d(torch.relu(convolution(x)), 2)
        torch.testing.assert_close(features.convolutions(pictures), x.flatten(1), rtol=1e-4, atol=1e-5)


if __name__ == "__main__":
    unittest.main()
