"""A training of two minutes must beat random moves. `./quickstart test --training` asks for it."""

import os
import pathlib
import tempfile
import unittest

from support import np

if not os.environ.get("RELIGN_TRAINING"):
    raise unittest.SkipTest("a training of two minutes; ./quickstart test --training runs it")

from relign_bench.conventions import LARGEST_MOVE
from relign_bench.training import policy
from relign_bench.training.imitate import Recipe, Training, guesses
from relign_bench.training.lenses import Lenses

STEPS = 8


class BeatsRandom(unittest.TestCase):
    def test_imitation(self):
        recipe = Recipe(size=50, levels=(0.0, 0.25), lenses=400, pictures=20, passes=4, rounds=1, round_lenses=120,
                        round_moves=8, round_passes=3, optimum_samples=64, seed=5)
        with tempfile.TemporaryDirectory() as folder:
            net = Training(recipe, pathlib.Path(folder)).run()
        random = np.random.default_rng(1)

        def error(moves):
            lenses = Lenses(recipe.scene, recipe.levels, 30, recipe.size, instances="tuning")
            lenses.reset(0)
            for step in range(1, STEPS + 1):
                lenses.move_by(moves(lenses, step))
            return float(np.median(np.sqrt(np.maximum(0, lenses.noise_free_mse()))))

        learnt = error(lambda lenses, step: policy.moves(guesses(net, lenses.frames()), step))
        by_chance = error(lambda lenses, step: random.uniform(-LARGEST_MOVE, LARGEST_MOVE, (lenses.count, lenses.axes)))
        print(f"median noise-free RMSE after {STEPS} steps: {learnt:.4f}, random moves {by_chance:.4f}")
        self.assertLess(learnt, 0.25 * by_chance)


if __name__ == "__main__":
    unittest.main()
