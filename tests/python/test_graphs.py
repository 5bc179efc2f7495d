"""PPO with recorded graphs against Stable-Baselines3's, and the layers for GPUs against torch's.

Without a GPU the graphs are plain calls, and TRITON_INTERPRET=1 runs the kernels of the layers on the CPU.
"""

import dataclasses
import os
import tempfile
import unittest
from unittest import mock

from support import REAL_GPU, np

try:
    import stable_baselines3
    import torch
    from torch.nn import functional
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch and stable-baselines3, from the Python index") from None

from relign_bench.training.recipe import PRESETS
from relign_bench.training.reinforce import Reinforcement

DEVICE = "cuda" if REAL_GPU else "cpu"
# One rollout, since optimisers amplify what rounding differs by. Episodes of 10 steps are truncated within it.
PAPER = dataclasses.replace(PRESETS["paper"], size=100, environments=2, steps=20, batch=20, epochs=2, episode=10, total=40,
                            stretch=40, rate=1e-3, last_rate=1e-3)


def quiet(_):
    pass


def trained(learner, recipe):
    """The model after a training by a class of learners."""
    with (tempfile.TemporaryDirectory() as folder,
          mock.patch("relign_bench.training.reinforce._learner", lambda *_, **__: learner),
          mock.patch("relign_bench.training.evaluation.TUNING_INSTANCES", 2)):
        model = Reinforcement(recipe, folder, threads=1, log=quiet, device=DEVICE).run()
    assert type(model) is learner
    return model


class Graphs(unittest.TestCase):
    def test_trains_as_stable_baselines(self):
        from relign_bench.training.graphs import GraphPPO

        for changes in ({}, {"batch": 15}, {"target_kl": 1e-6, "epochs": 4}, {"input": "uint8"}):
            with self.subTest(changes):
                recipe = dataclasses.replace(PAPER, **changes)
                expected, found = (trained(learner, recipe) for learner in (stable_baselines3.PPO, GraphPPO))
                self.assertEqual(expected._n_updates, found._n_updates)
                self.assertEqual(found._n_updates < recipe.epochs, "target_kl" in changes)
                others = expected.policy.state_dict()
                self.assertGreater(float((others["log_std"] - recipe.first_log_std).abs().max()), 5e-5, "it has learnt")
                for name, value in found.policy.state_dict().items():
                    np.testing.assert_allclose(value.cpu(), others[name].cpu(), rtol=0, atol=1e-3 if REAL_GPU else 1e-6,
                                               err_msg=name)

    def test_recorded_graphs_do_what_their_functions_do(self):
        from relign_bench.training.graphs import GraphPPO

        # After some rollouts with batches of two sizes.
        model = trained(GraphPPO, dataclasses.replace(PAPER, batch=15, total=120, stretch=120))
        images = model._images()
        drawn = []
        for function in (model._draw, model._policy_graph):
            torch.manual_seed(5)
            with torch.no_grad():
                drawn.append(function(images).clone())
        torch.testing.assert_close(*drawn)
        batch = next(iter(model.rollout_buffer.get(15)))
        gradients = []
        for function in (model._found, lambda batch: model._gradients(batch.observations, batch.actions, batch.old_log_prob,
                                                                     batch.advantages, batch.returns)):
            statistics = function(batch).clone()
            gradients.append([statistics, *(parameter.grad.clone() for parameter in model.policy.parameters())])
        torch.testing.assert_close(*gradients)

    def test_a_loss_that_is_not_finite_ends_the_training(self):
        from relign_bench.training.graphs import GraphPPO

        learnt = GraphPPO._gradients

        def diverged(self, *values):
            return learnt(self, *values) * float("nan")

        with mock.patch.object(GraphPPO, "_gradients", diverged), self.assertRaisesRegex(
                ValueError, "^the training has diverged: the loss is nan after 40 steps; its checkpoint has the last segment"):
            trained(GraphPPO, PAPER)


@unittest.skipUnless(REAL_GPU or os.environ.get("TRITON_INTERPRET") == "1", "TRITON_INTERPRET=1 is not set")
class Layers(unittest.TestCase):
    SHAPES = ((2, 5, 67, 64, 32, False), (1, 2, 20, 41, 16, False), (2, 16, 25, 30, 16, True), (1, 16, 24, 27, 32, True))

    def setUp(self):
        try:
            from relign_bench.training.pooled import PooledConvolution
        except ImportError as problem:
            self.skipTest(f"{problem}: comes with PyTorch for CUDA")
        self.layer = PooledConvolution.apply
        torch.manual_seed(4)

    def results(self, layer, images, weight, bias, needs):
        given = [value.clone().requires_grad_(needed) for value, needed in zip((images, weight, bias), (needs, True, True))]
        values = layer(*given)
        values.backward(torch.cos(torch.arange(values.numel(), device=DEVICE)).reshape(values.shape))
        return [values.detach(), *(value.grad for value in given if value.requires_grad)]

    def test_values_and_gradients_are_those_of_torch(self):
        def layers(images, weight, bias):
            return functional.max_pool2d(functional.relu(functional.conv2d(images, weight, bias, 2, 1)), 2)

        for batch, channels, rows, columns, out, by_pixels in self.SHAPES:
            images = torch.randn(batch, channels, rows, columns, device=DEVICE)
            if by_pixels:
                images = images.contiguous(memory_format=torch.channels_last)
            weight, bias = torch.randn(out, channels, 3, 3, device=DEVICE) / 9, torch.randn(out, device=DEVICE) / 9
            expected = self.results(layers, images, weight, bias, by_pixels)
            found = self.results(self.layer, images, weight, bias, by_pixels)
            for mine, others in zip(found, expected):
                # On a GPU factors are rounded to TF32, and pixels that are nearly equal change places.
                self.assertEqual(mine.shape, others.shape)
                self.assertLess(float((mine - others).norm() / others.norm()), 5e-2 if REAL_GPU else 1e-6)

    def test_what_is_not_a_number_stays_one(self):
        images = torch.ones(1, 1, 8, 8, device=DEVICE)
        images[0, 0, 3, 3] = float("nan")
        found = self.layer(images, torch.ones(16, 1, 3, 3, device=DEVICE), torch.zeros(16, device=DEVICE))
        self.assertTrue(torch.isnan(found).any())

    def test_images_by_channels_get_no_gradient(self):
        images = torch.ones(1, 1, 8, 8, device=DEVICE, requires_grad=True)
        with self.assertRaisesRegex(NotImplementedError, "stored by channels"):
            self.layer(images, torch.ones(16, 1, 3, 3, device=DEVICE), torch.zeros(16, device=DEVICE)).sum().backward()


if __name__ == "__main__":
    unittest.main()
