"""Alignment episodes for an actor that observes images and a critic with privileged observations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from . import policy
from .instances import InstanceSet
from .stable_baselines import BatchVecEnv, EpisodeStatistics

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._typing import BoolArray, Float32Array, Float64Array
    from .directions import Directions
    from .instances import OptimumModel

EPISODE = 12  # steps
FLOOR = 0.001  # excess RMSE that counts as nearly aligned


class PrivilegedEnv(BatchVecEnv):
    """Instances of all levels, in episodes of EPISODE steps.

    The actor observes "image", the latest capture, bytes of shape (1, size, size). The critic observes "privileged", shape
    (2 axes + 2,): the residual to the instance's optimum along the directions (logarithmic, then linear), the noise level,
    and the share of the episode that is over (asymmetric actor-critic: Pinto et al. 2017).

    An action, shape (axes,), is the residual to the optimum along the directions, in units of `spread`. The gain schedule of
    the agent's plugin (policy.py) turns it into a move, so that the policy is trained as it is used.

    The reward is -log10(1 + e / FLOOR), with e the excess RMSE of the residual to first order (`excess`): equal factors of the
    error give equal gains.

    Args:
        scene: Id, preset or path of a scene.
        levels: Noise levels N.
        slots: Instances of each level.
        size: Rows and columns of the images.
        directions: The directions.
        optimum: Model of the instances' optima.
        seed: Decides the instances.
        threads: Threads that render; None uses all cores.
        device: Where images are rendered, as for InstanceSet.
    """

    def __init__(self, scene: str, levels: Sequence[float], slots: int, size: int, directions: Directions,
                 optimum: OptimumModel, seed: int, threads: int | None = None, device: str = "cpu") -> None:
        self.instances = InstanceSet(scene, levels, slots, size, threads=threads, device=device)
        self.directions, self.optimum, self.run_seed = directions, optimum, seed
        axes = self.instances.axes
        self.spread = exploration(directions)
        self._level = np.repeat(np.asarray(levels, np.float32), slots)
        self._next_instance = 0
        super().__init__(self.instances.count, gymnasium.spaces.Dict({
            "image": gymnasium.spaces.Box(0, 255, (1, size, size), np.uint8),
            "privileged": gymnasium.spaces.Box(-np.inf, np.inf, (2 * axes + 2,), np.float32),
        }), gymnasium.spaces.Box(-1e4, 1e4, (axes,), np.float32))

    def start_at(self, number: int) -> None:
        """Sets the number of the next instance, so that a repeated training segment is the same."""
        self._next_instance = number

    def reset(self) -> dict[str, Any]:
        """Starts an episode in every slot."""
        self._reset_seeds()
        self._statistics = EpisodeStatistics(self.num_envs)
        self._start()
        return self._observations()

    def _start(self) -> None:
        # Apart from the instances of imitation learning, which take the lower half of a seed's numbers.
        self.instances.reset(2**41 + self.run_seed * 2**34 + self._next_instance)
        self._next_instance += self.num_envs
        self._optima = self.optimum.optima(self.instances.offsets())
        self._steps = 0
        self._observe()

    def _observe(self) -> None:
        self._frames = self.instances.frames()
        self._residuals = (self._optima - self.instances.true_poses()) @ self.directions.vectors

    def _observations(self) -> dict[str, Any]:
        near = np.sign(self._residuals) * np.log1p(np.abs(self._residuals) / self.spread)
        rest = np.stack([self._level, np.full(self.num_envs, self._steps / EPISODE)], axis=1)
        privileged = np.concatenate([near, self._residuals, rest], axis=1)
        return {"image": self._frames[:, None], "privileged": privileged.astype(np.float32)}

    def excess(self) -> Float64Array:
        """Excess RMSE of the current residuals to first order, shape (num_envs,)."""
        return excess(self._residuals, self.directions)

    def step_wait(self) -> tuple[dict[str, Any], Float32Array, BoolArray, list[dict[str, Any]]]:
        """Moves and captures; see Stable-Baselines3's VecEnv."""
        residuals = (self._actions * self.spread) @ self.directions.vectors.T
        self._steps += 1
        self.instances.move_by(policy.moves(residuals, self._steps))
        self._observe()
        rewards = reward(self._residuals, self.directions)
        self._statistics.add(rewards)
        over = np.full(self.num_envs, self._steps == EPISODE)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if over.all():
            last, reached = self._observations(), self.excess() < 2 * FLOOR
            for slot, info in enumerate(infos):
                info["terminal_observation"] = {name: values[slot] for name, values in last.items()}
                info["TimeLimit.truncated"] = False  # the budget ends the task, and the critic observes the step
                info["is_success"] = bool(reached[slot])
                info["episode"] = self._statistics.take(slot)
            self._start()
        return self._observations(), rewards.astype(np.float32), over, infos


def excess(residuals: Float64Array, directions: Directions) -> Float64Array:
    """Excess RMSE to first order, shape (n,), of residuals to the optimum along the directions, shape (n, axes)."""
    found: Float64Array = np.sqrt((directions.values * residuals**2).sum(axis=1))
    return found


def reward(residuals: Float64Array, directions: Directions) -> Float64Array:
    """-log10(1 + e / FLOOR), with e the excess RMSE; arguments and shape as of `excess`."""
    found: Float64Array = -np.log10(1 + excess(residuals, directions) / FLOOR)
    return found


def exploration(directions: Directions) -> Float64Array:
    """Initial standard deviation along each direction, shape (axes,).

    It costs an excess RMSE of FLOOR, and is at most 0.03 of the travel.
    """
    return np.minimum(0.03, FLOOR / np.sqrt(directions.values))
