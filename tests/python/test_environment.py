"""The environment: Gymnasium's rules, and the conventions of the paper's package."""

import inspect
import unittest
import warnings
from importlib.util import find_spec

from support import ID, SMALL, gymnasium, make, np, same

from relign_bench import AlignmentEnv, AlignmentVectorEnv


class Rules(unittest.TestCase):
    def test_passes_the_checker_of_gymnasium(self):
        from gymnasium.utils.env_checker import check_env

        for scene in ("relign_od", "gaussian_spot", "relign_l2", "cooke_triplet"):
            level = "rho0" if scene == "gaussian_spot" else "rho0.25"
            size = {} if scene == "gaussian_spot" else {"size": 40}
            with self.subTest(scene), warnings.catch_warnings():
                warnings.simplefilter("error")
                # The checker also opens a window, which needs pygame.
                check_env(gymnasium.make(ID, scene=scene, noise_level=level, **size).unwrapped,
                          skip_render_check=find_spec("pygame") is None)

    def test_passes_the_checker_of_stable_baselines3(self):
        try:
            from stable_baselines3.common.env_checker import check_env
        except ImportError:
            self.skipTest("stable_baselines3 is not installed")
        for arguments in ({}, {"frame_stack": 3}, {"include_actions": True}):
            with self.subTest(arguments), warnings.catch_warnings():
                warnings.simplefilter("error")
                check_env(make(**{**arguments, "size": 40}), warn=True)

    def test_seed_decides_this_episode_and_those_that_follow(self):
        one, other = make(), make()
        first = one.reset(seed=7)
        self.assertTrue(same(first[0], other.reset(seed=7)[0]))
        second = one.reset()
        self.assertFalse(same(first[0], second[0]))
        self.assertTrue(same(second[0], other.reset()[0]), "the next episode, without a seed, is equal too")
        self.assertFalse(same(first[0], one.reset(seed=8)[0]))

    def test_options_choose_the_instance(self):
        env = make()
        _, info = env.reset(seed=1, options={"instance": 3, "instances": "benchmark"})
        self.assertEqual(info["instance"], 3)
        from relign_bench import Bench

        np.testing.assert_array_equal(info["true_pose"], Bench(**SMALL).instance(3).start)
        with self.assertRaisesRegex(ValueError, "options: instance, instances"):
            env.reset(options={"number": 3})
        with self.assertRaisesRegex(ValueError, "training, tuning, benchmark"):
            env.reset(options={"instance": 3, "instances": "test"})

    def test_training_tuning_and_benchmark_share_no_instance(self):
        env = make()
        starts = [env.reset(options={"instance": 5, "instances": family})[1]["true_pose"].tolist()
                  for family in ("training", "tuning", "benchmark")]
        self.assertEqual(len(set(map(tuple, starts))), 3)

    def test_keywords_are_shown_and_others_refused(self):
        for environment, first in ((AlignmentEnv, "scene"), (AlignmentVectorEnv, "num_envs")):
            shown = inspect.signature(environment).parameters
            self.assertEqual(next(iter(shown)), first)
            self.assertEqual((shown["frame_stack"].default, shown["threads"].default), (1, None))
            documented = inspect.getdoc(AlignmentEnv)
            for name in inspect.signature(AlignmentEnv).parameters:
                self.assertIn(f"\n    {name}: " if name != "device" else "", documented)
            with self.assertRaisesRegex(TypeError, "unexpected keyword argument 'frames'"):
                environment(frames=2)

    def test_wrong_arguments_name_those_allowed(self):
        for arguments, words in (
            ({"reward": "papper"}, "unknown reward 'papper'; did you mean 'paper'\\? rewards: paper"),
            ({"score": "mse"}, "scores: combined"),
            ({"observation": "rgb"}, "observations: uint8, float32"),
            ({"clipping": "none"}, "clipping: soft, hard"),
            ({"scene": "relign_of"}, "did you mean 'relign_od'"),
            ({"noise_level": "rho1"}, "unknown noise level 'rho1'"),
            ({"scene": "gaussian_spot", "noise_level": "rho0"}, "scene 'gaussian_spot' has a fixed sensor"),
            ({"reward": "minus_one_plus"}, "needs a goal, such as goal=0.05"),
            ({"frame_stack": 0}, "frame_stack must be a positive integer, not 0"),
            ({"frame_stack": 1.5}, "frame_stack must be a positive integer, not 1.5"),
            ({"size": 20.5}, "size must be a positive integer, not 20.5"),
            ({"observation_size": 10.5}, "observation_size must be a positive integer, not 10.5"),
            ({"goal": float("nan")}, "goal must be a finite number or None, not nan"),
            ({"goal": "x"}, "goal must be a finite number or None, not 'x'"),
            ({"noise_free": "no"}, "noise_free must be True or False, not 'no'"),
            ({"include_actions": "no"}, "include_actions must be True or False, not 'no'"),
            ({"suite_seed": -1}, "suite_seed must be a non-negative integer, not -1"),
            ({"threads": -3}, "threads must be a positive integer, not -3"),
            ({"observation_size": 3}, "does not divide captures of 20 x 20 pixels; possible sizes: 20, 10, 5, 4, 2"),
        ):
            with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                make(**arguments)
        with self.assertRaisesRegex(ValueError, "max_episode_steps must be a positive integer, not 2.5"):
            AlignmentEnv(max_episode_steps=2.5, **SMALL)
        env = make()
        for number, words in ((3.7, "a non-negative integer, not 3.7"), (-1, "a non-negative integer, not -1"),
                              (2**63, "an integer from 0 to 9223372036854775807, not 9223372036854775808")):
            with self.assertRaisesRegex(ValueError, f"instance must be {words}"):
                env.reset(options={"instance": number})
        with self.assertRaises(gymnasium.error.ResetNeeded):
            env.step(np.zeros(5, np.float32))
        env.reset(seed=1)
        with self.assertRaisesRegex(ValueError, "5 finite numbers"):
            env.step(np.full(5, np.nan, np.float32))
        with self.assertRaisesRegex(ValueError, "5 finite numbers"):
            env.step(np.zeros(4, np.float32))

    def test_close_twice_is_allowed(self):
        env = make()
        env.close()
        env.close()


class Episodes(unittest.TestCase):
    def test_true_move_is_the_distorted_commanded_move(self):
        # rho0 has only the stage's distortion: true move = D x commanded move.
        env = make(noise_level="rho0", action="move")
        _, before = env.reset(seed=3)
        move = np.array([0.1, -0.05, 0.02, 0.0, -0.1], np.float32) * np.sign(0.5 - before["true_pose"])
        _, _, _, _, after = env.step(move)
        distortion = env.task.batch.instance(0)["distortion"]
        np.testing.assert_allclose(after["true_pose"], before["true_pose"] + distortion @ move, atol=1e-12)
        np.testing.assert_allclose(after["commanded_pose"], before["commanded_pose"] + move, atol=1e-12)

    def test_a_unit_action_is_a_fifth_of_the_travel(self):
        unit, move = make(noise_level="rho0"), make(noise_level="rho0", action="move")
        unit.reset(seed=3), move.reset(seed=3)
        action = np.array([1, -1, 0.5, 0, 0.25], np.float32)
        one, other = unit.step(action), move.step(np.float32(0.2) * action)
        np.testing.assert_allclose(one[4]["true_pose"], other[4]["true_pose"], atol=1e-7)

    def test_an_absolute_action_is_a_pose(self):
        env = make(noise_level="rho0", action="absolute")
        env.reset(seed=3)
        pose = np.array([0.5, 0.4, 0.6, 0.5, 0.45], np.float32)
        _, _, _, _, info = env.step(pose)
        np.testing.assert_allclose(info["commanded_pose"], pose, atol=1e-12)
        # An absolute pose is the same place, wherever the move starts.
        env.step(np.array([0.3, 0.3, 0.3, 0.3, 0.3], np.float32))
        _, _, _, _, again = env.step(pose)
        np.testing.assert_allclose(info["true_pose"], again["true_pose"], atol=1e-12)

    def test_clipping(self):
        for clipping in ("soft", "hard"):
            env = make(noise_level="rho0", action="move", clipping=clipping)
            _, info = env.reset(seed=3)
            toward = np.array([0.2, 0.2, 0, 0, 0], np.float32) * np.where(info["true_pose"] > 0.5, 1, -1)
            for _ in range(6):
                start = info["true_pose"]
                _, _, _, _, info = env.step(toward)
            self.assertTrue(((info["true_pose"] >= 0) & (info["true_pose"] <= 1)).all())
            self.assertTrue(info["limits"].any())
            if clipping == "soft":  # each axis continues to its own limit
                self.assertIn(info["true_pose"][0], (0.0, 1.0))
                self.assertIn(info["true_pose"][1], (0.0, 1.0))
            else:  # the first wall has stopped both: no step was made in the end
                np.testing.assert_allclose(info["true_pose"], start, atol=1e-12)

    def test_budget_truncates_and_goal_terminates(self):
        # gymnasium.make applies max_episode_steps in a wrapper, with the same effect.
        for env in (AlignmentEnv(max_episode_steps=3, **SMALL), gymnasium.make(ID, max_episode_steps=3, **SMALL)):
            env.reset(seed=1)
            ends = [env.step(np.zeros(5, np.float32))[2:4] for _ in range(3)]
            self.assertEqual(ends, [(False, False), (False, False), (False, True)])
        # More than the default of 200: only the given limit counts.
        env = gymnasium.make(ID, max_episode_steps=203, scene="gaussian_spot", noise_level="rho0")
        env.reset(seed=1)
        still = np.zeros(env.action_space.shape, np.float32)
        self.assertEqual([env.step(still)[3] for _ in range(203)], [False] * 202 + [True])
        env = make(goal=100.0)
        env.reset(seed=1)
        self.assertEqual(env.step(np.zeros(5, np.float32))[2:4], (True, False))

    def test_frame_stack_has_zeros_before_the_start(self):
        env = make(frame_stack=3, include_actions=True, observation="float32")
        observation, _ = env.reset(seed=1)
        self.assertEqual(observation["image"].shape, (3, 20, 20))
        self.assertFalse(observation["image"][:2].any())
        self.assertFalse(observation["actions"].any())
        first = observation["image"][2]
        action = np.full(5, 0.5, np.float32)
        observation, _, _, _, _ = env.step(action)
        np.testing.assert_array_equal(observation["image"][1], first)
        np.testing.assert_array_equal(observation["actions"][-5:], action)
        self.assertFalse(observation["image"][0].any())

    def test_observations_are_the_captures(self):
        byte, real = make(), make(observation="float32")
        one, other = byte.reset(seed=5)[0], real.reset(seed=5)[0]
        white = real.task.white
        expected = np.minimum(255, np.floor(other * (255 / (3 * white)) + 0.5))
        self.assertLessEqual(np.abs(one.astype(int) - expected).max(), 1)
        self.assertGreater(one.max(), 0)

    def test_info_has_measured_and_noise_free_error(self):
        env = make()
        _, info = env.reset(seed=2)
        reference = env.task.reference
        np.testing.assert_allclose(info["measured_error"], np.sqrt(np.mean((env.task.frames[0] - reference) ** 2)),
                                   rtol=1e-6)
        # Captures also have noise.
        self.assertLess(info["noise_free_error"], info["measured_error"])
        self.assertNotIn("noise_free_error", make(noise_free=False).reset(seed=2)[1])

    def test_render_returns_an_image_of_the_current_state(self):
        env = make(render_mode="rgb_array")
        env.reset(seed=1)
        before = env.render()
        self.assertEqual((before.ndim, before.shape[2], before.dtype), (3, 3, np.uint8))
        env.step(np.full(5, 0.5, np.float32))
        self.assertFalse(np.array_equal(before, env.render()))
        with self.assertRaisesRegex(ValueError, "render modes"):
            AlignmentEnv(render_mode="ansi", **SMALL)


class Sizes(unittest.TestCase):
    def test_binned_is_the_mean_over_squares(self):
        from relign_bench.conventions import binned

        frame = np.random.default_rng(1).random((40, 60), np.float32)
        for bins in (1, 2, 5, 10):
            found = binned(frame, bins)
            self.assertEqual(found.dtype, np.float32)
            expected = frame.astype(np.float64).reshape(40 // bins, bins, 60 // bins, bins).mean((1, 3))
            np.testing.assert_allclose(found, expected, rtol=1e-6)

    def test_binned_parameters_give_the_light_and_the_noise_of_binned_pixels(self):
        from relign_bench._native import binned_parameters

        whole = make(size=None, observation="float32", noise_free=False)
        half = make(size=None, scene_parameters=binned_parameters("relign_od", 100), observation="float32",
                    noise_free=False)
        self.assertEqual(half.task.reference.shape, (100, 100))
        for env in (whole, half):
            env.reset(options={"instance": 1})
        pose = np.full((1, 5), 0.5)
        binned = np.stack([whole.task.batch.capture_at([0], pose, [k])[0].reshape(100, 2, 100, 2).mean((1, 3))
                           for k in range(60)])
        direct = np.stack([half.task.batch.capture_at([0], pose, [k])[0] for k in range(60)])
        lit = whole.task.reference.reshape(100, 2, 100, 2).mean((1, 3)) > 0.05
        self.assertGreater(lit.sum(), 50)
        mean, other = binned[:, lit].mean(), direct[:, lit].mean()
        self.assertLess(abs(mean / other - 1), 0.02)
        self.assertLess(abs(binned[:, lit].std(0).mean() / direct[:, lit].std(0).mean() - 1), 0.05)


if __name__ == "__main__":
    unittest.main()
