"""Scores and rewards against values computed by hand."""

import unittest

from support import make, np

from relign_bench import rewards

NOMINAL = np.full(2, 0.5)
POSES = np.array([[0.5, 0.55], [0.5, 0.7], [1.0, 0.5]])
MEASURED = np.array([0.03, 0.04, 0.05])


class Scores(unittest.TestCase):
    def of(self, name, frames=(), reference=None):
        return rewards.scores(name, MEASURED, POSES, NOMINAL, frames, reference)

    def test_values(self):
        np.testing.assert_allclose(self.of("combined"), [0.03, 0.24, 0.55])
        np.testing.assert_allclose(self.of("rmse"), MEASURED)
        np.testing.assert_allclose(self.of("distance"), [0.05, 0.2, 0.5])

    def test_binary(self):
        reference = np.array([[0.0, 0.1], [0.1, 0.0]])
        frames = np.array([[[0.0, 0.1], [0.1, 0.0]], [[0.03, 0.1], [0.0, 0.0]], [[0.019, 0.021], [5, 0.02]]])
        np.testing.assert_allclose(self.of("rmse_binary", frames, reference), [0, np.sqrt(0.5), 0])


class Rewards(unittest.TestCase):
    BEFORE, AFTER, COMBINED = np.array([0.3, 0.2, 0.1]), np.array([0.1, 0.25, 0.01]), np.array([0.5, 0.6, 0.7])

    def of(self, name, goal=None):
        return rewards.rewards(name, self.BEFORE, self.AFTER, self.COMBINED, POSES, goal)

    def test_values(self):
        np.testing.assert_allclose(self.of("paper"), [-0.5, -0.6, -0.7])
        np.testing.assert_allclose(self.of("score"), [-0.1, -0.25, -0.01])
        np.testing.assert_allclose(self.of("potential"), [0.2, -0.05, 0.09])
        np.testing.assert_allclose(self.of("minus_one"), [-1, -1, -1])
        np.testing.assert_allclose(self.of("minus_one_plus", goal=0.06), [-0.1, -1, -0.01])
        np.testing.assert_allclose(self.of("minus_one_edge"), [-1, -1, -2])
        np.testing.assert_allclose(self.of("minus_one_edge_package"), [-2, -2, -2])

    def test_rewards_of_an_episode_follow_from_its_infos(self):
        given = {}
        for name in rewards.REWARDS:
            env = make(reward=name, score="rmse", goal=0.01, noise_free=False)
            _, before = env.reset(seed=4)
            _, reward, _, _, after = env.step(np.full(5, -0.5, np.float32))
            given[name] = reward
        distance = np.linalg.norm(after["true_pose"] - 0.5)
        self.assertAlmostEqual(given["paper"], -(after["measured_error"] + (distance if distance > 0.1 else 0)))
        self.assertAlmostEqual(given["score"], -after["measured_error"])
        self.assertAlmostEqual(given["potential"], before["measured_error"] - after["measured_error"])
        self.assertEqual(given["minus_one"], -1)


if __name__ == "__main__":
    unittest.main()
