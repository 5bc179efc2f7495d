"""relign-train ppo: runs of a minute, interrupted and resumed. Needs torch and Stable-Baselines3."""

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
    raise unittest.SkipTest(f"{problem}: training needs torch and stable-baselines3, from the Python index") from None

from relign_bench.training import export
from relign_bench.training.directions import Directions
from relign_bench.training.frames import FrameRolloutBuffer
from relign_bench.training.imitate import Recipe as ImitateRecipe
from relign_bench.training.imitate import Training
from relign_bench.training.policies import PackageFeatures
from relign_bench.training.privileged import EPISODE, FLOOR, PrivilegedEnv, exploration
from relign_bench.training.recipe import PRESETS
from relign_bench.training.reinforce import Reinforcement
from relign_bench.training.settings import with_goal, with_settings
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
        """The folder of an imitation run that has not trained yet."""
        recipe = ImitateRecipe(size=40, levels=(0.0,), optimum_samples=32)
        training = Training(recipe, self.folder / "warm", threads=1, log=quiet)
        training.seconds = 1800.0
        training._save(0, torch.optim.Adam(training.net.parameters()))
        return self.folder / "warm"

    def expect_same(self, whole, resumed):
        for name, value in whole.model.policy.state_dict().items():
            np.testing.assert_array_equal(value.numpy(), resumed.model.policy.state_dict()[name].numpy(), name)
        rows = [[{k: v for k, v in row.items() if k != "hours"} for row in run.rows] for run in (whole, resumed)]
        self.assertEqual(*rows)


class Segments(Folder):
    def test_interrupted_paper_recipe_resumes_to_the_same_weights(self):
        whole = Reinforcement(PAPER, self.folder / "whole", threads=1, log=quiet)
        whole.run()
        Reinforcement(PAPER, self.folder / "parts", threads=1, log=quiet).run(until=1)
        resumed = Reinforcement(PAPER, self.folder / "parts", threads=1, log=quiet)
        self.assertEqual(resumed.done, 1)
        resumed.run()
        self.expect_same(whole, resumed)
        self.assertEqual([row["steps"] for row in whole.rows], [40, 80, 120])
        self.assertEqual((self.folder / "whole/curve.csv").read_text().count("\n"), 4)
        self.assertTrue((self.folder / "whole/curve.png").read_bytes().startswith(b"\x89PNG"))

    def test_run_can_be_extended_when_the_rate_is_constant(self):
        whole = Reinforcement(PAPER, self.folder / "whole", threads=1, log=quiet)
        whole.run()
        less = dataclasses.replace(PAPER, total=80)
        Reinforcement(less, self.folder / "longer", threads=1, log=quiet).run()
        longer = Reinforcement(PAPER, self.folder / "longer", threads=1, log=quiet)
        self.assertEqual((longer.done, json.loads((self.folder / "longer/recipe.json").read_text())["total"]), (2, PAPER.total))
        longer.run()
        self.expect_same(whole, longer)
        with self.assertRaisesRegex(ValueError, "another recipe \\(total: 120 in the folder, 80 given\\)"):
            Reinforcement(less, self.folder / "longer", threads=1, log=quiet)
        Reinforcement(dataclasses.replace(less, last_rate=0.0), self.folder / "falls", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "another recipe \\(total: 80 in the folder, 120 given\\)"):
            Reinforcement(dataclasses.replace(PAPER, last_rate=0.0), self.folder / "falls", threads=1, log=quiet)

    def test_interrupted_tuned_recipe_resumes_to_the_same_weights_after_the_warm_up(self):
        warm = self.warm_start()
        whole = Reinforcement(TUNED, self.folder / "whole", warm, threads=1, log=quiet)
        first = {name: value.clone() for name, value in whole.model.policy.net.state_dict().items()}
        whole.run(until=1)
        for name, value in whole.model.policy.net.state_dict().items():
            np.testing.assert_array_equal(value.numpy(), first[name].numpy(), name)  # only the critic has learnt
        whole.run()
        changed = [name for name, value in whole.model.policy.net.state_dict().items() if not torch.equal(value, first[name])]
        self.assertIn("head.weight", changed)
        Reinforcement(TUNED, self.folder / "parts", warm, threads=1, log=quiet).run(until=2)
        resumed = Reinforcement(TUNED, self.folder / "parts", warm, threads=1, log=quiet)
        resumed.run()
        self.expect_same(whole, resumed)

    def test_other_algorithms_of_the_paper_train(self):
        for algorithm in ("a2c", "trpo", "recurrent-ppo"):
            with self.subTest(algorithm):
                if algorithm != "a2c":
                    try:
                        import sb3_contrib  # noqa: F401
                    except ImportError as problem:
                        self.skipTest(f"{problem}: needs sb3-contrib, from the Python index")
                recipe = dataclasses.replace(PAPER, algorithm=algorithm, total=40)
                training = Reinforcement(recipe, self.folder / algorithm, threads=1, log=quiet)
                training.run()
                self.assertEqual(training.rows[-1]["steps"], 40)

    def test_goal_follows_the_level_unless_it_is_set(self):
        def goal(*settings, preset="paper"):
            return with_goal(with_settings(PRESETS[preset], settings), settings).goal

        self.assertEqual([goal(f"level={level}") for level in (0, 0.25, 0.5)], [0.051, 0.0555, 0.06])
        self.assertEqual(goal("level=0.5", "goal=0.02"), 0.02)
        self.assertEqual(goal("level=0.5", "goal=0"), 0)
        self.assertEqual(goal("level=0.3", preset="tuned"), 0)
        with self.assertRaisesRegex(ValueError, "only for 0, 0.25, 0.5; add --set goal="):
            goal("level=0.3")

    def test_wrong_recipes_are_refused(self):
        with self.assertRaisesRegex(ValueError, "unknown input 'bytes'; inputs: float32, uint8"):
            Reinforcement(dataclasses.replace(PAPER, input="bytes"), self.folder / "z", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "device 'mps' is not supported; expected 'cpu' or 'cuda'"):
            Reinforcement(PAPER, self.folder / "z", threads=1, log=quiet, device="mps")
        with self.assertRaisesRegex(ValueError, "size=40.*at least 64 columns"):
            Reinforcement(dataclasses.replace(PAPER, size=40), self.folder / "z", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "needs --warm-start FOLDER"):
            Reinforcement(TUNED, self.folder / "x", threads=1, log=quiet)
        Reinforcement(PAPER, self.folder / "y", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "another recipe"):
            Reinforcement(dataclasses.replace(PAPER, rate=1e-3), self.folder / "y", threads=1, log=quiet)


class Export(Folder):
    def test_side_files_of_both_recipes(self):
        command = [sys.executable, "-m", "relign_bench.training"]
        Reinforcement(PAPER, self.folder / "paper", threads=1, log=quiet).run(until=1)
        subprocess.run([*command, "export", self.folder / "paper", "-o", self.folder / "paper.onnx"], check=True,
                       capture_output=True)
        side = json.loads((self.folder / "paper.json").read_text())
        self.assertEqual((side["output"], side["observation"]["frames"], side["trained"]["steps"]), ("move", 5, 40))
        Reinforcement(TUNED, self.folder / "tuned", self.warm_start(), threads=1, log=quiet).run(until=2)
        subprocess.run([*command, "export", self.folder / "tuned", "-o", self.folder / "tuned.onnx"], check=True,
                       capture_output=True)
        side = json.loads((self.folder / "tuned.json").read_text())
        self.assertEqual((side["output"], side["observation"]["frames"]), ("way", 1))
        self.assertEqual(side["trained"]["warm_start"], {"hours": 0.5})  # part of the network's cost
        self.assertEqual(len(side["parity"]["inputs"]), 64)
        self.assertEqual(len(side["reference"]["means"]), 400)

    def test_folder_without_a_run_is_refused(self):
        done = subprocess.run([sys.executable, "-m", "relign_bench.training", "export", self.folder, "-o", "x.onnx"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("is not the folder of a run", done.stderr)

    def test_parity_inputs_are_blocks(self):
        blocks = export.parity_blocks(2)
        inputs = export.enlarged(blocks, 40)
        self.assertEqual(inputs.shape, (64, 2, 40, 40))
        np.testing.assert_array_equal(inputs[3, 1, 8:12, 36:40], np.full((4, 4), blocks[3, 1, 2, 9]))


class Environments(unittest.TestCase):
    def test_stable_baselines_environment_equals_the_vector_environment(self):
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
        expected, rewards, _, truncated, expected_infos = ours.step(moves)
        observations, got, over, infos = theirs.step(moves)
        np.testing.assert_array_equal(observations, expected)
        np.testing.assert_allclose(got, rewards, rtol=1e-6)
        np.testing.assert_array_equal(over, truncated)
        np.testing.assert_array_equal(infos[1]["terminal_observation"], expected_infos["final_obs"][1])
        self.assertTrue(infos[0]["TimeLimit.truncated"])
        self.assertEqual(infos[0]["episode"]["l"], 2)

    def test_perfect_residual_earns_nearly_the_highest_reward(self):
        class Optimum:
            def optima(self, offsets):
                return np.tile(np.full(5, 0.5), (len(offsets), 1))

        directions = Directions("relign_od", 40)
        env = PrivilegedEnv("relign_od", (0.0,), 4, 40, directions, Optimum(), seed=1, threads=1)
        env.reset()
        for _ in range(EPISODE):
            _, rewards, over, infos = env.step(env._residuals / exploration(directions))
        # The distortion of the last, small moves remains.
        self.assertGreater(rewards.min(), -np.log10(3))
        self.assertTrue(over.all())
        self.assertEqual(infos[0]["episode"]["l"], EPISODE)
        self.assertFalse(infos[0]["TimeLimit.truncated"])

    def test_initial_exploration_costs_at_most_the_floor(self):
        directions = Directions("relign_od", 40)
        cost = np.sqrt(directions.values) * exploration(directions)
        self.assertLess(cost.max(), FLOOR * 1.0001)


class PackageNetwork(unittest.TestCase):
    def test_has_the_layers_of_the_package(self):
        from gymnasium import spaces

        features = PackageFeatures(spaces.Box(0, 3.5, (5, 200, 200), np.float32))
        self.assertEqual([name for name, _ in features.named_parameters()],
                         [f"{layer}.{kind}" for layer in ("cnn.0", "cnn.3", "cnn.6", "linear.0")
                          for kind in ("weight", "bias")])
        self.assertEqual(features.linear[0].in_features, 128 * 3 * 3)

    def test_compiled_layers_have_the_values_and_gradients_of_those_of_torch(self):
        from gymnasium import spaces

        for size in (64, 100):
            features = PackageFeatures(spaces.Box(0, 3.5, (5, size, size), np.float32))
            pictures = torch.rand(6, 5, size, size, generator=torch.manual_seed(2)) - 0.3
            pictures[0] = 0  # every window of the first pooling has equal values
            results = []
            for forward in (features, lambda x, of=features: of.linear(of.cnn(x))):
                features.zero_grad()
                values = forward(pictures)
                values.square().sum().backward()
                results.append([values.detach().clone(), *(parameter.grad.clone() for parameter in features.parameters())])
            for ours, by_torch in zip(*results):
                torch.testing.assert_close(ours, by_torch, rtol=1e-4, atol=1e-5)


class FrameBuffer(unittest.TestCase):
    def test_equals_the_buffer_of_stable_baselines(self):
        from gymnasium import spaces
        from stable_baselines3.common.buffers import RolloutBuffer

        for kind, high in ((np.uint8, 255), (np.float32, 1)):
            space = spaces.Box(0, high, (3, 4, 5), kind)
            arguments = (7, space, spaces.Box(-1, 1, (2,), np.float32))
            buffers = [made(*arguments, device="cpu", n_envs=2) for made in (RolloutBuffer, FrameRolloutBuffer)]
            random, stack = np.random.default_rng(4), np.zeros((2, 3, 4, 5), kind)
            starts = np.ones(2, bool)
            for _ in range(3):  # rollouts, across which episodes continue
                for buffer in buffers:
                    buffer.reset()
                for _ in range(7):
                    stack[starts] = 0
                    stack[:, :-1] = stack[:, 1:].copy()
                    stack[:, -1] = random.uniform(0, high, (2, 4, 5)).astype(kind)
                    step = (stack.copy(),
                            random.uniform(size=(2, 2)), random.uniform(size=2), starts,
                            torch.tensor(random.uniform(size=2)), torch.tensor(random.uniform(size=2)))
                    for buffer in buffers:
                        buffer.add(*step)
                    starts = random.uniform(size=2) < 0.3
                samples = []
                for buffer in buffers:
                    buffer.compute_returns_and_advantage(torch.zeros(2), starts)
                    np.random.seed(5)
                    samples.append([{name: value.clone() for name, value in batch._asdict().items() if value is not None}
                                    for _ in range(2) for batch in buffer.get(6)])
                for one, other in zip(*samples):
                    self.assertEqual(one.keys(), other.keys())
                    for field, value in one.items():
                        torch.testing.assert_close(other[field], value, rtol=0, atol=0)


if __name__ == "__main__":
    unittest.main()
