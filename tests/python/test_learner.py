"""What relign-train ppo gives Stable-Baselines3: environments, network and buffer. Needs torch and stable-baselines3."""

import unittest

from support import np

try:
    import stable_baselines3  # noqa: F401
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch and stable-baselines3, from the Python index") from None

from relign_bench.training.directions import Directions
from relign_bench.training.frames import FrameRolloutBuffer
from relign_bench.training.policies import PackageFeatures
from relign_bench.training.privileged import EPISODE, FLOOR, PrivilegedEnv, excess, exploration, reward
from relign_bench.training.recipe import SHAPED, SHAPED_EVEN, SHAPED_LINEAR, SHAPED_NEAR, SHAPED_PAPER, SHAPED_REWARDS
from relign_bench.training.shaped import ShapedEnv
from relign_bench.training.stable_baselines import StableBaselinesEnv


class Optimum:
    """Every instance's optimum is the middle of the travel."""

    def optima(self, offsets):
        return np.tile(np.full(5, 0.5), (len(offsets), 1))


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

    def test_shaped_rewards_differ_where_a_tilt_undoes_a_shift(self):
        directions, rewards = Directions("relign_od", 40), {}
        before = directions.values.copy()
        effects = np.maximum(before, 0.01 * before[0])
        for name in SHAPED_REWARDS:
            env = ShapedEnv(2, name, directions, Optimum(), size=40, noise_free=False, action="move")
            env.seed(5)
            env.reset()
            poses = np.full((2, 5), 0.5)
            poses[1] += 0.4 * directions.vectors[:, 4]  # the image hardly changes
            rewards[name] = env.rewards(np.full(2, -0.25), {"true_pose": poses}, np.zeros(2, bool))
            after = {"true_pose": np.full((2, 5), 0.9), "final_info": {"true_pose": poses}}
            ended = env.rewards(np.full(2, -0.25), after, np.array([False, True]))
            self.assertEqual(ended[1], rewards[name][1])  # at the last pose of the episode, not at the next one's first
            self.assertLess(ended[0], rewards[name][0])
        np.testing.assert_array_equal(directions.values, before)
        np.testing.assert_allclose(rewards[SHAPED], [0, -np.log10(1 + 0.4 * np.sqrt(before[4]) / FLOOR)], atol=1e-9)
        np.testing.assert_allclose(rewards[SHAPED_EVEN], [0, -np.log10(1 + 0.4 * np.sqrt(effects[4]) / FLOOR)], atol=1e-9)
        self.assertLess(rewards[SHAPED_EVEN][1], rewards[SHAPED][1] - 0.5)
        np.testing.assert_allclose(rewards[SHAPED_NEAR], rewards[SHAPED] - [0, 0.4], atol=1e-9)
        np.testing.assert_allclose(rewards[SHAPED_PAPER], 0.1 * rewards[SHAPED] - 0.25, atol=1e-9)
        np.testing.assert_allclose(rewards[SHAPED_LINEAR], [0, -0.4 - 0.4 * np.sqrt(before[4])], atol=1e-9)

    def test_near_reward_does_not_count_distances_of_less_than_a_tenth(self):
        directions = Directions("relign_od", 40)
        env = ShapedEnv(2, SHAPED_NEAR, directions, Optimum(), size=40, noise_free=False, action="move")
        env.seed(5)
        env.reset()
        poses = 0.5 + np.outer([0.099, 0.101], directions.vectors[:, 4])
        rewards = env.rewards(np.zeros(2), {"true_pose": poses}, np.zeros(2, bool))
        expected = -np.log10(1 + np.array([0.099, 0.101]) * np.sqrt(directions.values[4]) / FLOOR) - [0, 0.101]
        np.testing.assert_allclose(rewards, expected, atol=1e-9)

    def test_exploration_hides_the_distance_in_a_logarithm(self):
        """The figures of docs/appendix_training.md: around the optimum, by 0.03 of the travel per axis."""
        directions = Directions("relign_od", 100)
        around = np.random.default_rng(1).normal(0, 0.03, (20_000, 5))
        self.assertAlmostEqual(reward(around, directions).std(), 0.26, delta=0.005)
        self.assertAlmostEqual(excess(around, directions).std(), 0.024, delta=0.001)
        nearer, farther = (reward(around + [0, 0, 0, at, 0], directions).mean() for at in (0.4, 0.5))
        self.assertAlmostEqual(nearer - farther, 0.014, delta=0.001)

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
