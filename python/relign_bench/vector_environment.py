"""The alignment of many lenses at once: one call renders all of them over all cores."""

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ._task import AlignmentTask
from .environment import AlignmentEnv, chosen_instance
from .pictures import scene_picture


class AlignmentVectorEnv(VectorEnv):
    """num_envs environments as AlignmentEnv, bit for bit: what comes out does not depend on the number of threads.

    num_envs        how many
    threads         None: all cores
    autoreset_mode  gymnasium.vector.AutoresetMode or its name: "NextStep" (gymnasium's default), "SameStep" (the last
                    observation and info of an episode are in infos["final_obs"], infos["final_info"]) or "Disabled"
                    (reset(options={"reset_mask": ...}) starts episodes anew)

    All other arguments as AlignmentEnv. Environment k of reset(seed=s) is an AlignmentEnv after reset(seed=s + k).
    """

    metadata = dict(AlignmentEnv.metadata)

    def __init__(self, num_envs=1, scene="relign_od", noise_level="rho0.25", render_mode=None,
                 autoreset_mode=AutoresetMode.NEXT_STEP, **arguments):
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"there is no render_mode '{render_mode}' for many environments; render modes: rgb_array")
        self.num_envs, self.render_mode = int(num_envs), render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.task = AlignmentTask(self.num_envs, scene=scene, noise_level=noise_level, **arguments)
        self.single_observation_space = self.task.observation_space
        self.single_action_space = self.task.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._generators = [None] * self.num_envs
        self._over = np.zeros(self.num_envs, bool)

    def reset(self, *, seed=None, options=None):
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        slots = list(range(self.num_envs)) if mask is None else [int(k) for k in np.flatnonzero(mask)]
        seeds = seed if isinstance(seed, (list, tuple)) else [None if seed is None else seed + k
                                                              for k in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} environments")
        for slot in slots:
            if seeds[slot] is not None or self._generators[slot] is None:
                self._generators[slot], _ = gymnasium.utils.seeding.np_random(seeds[slot])
        self._start(slots, options)
        return self._observations(), self._gathered(slots, self.task.infos(slots))

    def step(self, actions):
        if any(generator is None for generator in self._generators):
            raise gymnasium.error.ResetNeeded("call reset before the first step")
        actions = np.asarray(actions, np.float32)
        if actions.shape != self.action_space.shape or not np.isfinite(actions).all():
            raise ValueError(f"actions are {self.action_space.shape} finite numbers, these are {actions!r}")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._over.any():
            raise gymnasium.error.ResetNeeded(f"episodes {np.flatnonzero(self._over).tolist()} are over; reset them")
        begin = [int(k) for k in np.flatnonzero(self._over)]  # NextStep: their action is ignored
        moving = [k for k in range(self.num_envs) if not self._over[k]]
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros(self.num_envs, bool), np.zeros(self.num_envs, bool)
        if moving:
            rewards[moving], terminated[moving], truncated[moving] = self.task.step(moving, actions[moving])
        if begin:
            self._start(begin, {})
        self._over = terminated | truncated
        every = list(range(self.num_envs))
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._over.any():
            ended = [int(k) for k in np.flatnonzero(self._over)]
            last = self._gathered(ended, self.task.infos(ended))
            final = np.full(self.num_envs, None, object)
            for slot in ended:
                final[slot] = self.task.observation_of(slot)
            self._start(ended, {})
            infos = self._gathered(every, self.task.infos(every))
            infos["final_obs"], infos["_final_obs"] = final, terminated | truncated
            infos["final_info"], infos["_final_info"] = last, terminated | truncated
        else:
            infos = self._gathered(every, self.task.infos(every))
        return self._observations(), rewards, terminated, truncated, infos

    def render(self):
        if self.render_mode is None:
            raise ValueError('render() needs render_mode="rgb_array" when the environments are made')
        return tuple(scene_picture(self.task, slot) for slot in range(self.num_envs))

    def close_extras(self, **_):
        pass

    def _start(self, slots, options):
        chosen = [chosen_instance(options, self.task, self._generators[slot]) for slot in slots]
        self.task.reset(slots, [number for number, _ in chosen], [family for _, family in chosen])
        self._over[slots] = False

    def _observations(self):
        images = self.task.stacks.copy()
        return {"image": images, "actions": self.task.past.reshape(self.num_envs, -1).copy()} if self.task.include_actions else images

    def _gathered(self, slots, infos):
        """One array a key, with the mask "_key" that gymnasium's vector environments have."""
        mask = np.zeros(self.num_envs, bool)
        mask[slots] = True
        gathered = {}
        for key in infos[0] if infos else ():
            first = np.asarray(infos[0][key])
            values = np.zeros((self.num_envs, *first.shape), first.dtype)
            for slot, info in zip(slots, infos):
                values[slot] = info[key]
            gathered[key], gathered["_" + key] = values, mask
        return gathered
