"""The vector environment and the batch with device="cuda" against "cpu" (support.OnGpu)."""

import os
import pathlib
import sys
import unittest
from unittest import mock

from support import SMALL, OnGpu, make, make_vector, np, same

from relign_bench import Batch, _cuda

try:
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: these tests need torch") from None


def host(value):
    """Observations with arrays in the place of tensors, which they must be."""
    if isinstance(value, dict):
        return {key: host(part) for key, part in value.items()}
    assert isinstance(value, torch.Tensor) and value.device == torch.device(_cuda.DEVICE), value
    return value.cpu().numpy()


class VectorEnvironment(OnGpu):
    def compare(self, steps, tensors=False, **arguments):
        """Steps both kinds with the same actions; returns the observations of "cuda"."""
        here, there = make_vector(4, **arguments), make_vector(4, device="cuda", **arguments)
        (one, infos), (other, other_infos) = here.reset(seed=5), there.reset(seed=5)
        random, seen = np.random.default_rng(2), []
        for _ in range(steps + 1):
            self.assertTrue(same(one, host(other)))
            final, other_final = infos.pop("final_obs", None), other_infos.pop("final_obs", None)
            self.assertTrue(same(dict(infos), dict(other_infos)))
            for k in range(4 if final is not None else 0):
                self.assertEqual(final[k] is None, other_final[k] is None)
                self.assertTrue(final[k] is None or same(final[k], host(other_final[k])))
            seen.append(other)
            actions = random.uniform(-1, 1, here.action_space.shape).astype(np.float32)
            one, *rest, infos = here.step(actions)
            other, *other_rest, other_infos = there.step(torch.from_numpy(actions).to(_cuda.DEVICE) if tensors else actions)
            for mine, others in zip(rest, other_rest):
                np.testing.assert_array_equal(mine, others)
        return seen

    def test_has_the_bits_of_the_cpu(self):
        seen = self.compare(4, frame_stack=3, max_episode_steps=3)
        self.assertEqual((seen[0].dtype, tuple(seen[0].shape)), (torch.uint8, (4, 3, 20, 20)))
        self.assertFalse(torch.equal(seen[0], seen[1]), "an observation is a copy")

    def test_has_the_bits_of_the_cpu_in_every_setting(self):
        for arguments in (dict(observation="float32", include_actions=True, autoreset_mode="SameStep", max_episode_steps=2),
                          dict(score="rmse_binary", reward="potential", noise_level="tolerances-stepper-stage", frame_stack=2)):
            with self.subTest(arguments):
                self.compare(3, **arguments)

    def test_has_the_bits_of_the_cpu_with_random_imaging(self):
        errors = pathlib.Path(__file__).parents[2] / "python/relign_bench/training/randomisation.json"
        seen = self.compare(3, scene_parameters={"imaging_errors": str(errors)}, max_episode_steps=2)
        ideal = make_vector(4).reset(seed=5)[0]
        self.assertFalse(same(host(seen[0]), ideal))

    def test_takes_actions_that_are_tensors(self):
        self.compare(1, tensors=True)

    def test_resets_the_environments_of_a_mask(self):
        options = dict(options={"reset_mask": np.array([False, True, False, True])})
        envs = [make_vector(4, autoreset_mode="Disabled", max_episode_steps=1, device=device) for device in ("cpu", "cuda")]
        results = []
        for env in envs:
            env.reset(seed=1)
            results.append(env.reset(seed=9, **options)[0])
        self.assertTrue(same(results[0], host(results[1])))

    def test_bins_captures_on_the_gpu(self):
        here, there = (make_vector(2, observation_size=10, observation="float32", **device)
                       for device in ({}, dict(device="cuda")))
        np.testing.assert_array_equal(host(there.reset(seed=3)[0]), here.reset(seed=3)[0])

    def test_renders_pictures(self):
        env = make_vector(1, device="cuda", render_mode="rgb_array")
        env.reset(seed=1)
        other = make_vector(1, render_mode="rgb_array")
        other.reset(seed=1)
        self.assertTrue(same(env.render()[0], other.render()[0]))


class TheBatch(OnGpu):
    def test_keeps_images_in_one_tensor(self):
        batch, other = Batch(2, **SMALL, device="cuda"), Batch(2, **SMALL)
        address = batch.frames.data_ptr()
        for one in (batch, other):
            one.reset([0, 1], [3, 4])
            one.move_by([1], np.full((1, 5), 0.05))
        self.assertEqual(batch.frames.data_ptr(), address)
        self.assertTrue(same(host(batch.frames), other.frames))
        poses = np.full((2, 5), 0.45)
        self.assertTrue(same(host(batch.capture_at([1, 0], poses, [7, 8])), other.capture_at([1, 0], poses, [7, 8])))
        self.assertTrue(same(batch.render_at([1], poses[:1]), other.render_at([1], poses[:1])))
        for mine, others in zip(batch.noise_free_mse([0, 1]), other.noise_free_mse([0, 1])):
            np.testing.assert_array_equal(mine, others)


class Refusals(unittest.TestCase):
    def test_of_a_machine_without_gpu_is_the_sentence_of_doctor(self):
        with mock.patch.dict(os.environ, {"RELIGN_LIBCUDA": "/none/libcuda.so.1"}), \
                self.assertRaisesRegex(ValueError, "^no NVIDIA driver: /none/libcuda.so.1: [^\n]*$"):
            make_vector(1, device="cuda")

    def test_of_other_devices_name_those_that_exist(self):
        with self.assertRaisesRegex(ValueError, "^unknown device 'gpu'; devices: cpu, cuda$"):
            make_vector(1, device="gpu")

    def test_of_a_single_environment(self):
        with self.assertRaisesRegex(ValueError, "use gymnasium.make_vec"):
            make(device="cuda")


class WithoutTorch(OnGpu):
    def test_is_one_sentence(self):
        with mock.patch.dict(sys.modules, {"torch": None}), self.assertRaisesRegex(ValueError, "pip install torch"):
            make_vector(1, device="cuda")


if __name__ == "__main__":
    unittest.main()
