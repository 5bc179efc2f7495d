"""relign-train with images that stay on the GPU of the learner (support.OnGpu). Needs torch and Stable-Baselines3."""

import dataclasses
import pathlib
import tempfile
import unittest
from unittest import mock

from support import REAL_GPU, OnGpu, np

try:
    import stable_baselines3  # noqa: F401
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch and stable-baselines3, from the Python index") from None

from relign_bench.training.devices import check_device
from relign_bench.training.imitate import Recipe, Training
from relign_bench.training.recipe import PRESETS
from relign_bench.training.reinforce import Reinforcement

DEVICE = "cuda" if REAL_GPU else "cpu"
IMITATE = Recipe(size=40, levels=(0.0, 0.5), lenses=40, passes=2, pictures=3, moves=3, batch=32, optimum_samples=32)
# Episodes of 10 steps are truncated within a rollout, whose last observations the learner reads.
PAPER = dataclasses.replace(PRESETS["paper"], size=100, environments=2, steps=20, batch=20, epochs=1, episode=10, total=80,
                            stretch=40)
TUNED = dataclasses.replace(PRESETS["tuned"], size=40, environments=10, batch=60, epochs=1, total=240, stretch=120,
                            optimum_samples=32)


def quiet(_):
    pass


class ImagesOnTheGpu(OnGpu):
    """Weights are those of a training with images of the CPU; on a GPU sums have no fixed order, and trainings only end."""

    def setUp(self):
        super().setUp()
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)
        few = mock.patch("relign_bench.training.evaluation.TUNING_INSTANCES", 5)  # the emulation of their ground truth is slow
        few.start()
        self.addCleanup(few.stop)

    def expect_same_weights(self, train):
        first, second = (train(render, self.folder / f"of-{render}").state_dict() for render in ("cpu", "cuda"))
        for name, value in first.items():
            self.assertTrue(torch.isfinite(second[name]).all(), name)
            if not REAL_GPU:
                np.testing.assert_array_equal(second[name].numpy(), value.numpy(), name)

    def reinforce(self, recipe, warm_start=None):
        def train(render, folder):
            run = Reinforcement(recipe, folder, warm_start, threads=1, log=quiet, device=DEVICE, render=render)
            return run.run().policy

        self.expect_same_weights(train)

    def test_imitation(self):
        def train(render, folder):
            run = Training(IMITATE, folder, 1, quiet, device=DEVICE, render=render)
            run.run()
            self.assertEqual(run.tuning_rmse(3, 2).shape, (2, 3, 3))
            return run.net

        self.expect_same_weights(train)

    def test_paper_recipe(self):
        for name, changes in (("float32", {}), ("uint8", {"input": "uint8"}), ("shaped", {"reward": "shaped"}),
                              ("a2c", {"algorithm": "a2c"})):
            with self.subTest(name):
                self.folder = self.folder / name
                self.reinforce(dataclasses.replace(PAPER, optimum_samples=32, **changes))

    def test_tuned_recipe(self):
        warm = Training(IMITATE, self.folder / "warm", 1, quiet)
        with warm.folder.alone():
            warm._save(0, torch.optim.Adam(warm.net.parameters()))
        self.reinforce(TUNED, self.folder / "warm")


class Refusals(unittest.TestCase):
    def test_of_devices(self):
        with self.assertRaisesRegex(ValueError, "^unknown renderer 'opengl'; renderers: cpu, cuda$"):
            check_device("cpu", "opengl")
        with self.assertRaisesRegex(ValueError, "the learner is on 'cpu'; use --device cuda, or --render cpu$"):
            check_device("cpu", "cuda")

    @unittest.skipIf(torch.cuda.is_available(), "there is a GPU")
    def test_of_machines_without_a_gpu(self):
        with self.assertRaisesRegex(ValueError, "finds no GPU here; use --device cpu$"):
            check_device("cuda", "cuda")

    def test_of_recurrent_policies(self):
        recurrent = dataclasses.replace(PAPER, algorithm="recurrent-ppo")
        with mock.patch("relign_bench._cuda.DEVICE", "cpu"), self.assertRaisesRegex(ValueError, "use --render cpu$"):
            Reinforcement(recurrent, "unused", render="cuda")


if __name__ == "__main__":
    unittest.main()
