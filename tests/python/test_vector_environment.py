"""The vector environment against single environments."""

import unittest

from support import ID, SMALL, gymnasium, make, make_vector, np, same

from relign_bench import AlignmentVectorEnv

AutoresetMode = gymnasium.vector.AutoresetMode


def rollout(env, steps, seed):
    """Results of `reset` and of `steps` steps with fixed random actions."""
    random = np.random.default_rng(11)
    results = [env.reset(seed=seed)]
    for _ in range(steps):
        results.append(env.step(random.uniform(-1, 1, env.action_space.shape).astype(np.float32)))
    return results


class Vector(unittest.TestCase):
    def test_equals_single_environments_bit_for_bit(self):
        count, seed = 3, 40
        vector = make_vector(count, frame_stack=2)
        singles = [make(frame_stack=2) for _ in range(count)]
        observations, infos = vector.reset(seed=seed)
        for k, env in enumerate(singles):
            observation, info = env.reset(seed=seed + k)
            self.assertTrue(same(observation, observations[k]))
            self.assertTrue(same(info, {key: infos[key][k] for key in info}))
        random = np.random.default_rng(1)
        for _ in range(3):
            actions = random.uniform(-1, 1, (count, 5)).astype(np.float32)
            observations, rewards, terminated, truncated, infos = vector.step(actions)
            for k, env in enumerate(singles):
                observation, reward, ends, cut, info = env.step(actions[k])
                self.assertTrue(same(observation, observations[k]))
                self.assertEqual((reward, ends, cut), (rewards[k], terminated[k], truncated[k]))
                self.assertTrue(same(info, {key: infos[key][k] for key in info}))

    def test_wrong_numbers_are_named(self):
        for count in (-1, 1.5):
            with self.assertRaisesRegex(ValueError, f"num_envs must be a positive integer, not {count}"):
                AlignmentVectorEnv(count, **SMALL)
        with self.assertRaisesRegex(ValueError, "instance must be a non-negative integer, not 3.7"):
            make_vector(2).reset(options={"instance": 3.7})

    def test_does_not_depend_on_the_number_of_threads(self):
        one, many = (rollout(make_vector(5, threads=threads, max_episode_steps=2), 4, 3) for threads in (1, 4))
        for first, second in zip(one, many):
            for a, b in zip(first, second):
                self.assertTrue(same(a, b))

    def test_next_step_mode_starts_in_the_next_step(self):
        env = make_vector(2, max_episode_steps=2)
        self.assertEqual(env.metadata["autoreset_mode"], AutoresetMode.NEXT_STEP)
        _, begin = env.reset(seed=1)
        still = np.zeros((2, 5), np.float32)
        env.step(still)
        self.assertTrue(env.step(still)[3].all())
        _, rewards, terminated, truncated, infos = env.step(still)
        self.assertFalse(truncated.any() or terminated.any() or rewards.any())
        self.assertTrue((infos["instance"] != begin["instance"]).all())

    def test_same_step_mode_starts_at_once_and_keeps_the_last_observation(self):
        kept = make_vector(2, max_episode_steps=2, autoreset_mode="SameStep")
        plain = make_vector(2, max_episode_steps=2, autoreset_mode=AutoresetMode.DISABLED)
        still = np.zeros((2, 5), np.float32)
        for env in (kept, plain):
            env.reset(seed=1)
            env.step(still)
        observations, _, _, truncated, infos = kept.step(still)
        last, _, _, _, last_infos = plain.step(still)
        self.assertTrue(truncated.all() and infos["_final_obs"].all())
        for k in range(2):
            self.assertTrue(same(infos["final_obs"][k], last[k]))
            self.assertFalse(same(observations[k], last[k]))
        self.assertTrue(same(infos["final_info"]["true_pose"], last_infos["true_pose"]))

    def test_disabled_mode_waits_for_a_reset(self):
        env = make_vector(2, max_episode_steps=1, autoreset_mode="Disabled")
        env.reset(seed=1)
        still = np.zeros((2, 5), np.float32)
        env.step(still)
        with self.assertRaises(gymnasium.error.ResetNeeded):
            env.step(still)
        before = env.task.batch.instance(1)["number"]
        env.reset(options={"reset_mask": np.array([True, False])})
        self.assertEqual(env.task.batch.instance(1)["number"], before)

    def test_wrappers_of_gymnasium_work(self):
        env = gymnasium.wrappers.vector.RecordEpisodeStatistics(
            gymnasium.make_vec(ID, num_envs=2, scene="gaussian_spot", noise_level="rho0", max_episode_steps=3))
        env.reset(seed=1)
        for _ in range(3):
            *_, infos = env.step(env.action_space.sample())
        self.assertIn("episode", infos)

    def test_wrong_arguments_are_refused(self):
        env = make_vector(2)
        with self.assertRaises(gymnasium.error.ResetNeeded):
            env.step(np.zeros((2, 5), np.float32))
        env.reset(seed=[1, 2])
        with self.assertRaisesRegex(ValueError, "2, 5"):
            env.step(np.zeros((3, 5), np.float32))
        with self.assertRaisesRegex(ValueError, "3 seeds for 2 environments"):
            env.reset(seed=[1, 2, 3])


if __name__ == "__main__":
    unittest.main()
