"""Our environments as Stable-Baselines3's vectors of environments.

Stable-Baselines3 begins the next episode in the step that ends one, and tells the last observation in
info["terminal_observation"]; info["TimeLimit.truncated"] says that time ended it.
"""

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from ..vector_environment import AlignmentVectorEnv


class Vector(VecEnv):
    """What Stable-Baselines3 asks of any vector, and few use of it."""

    def __init__(self, count, observation_space, action_space):
        self.render_mode = None
        super().__init__(count, observation_space, action_space)

    def step_async(self, actions):
        self._actions = actions

    def close(self):
        pass

    def _chosen(self, indices):
        return list(self._get_indices(indices))

    def get_attr(self, attr_name, indices=None):
        return [getattr(self, attr_name) for _ in self._chosen(indices)]

    def set_attr(self, attr_name, value, indices=None):
        raise NotImplementedError(f"the lenses of one batch share their settings; '{attr_name}' cannot be set")

    def env_method(self, method_name, *arguments, indices=None, **named):
        raise NotImplementedError(f"the lenses of one batch are no objects of their own; there is no '{method_name}'")

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False for _ in self._chosen(indices)]


class EpisodeSums:
    """Rewards and lengths of episodes, as Stable-Baselines3's Monitor tells them in info["episode"]."""

    def __init__(self, count):
        self.rewards, self.lengths = np.zeros(count), np.zeros(count, np.int64)

    def add(self, rewards):
        self.rewards += rewards
        self.lengths += 1

    def take(self, slot):
        told = {"r": float(self.rewards[slot]), "l": int(self.lengths[slot]), "t": 0.0}
        self.rewards[slot], self.lengths[slot] = 0, 0
        return told


class StableBaselinesEnv(Vector):
    """`count` lenses as AlignmentVectorEnv(count, **arguments), for Stable-Baselines3's learners."""

    def __init__(self, count, **arguments):
        self.environments = AlignmentVectorEnv(count, autoreset_mode="SameStep", **arguments)
        super().__init__(count, self.environments.single_observation_space, self.environments.single_action_space)
        self._seed = None

    def reset(self):
        seeds = [seed for seed in self._seeds] if any(seed is not None for seed in self._seeds) else None
        observations, _ = self.environments.reset(seed=seeds)
        self._reset_seeds()
        self._sums = EpisodeSums(self.num_envs)
        return observations

    def step_wait(self):
        observations, rewards, terminated, truncated, told = self.environments.step(self._actions)
        self._sums.add(rewards)
        over = terminated | truncated
        infos = [{} for _ in range(self.num_envs)]
        for slot in np.flatnonzero(over):
            infos[slot] = {"terminal_observation": told["final_obs"][slot],
                           "TimeLimit.truncated": bool(truncated[slot] and not terminated[slot]),
                           "is_success": bool(terminated[slot]), "episode": self._sums.take(slot)}
        return observations, rewards.astype(np.float32), over, infos
