"""A training of two minutes beats random moves. `./quickstart test --training` runs it."""

import os
import pathlib
import tempfile
import unittest

from support import np

if not os.environ.get("RELIGN_TRAINING"):
    raise unittest.SkipTest("a training of two minutes; ./quickstart test --training runs it")

from relign_bench.conventions import LARGEST_MOVE
from relign_bench.training import policy
from relign_bench.training.evaluation import rmse_after_steps
from relign_bench.training.imitate import Recipe, Training, predictions
from relign_bench.training.instances import InstanceSet

STEPS = 8
AXES = 5  # of relign_od


class BeatsRandom(unittest.TestCase):
    def test_imitation_reaches_a_quarter_of_the_error(self):
        recipe = Recipe(size=50, levels=(0.0, 0.25), lenses=400, pictures=20, passes=12, moves=8, batch=64, optimum_samples=64,
                        seed=5)
        with tempfile.TemporaryDirectory() as folder:
            net = Training(recipe, pathlib.Path(folder)).run()
        random = np.random.default_rng(1)

        def error(moves):
            instances = InstanceSet(recipe.scene, recipe.levels, 30, recipe.size, family="tuning")
            found = rmse_after_steps(lambda frames, step, memory: (moves(frames, step), None), instances, 1, [STEPS])
            return float(np.median(found[STEPS]))

        trained = error(lambda frames, step: policy.moves(predictions(net, frames[:, -1])[0], step))
        by_chance = error(lambda frames, step: random.uniform(-LARGEST_MOVE, LARGEST_MOVE, (len(frames), AXES)))
        print(f"median noise-free RMSE after {STEPS} steps: {trained:.4f}, random moves {by_chance:.4f}")
        self.assertLess(trained, 0.25 * by_chance)


if __name__ == "__main__":
    unittest.main()
