"""Episodes of alignment with a critic that is told the truth."""

import gymnasium
import numpy as np

from . import policy
from .lenses import Lenses
from .stable_baselines import EpisodeSums, Vector

EPISODE = 12  # steps
FLOOR = 0.001  # excess RMSE that counts as nearly aligned


class GuidedEnv(Vector):
    """Lenses of all levels. The actor sees the last picture; the critic is told the way to the lens's own optimum, the
    level and the step (an asymmetric actor-critic: Pinto et al. 2017).

    action       (axes,): the way to the optimum along the directions, in units of `spread`; moved by the rule of the
                 agent's plugin (policy.py), so that the policy is trained as it will be used
    reward       -log10(1 + e / FLOOR), e the excess RMSE that the way left costs by the derivative of the picture: equal
                 gains for each factor of the error
    """

    def __init__(self, scene, levels, slots, size, directions, optimum, seed, threads=None):
        self.lenses = Lenses(scene, levels, slots, size, threads=threads)
        self.directions, self.optimum, self.seed_of_run = directions, optimum, seed
        axes = self.lenses.axes
        self.spread = exploration(directions)
        self._level = np.repeat(np.asarray(levels, np.float32), slots)
        self._next_lens = 0
        super().__init__(self.lenses.count, gymnasium.spaces.Dict({
            "image": gymnasium.spaces.Box(0, 255, (1, size, size), np.uint8),
            "told": gymnasium.spaces.Box(-np.inf, np.inf, (2 * axes + 2,), np.float32),
        }), gymnasium.spaces.Box(-1e4, 1e4, (axes,), np.float32))

    def begin_with(self, lens):
        """Numbers of the lenses of the next episodes: what makes a stretch of training the same when it is repeated."""
        self._next_lens = lens

    def reset(self):
        self._reset_seeds()
        self._sums = EpisodeSums(self.num_envs)
        self._start()
        return self._observations()

    def _start(self):
        # Apart from the lenses of imitation, which take the lower half of a seed's numbers.
        self.lenses.reset(2**41 + self.seed_of_run * 2**34 + self._next_lens)
        self._next_lens += self.num_envs
        self._optima = self.optimum.optima(self.lenses.offsets())
        self._steps = 0
        self._look()

    def _look(self):
        self._frames = self.lenses.frames()
        self._along = (self._optima - self.lenses.true_poses()) @ self.directions.vectors

    def _observations(self):
        near = np.sign(self._along) * np.log1p(np.abs(self._along) / self.spread)
        rest = np.stack([self._level, np.full(self.num_envs, self._steps / EPISODE)], axis=1)
        told = np.concatenate([near, self._along, rest], axis=1)
        return {"image": self._frames[:, None].copy(), "told": told.astype(np.float32)}

    def excess(self):
        return np.sqrt((self.directions.values * self._along**2).sum(axis=1))

    def step_wait(self):
        guesses = (self._actions * self.spread) @ self.directions.vectors.T
        self._steps += 1
        self.lenses.move_by(policy.moves(guesses, self._steps))
        self._look()
        rewards = -np.log10(1 + self.excess() / FLOOR)
        self._sums.add(rewards)
        over = np.full(self.num_envs, self._steps == EPISODE)
        infos = [{} for _ in range(self.num_envs)]
        if over.all():
            last, reached = self._observations(), self.excess() < 2 * FLOOR
            for slot, info in enumerate(infos):
                info["terminal_observation"] = {name: values[slot] for name, values in last.items()}
                info["TimeLimit.truncated"] = False  # the steps are a budget, which the critic is told
                info["is_success"] = bool(reached[slot])
                info["episode"] = self._sums.take(slot)
            self._start()
        return self._observations(), rewards.astype(np.float32), over, infos


def exploration(directions):
    """First standard deviation along each direction, (axes,): what costs an excess RMSE of FLOOR, but no more than 0.03
    of the travel."""
    return np.minimum(0.03, FLOOR / np.sqrt(directions.values))
