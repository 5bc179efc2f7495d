"""The package's environments as Stable-Baselines3's VecEnv.

Stable-Baselines3 starts the next episode in the step that ends one. The last observation is then in
info["terminal_observation"], and info["TimeLimit.truncated"] marks an episode that was truncated.
"""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from stable_baselines3.common.vec_env import VecEnv

from .._cuda import on_host
from ..vector_environment import AlignmentVectorEnv
from .frames import tensors

if TYPE_CHECKING:
    from collections.abc import Callable

    from gymnasium import spaces

    from .._typing import AnyArray, BoolArray, Float32Array, Float64Array, Observation


def falling_rate(recipe: Any, steps: Callable[[], int]) -> Callable[[float], float]:
    """The learning rate of a learner: linear from `rate` to `last_rate` of the recipe over its `total` steps.

    Args:
        recipe: The recipe.
        steps: Returns the number of steps that are done.
    """
    return lambda _: recipe.last_rate + (recipe.rate - recipe.last_rate) * max(0.0, 1 - steps() / recipe.total)


def seed_segment(recipe: Any, segment: int) -> int:
    """Seeds all generators for a training segment, from 0, so that a resumed run continues as if it had not stopped.

    Returns:
        The seed.
    """
    seed: int = recipe.seed * 1_000_003 + segment + 1
    torch.manual_seed(seed)
    np.random.seed(seed % 2**32)
    random.seed(seed)
    return seed


class BatchVecEnv(VecEnv):
    """Base of VecEnvs that are one batch: the methods for single environments, which a batch does not have.

    Args:
        count: Number of environments.
        observation_space: Of one environment.
        action_space: Of one environment.
    """

    def __init__(self, count: int, observation_space: spaces.Space[Any], action_space: spaces.Space[Any]) -> None:
        self.render_mode = None
        super().__init__(count, observation_space, action_space)

    def step_async(self, actions: AnyArray) -> None:
        """Keeps the actions for `step_wait`."""
        self._actions = actions

    def close(self) -> None:
        """Nothing to close."""

    def _chosen(self, indices: Any) -> list[int]:
        return list(self._get_indices(indices))

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The batch's attribute, once per environment."""
        return [getattr(self, attr_name) for _ in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not supported."""
        raise NotImplementedError(f"cannot set '{attr_name}': the environments of a batch share their settings")

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **named: Any) -> list[Any]:
        """Not supported."""
        raise NotImplementedError(f"cannot call '{method_name}': the environments of a batch are not separate objects")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """False for every environment."""
        return [False for _ in self._chosen(indices)]


class EpisodeStatistics:
    """Rewards and lengths of episodes, as Stable-Baselines3's Monitor reports them in info["episode"]."""

    def __init__(self, count: int) -> None:
        self.rewards, self.lengths = np.zeros(count), np.zeros(count, np.int64)

    def add(self, rewards: Float64Array) -> None:
        """Adds one step of every environment; rewards have shape (count,)."""
        self.rewards += rewards
        self.lengths += 1

    def take(self, slot: int) -> dict[str, Any]:
        """The statistics of an episode that ended, "r" and "l"; resets them."""
        episode = {"r": float(self.rewards[slot]), "l": int(self.lengths[slot]), "t": 0.0}
        self.rewards[slot], self.lengths[slot] = 0, 0
        return episode


class StableBaselinesEnv(BatchVecEnv):
    """AlignmentVectorEnv(count, **arguments) for Stable-Baselines3.

    With device="cuda", observations are of the form of `frames.tensors`.
    """

    def __init__(self, count: int, **arguments: Any) -> None:
        self.environments = AlignmentVectorEnv(count, autoreset_mode="SameStep", **arguments)
        super().__init__(count, self.environments.single_observation_space, self.environments.single_action_space)
        self._seed = None

    def reset(self) -> Observation:
        """Starts an episode in every environment, with the seeds that `seed` set."""
        seeds = list(self._seeds) if any(seed is not None for seed in self._seeds) else None
        observations, _ = self.environments.reset(seed=seeds)
        self._reset_seeds()
        self._statistics = EpisodeStatistics(self.num_envs)
        return self._handed_on(observations)

    def _handed_on(self, observations: Observation) -> Observation:
        return observations if isinstance(observations, (np.ndarray, dict)) else tensors(observations)

    def step_wait(self) -> tuple[Observation, Float32Array, BoolArray, list[dict[str, Any]]]:
        """Moves and captures; see Stable-Baselines3's VecEnv."""
        observations, gained, terminated, truncated, gathered = self.environments.step(self._actions)
        over = terminated | truncated
        rewards = self.rewards(gained, gathered, over)
        self._statistics.add(rewards)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for slot in map(int, np.flatnonzero(over)):
            last, cut = gathered["final_obs"][slot], bool(truncated[slot] and not terminated[slot])
            if cut and not isinstance(last, dict):  # else it is not read, and may stay on the GPU
                last = on_host(last)
            infos[slot] = {"terminal_observation": last, "TimeLimit.truncated": cut, "is_success": bool(terminated[slot]),
                           "episode": self._statistics.take(slot)}
        return self._handed_on(observations), rewards.astype(np.float32), over, infos

    def rewards(self, rewards: Float64Array, infos: dict[str, Any], over: BoolArray) -> Float64Array:
        """The rewards of a step, each of shape (num_envs,); for subclasses with another reward.

        Args:
            rewards: The environments' own.
            infos: Their infos, with final_info where episodes ended.
            over: Which episodes ended.
        """
        return rewards
