"""The alignment of many lenses as one Gymnasium vector environment, rendered by one call on all cores."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ._cuda import on_host
from ._errors import check_name, require_integer
from ._info import Info, Later
from ._task import AlignmentTask, Settings, choose_instance, takes_settings
from .environment import AlignmentEnv
from .rendering import draw_frame

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._typing import AnyArray, BoolArray, ByteArray, Float64Array, Observation, Plugin, Slots


@takes_settings
class AlignmentVectorEnv(VectorEnv["Observation", "AnyArray", "AnyArray"]):
    """`num_envs` environments equal to `AlignmentEnv`, bit for bit, whatever the number of threads.

    Environment k after reset(seed=s) equals an AlignmentEnv after reset(seed=s + k).

    Args:
        num_envs: Number of environments.
        scene: As for AlignmentEnv.
        noise_level: As for AlignmentEnv.
        render_mode: "rgb_array" or None.
        autoreset_mode: gymnasium.vector.AutoresetMode or its name. "NextStep" (the default) starts the next episode in the step
            after the last one, whose action is ignored. "SameStep" starts it in the last step: the last observation and info
            are in infos["final_obs"] and infos["final_info"]. "Disabled" waits for reset(options={"reset_mask": ...}) with a
            boolean array of shape (num_envs,).
        device: "cuda" renders on the first NVIDIA GPU, with the bits of "cpu" (transport "ghost":
            the distribution). Observations are then PyTorch tensors there,
            infos["final_obs"] too, and no image is copied to the host, except for the score "rmse_binary" and by `render`.
            Rewards, terminated, truncated and infos are
            arrays, because the stages and their scores are computed on the CPU; actions may be arrays or tensors.
        **settings: All other arguments of AlignmentEnv.

    Raises:
        ValueError: An argument is not valid.
    """

    metadata: dict[str, Any] = dict(AlignmentEnv.metadata)

    def __init__(self, num_envs: int = 1, scene: Plugin = "relign_od", noise_level: Plugin = "rho0.25",
                 render_mode: str | None = None, autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
                 device: str = "cpu", **settings: Any) -> None:
        if render_mode is not None:
            check_name(render_mode, ("rgb_array",), "render mode")
        self.num_envs, self.render_mode = require_integer(num_envs, "num_envs", 1), render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.task = AlignmentTask(self.num_envs, Settings(scene, noise_level, device=device, **settings))
        self.single_observation_space = self.task.observation_space
        self.single_action_space = self.task.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._generators: list[np.random.Generator | None] = [None] * self.num_envs
        self._over: BoolArray = np.zeros(self.num_envs, bool)  # episodes that ended in the latest step

    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None,
              ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode in every environment, or in those of options["reset_mask"].

        Args:
            seed: One seed, to which each environment adds its index, or one per environment; None continues the generators.
            options: reset_mask, and the options of AlignmentEnv.reset.

        Returns:
            Observations and infos of all environments.

        Raises:
            ValueError: The number of seeds is not num_envs, or an option is not valid.
        """
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        slots = list(range(self.num_envs)) if mask is None else [int(k) for k in np.flatnonzero(mask)]
        if seed is None or isinstance(seed, (int, np.integer)):
            seeds = [None if seed is None else seed + k for k in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"expected one seed per environment, found {len(seeds)} seeds for {self.num_envs} environments")
        for slot in slots:
            if seeds[slot] is not None or self._generators[slot] is None:
                self._generators[slot], _ = gymnasium.utils.seeding.np_random(seeds[slot])
        self._start(slots, options)
        return self.task.observations(), self._gather(slots)

    def step(self, actions: AnyArray) -> tuple[Observation, Float64Array, BoolArray, BoolArray, dict[str, Any]]:
        """Moves and captures once in every environment.

        Args:
            actions: Shape (num_envs, axes).

        Returns:
            Observations, rewards, terminated, truncated and infos, by environment.

        Raises:
            ValueError: The actions have another shape, or are not finite.
            gymnasium.error.ResetNeeded: `reset` was not called, or an episode is over and autoreset is disabled.
        """
        if any(generator is None for generator in self._generators):
            raise gymnasium.error.ResetNeeded("call reset before the first step")
        actions = np.asarray(on_host(actions), np.float32)
        if actions.shape != self.action_space.shape or not np.isfinite(actions).all():
            raise ValueError(f"actions must be finite numbers of shape {self.action_space.shape}, not {actions!r}")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._over.any():
            raise gymnasium.error.ResetNeeded(f"episodes {np.flatnonzero(self._over).tolist()} are over: reset them")
        starting = [int(k) for k in np.flatnonzero(self._over)]  # mode NextStep: their action is ignored
        moving = [k for k in range(self.num_envs) if not self._over[k]]
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros(self.num_envs, bool), np.zeros(self.num_envs, bool)
        if moving:
            rewards[moving], terminated[moving], truncated[moving] = self.task.step(moving, actions[moving])
        if starting:
            self._start(starting, {})
        self._over = terminated | truncated
        every = list(range(self.num_envs))
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._over.any():
            ended = [int(k) for k in np.flatnonzero(self._over)]
            final_infos = self._gather(ended)
            final_observations = np.full(self.num_envs, None, object)
            for slot in ended:
                final_observations[slot] = self.task.observation_of(slot)
            self._start(ended, {})
            infos = self._gather(every)
            infos["final_obs"], infos["_final_obs"] = final_observations, terminated | truncated
            infos["final_info"], infos["_final_info"] = final_infos, terminated | truncated
        else:
            infos = self._gather(every)
        return self.task.observations(), rewards, terminated, truncated, infos

    def render(self) -> tuple[ByteArray, ...]:  # type: ignore[override]
        """RGB images of all environments, each of shape (height, width, 3).

        Raises:
            ValueError: The environments have no render_mode.
        """
        if self.render_mode is None:
            raise ValueError('render needs environments with render_mode="rgb_array"')
        return tuple(draw_frame(self.task, slot) for slot in range(self.num_envs))

    def close_extras(self, **_: Any) -> None:
        """Nothing to close."""

    def _start(self, slots: Slots, options: dict[str, Any]) -> None:
        chosen = []
        for slot in slots:
            generator = self._generators[slot]
            assert generator is not None
            chosen.append(choose_instance(options, self.task, generator))
        self.task.reset(slots, [number for number, _ in chosen], [family for _, family in chosen])
        self._over[slots] = False

    def _gather(self, slots: Slots) -> dict[str, Any]:
        """One array per key, with the mask "_key" that Gymnasium's vector environments add."""
        mask = np.zeros(self.num_envs, bool)
        mask[slots] = True
        gathered = Info()
        if not slots:
            return gathered
        every = bool(mask.all())
        for key, rows in self.task.infos(slots).items():
            gathered[key], gathered["_" + key] = rows, mask
            if not every:
                gathered[key] = np.zeros((self.num_envs, *rows.shape[1:]), rows.dtype)
                gathered[key][slots] = rows
        if self.task.noise_free:
            later = self.task.noise_free_error(slots)

            def spread() -> Float64Array:
                values = np.zeros(self.num_envs)
                values[slots] = later()
                return values

            gathered["noise_free_error"], gathered["_noise_free_error"] = Later(spread), mask
        return gathered
