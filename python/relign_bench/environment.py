"""The alignment of one lens as a Gymnasium environment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from ._errors import check_name
from ._info import Info, Later
from ._task import AlignmentTask, Settings, choose_instance, takes_settings
from .rendering import Window, draw_frame

if TYPE_CHECKING:
    from ._typing import AnyArray, ByteArray, Observation, Plugin

RENDER_MODES = ("rgb_array", "human")


@takes_settings
class AlignmentEnv(gymnasium.Env["Observation", "AnyArray"]):
    """Align a lens in front of its sensor, from images.

    ## Action space

    `Box` of shape (axes,), float32, by the argument `action`:

    * "unit": moves in [-1, 1]; 1 is the largest move of the paper's agents, 0.2 of the travel.
    * "move": moves in [-0.2, 0.2], in shares of the travel.
    * "absolute": poses in [0, 1] in commanded coordinates, whose origin is the true start.

    Each action is one move of the stage and one capture.

    ## Observation space

    `Box` of shape (frame_stack, height, width): the latest captures, zeros before the start. By the argument `observation`:

    * "uint8": 255 is three times the value of a white pixel, because noise exceeds white.
    * "float32": the scene's units.

    Of a scene of readings: as they are, shape (frame_stack, 1, readings). Of a scene with images and readings, `Dict` of
    "image" and "readings". With `include_actions`, `Dict` with "actions", too: the latest frame_stack actions in one row, the
    newest last, zeros before the start.

    ## Rewards

    By name: see `relign_bench.rewards`. The default is the paper's.

    ## Starting state

    Every episode has another instance: manufacturing errors of the lens, start pose in the gripper, distortion of the stage.
    The seed of `reset` decides the instance and the noise of every capture. `reset(options={"instance": 3, "instances":
    "benchmark"})` chooses the instance.

    ## Episode end

    Terminated once the score is below `goal`; truncated after `max_episode_steps`.

    ## Information

    `true_pose` and `commanded_pose` (shape (axes,), shares of the travel), `measured_error`, `noise_free_error`, `score`,
    `limits` (shape (axes,): which axes met a limit during the latest move) and `instance` (its number).

    `noise_free_error` is computed when it is read, which takes as long as about ten captures, and has the same value whenever
    that is. Reading, printing or pickling the whole info reads it too. No reward of `relign_bench.rewards` uses it; a wrapper
    whose reward does reads it at every step.

    Args:
        scene: Id, preset or path of a scene, or an object as in a suite: {"use": ..., "parameters": {...}}.
        noise_level: A noise level, likewise.
        render_mode: "rgb_array": sensor image, reference and true pose; "human": the same in a window (needs pygame).
        reward: Name of the reward.
        score: Name of the score.
        observation: "uint8" or "float32"; None is "float32" for a scene of readings, "uint8" for one of images.
        size: Columns of the sensor, for scenes whose sensor can be chosen; None keeps the scene's own. The samples of a pixel,
            and so its noise, do not depend on the size.
        frame_stack: How many of the latest captures an observation has.
        include_actions: Whether observations include the latest actions.
        action: "unit", "move" or "absolute".
        clipping: "soft" stops every axis at its own limit, "hard" stops the whole move at the first limit.
        goal: Score below which an episode terminates; None: never.
        max_episode_steps: Steps after which an episode is truncated; None: never.
        noise_free: Whether info has `noise_free_error`.
        instances: Family of the instances: "training", "tuning" or "benchmark". Suites use "benchmark"; train on "training",
            choose checkpoints on "tuning".
        suite_seed: Seed of the families; the default of suites is 1.
        scene_parameters: Parameters of the scene, as in a suite.
        noise_level_parameters: Parameters of the noise level, as in a suite.
        threads: Threads that render; None uses all cores. Results do not depend on it.
        observation_size: Columns of an observation: captures are binned; None keeps them. Scores are those of the captures.

    Raises:
        ValueError: An argument is not valid.

    ## Version history

    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 4}

    def __init__(self, scene: Plugin = "relign_od", noise_level: Plugin = "rho0.25", render_mode: str | None = None,
                 **settings: Any) -> None:
        if render_mode is not None:
            check_name(render_mode, RENDER_MODES, "render mode")
        if settings.get("device", "cpu") != "cpu":
            raise ValueError(f"one environment renders on the CPU, not on device '{settings['device']}'; "
                             "use gymnasium.make_vec, which renders many in one call")
        self.task = AlignmentTask(1, Settings(scene, noise_level, **settings))
        self.render_mode = render_mode
        self.observation_space = self.task.observation_space
        self.action_space = self.task.action_space
        self._window: Window | None = None
        self._ready = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None,
              ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: Decides this episode and, without further seeds, all that follow.
            options: instance (a number) and instances (a family) choose the instance.

        Returns:
            Observation and info.

        Raises:
            ValueError: An option is unknown, or its value is not valid.
        """
        super().reset(seed=seed)
        number, family = choose_instance(options, self.task, self.np_random)
        self.task.reset([0], [number], [family])
        self._ready = True
        if self.render_mode == "human":
            self.render()
        return self.task.observation_of(0), self._info()

    def _info(self) -> dict[str, Any]:
        info = Info({key: rows[0] if rows.ndim > 1 else rows[0].item() for key, rows in self.task.infos([0]).items()})
        if self.task.noise_free:
            later = self.task.noise_free_error([0])
            info["noise_free_error"] = Later(lambda: float(later()[0]))
        return info

    def step(self, action: AnyArray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Moves the stage and captures once.

        Args:
            action: Shape (axes,); values beyond the action space are clipped.

        Returns:
            Observation, reward, terminated, truncated and info.

        Raises:
            ValueError: The action has another shape, or is not finite.
            gymnasium.error.ResetNeeded: `reset` was not called before.
        """
        if not self._ready:
            raise gymnasium.error.ResetNeeded("call reset before the first step")
        action = np.asarray(action, np.float32)
        if action.shape != self.action_space.shape or not np.isfinite(action).all():
            raise ValueError(f"an action must be {self.task.axes} finite numbers, not {action!r}")
        rewards, terminated, truncated = self.task.step([0], action)
        if self.render_mode == "human":
            self.render()
        return (self.task.observation_of(0), float(rewards[0]), bool(terminated[0]), bool(truncated[0]), self._info())

    def render(self) -> ByteArray | None:  # type: ignore[override]
        """Shows the current state.

        Returns:
            An RGB image, shape (height, width, 3), in mode "rgb_array"; None in mode "human".

        Raises:
            ValueError: The environment has no render_mode.
            gymnasium.error.ResetNeeded: `reset` was not called before.
        """
        if self.render_mode is None:
            raise ValueError('render needs an environment with render_mode="rgb_array" or "human"')
        if not self._ready:
            raise gymnasium.error.ResetNeeded("call reset before render")
        picture = draw_frame(self.task, 0)
        if self.render_mode == "rgb_array":
            return picture
        if self._window is None:
            self._window = Window("relign-bench", self.metadata["render_fps"])
        self._window.show(picture)
        return None

    def close(self) -> None:
        """Closes the window, if there is one; a second call has no effect."""
        if self._window is not None:
            self._window.close()
            self._window = None


def make_single(**arguments: Any) -> AlignmentEnv:
    """Entry point of gymnasium.make, which applies max_episode_steps in a wrapper.

    A limit in the environment too would make the smaller of the two count.
    """
    return AlignmentEnv(max_episode_steps=None, **arguments)
