"""The alignment of one lens at a time as a gymnasium environment."""

import gymnasium
import numpy as np

from ._task import AlignmentTask
from .pictures import scene_picture


class AlignmentEnv(gymnasium.Env):
    """Move a lens before its sensor until the picture is right.

    Every episode draws another lens: manufacturing errors, place in the gripper, distortion of the stage. The seed of
    `reset` decides all of them, and the noise of every frame.

    scene, noise_level   id, preset or path, as in suites
    reward, score        see relign_bench.rewards
    observation          "uint8": 255 stands for three times a white pixel; "float32": the scene's units
    size                 columns of the sensor, for scenes whose sensor can be chosen; None: the scene's own. A pixel of any
                         size has the scene's samples, and so its noise
    observation_size     columns of an observation: captures, binned; None: as captured. Scores are those of the captures
    frame_stack          last frames in one observation, zeros before the start; shape (frame_stack, height, width)
    include_actions      observations become {"image", "actions"}: the last frame_stack actions in one row, the last one
                         at its end, zeros before the start
    action               "unit": [-1, 1], 1 is the largest move, 0.2 of the travel (the paper's); "move": shares of the
                         travel in [-0.2, 0.2]; "absolute": poses in [0, 1] that count from the true start
    clipping             "soft": every axis stops at its own limit; "hard": the whole move stops at the first one
    goal                 an episode ends (terminated) once the score is below it; None: never
    max_episode_steps    then it is truncated, 200 unless given; None: never
    noise_free           tell info["noise_free_rmse"]; costs some ten captures a step
    instances            "training", "tuning" or "benchmark": which family of lenses. Suites use "benchmark"; train on
                         "training", choose checkpoints on "tuning"
    suite_seed           of those families; suites say 1 unless they say otherwise
    scene_parameters, noise_level_parameters
                         as in a suite
    render_mode          "rgb_array": sensor image, reference and pose; "human": in a window (needs pygame)

    reset(options={"instance": 3, "instances": "benchmark"}) chooses the lens.
    info: true_pose, commanded_pose (both shape (axes,), shares of the travel), measured_rmse, noise_free_rmse, score,
    limits (which axes met one on the last move), instance (its number).
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 4}

    def __init__(self, scene="relign_od", noise_level="rho0.25", render_mode=None, **arguments):
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ValueError(f"there is no render_mode '{render_mode}'; render modes: rgb_array, human")
        self.task = AlignmentTask(1, scene=scene, noise_level=noise_level, **arguments)
        self.render_mode = render_mode
        self.observation_space = self.task.observation_space
        self.action_space = self.task.action_space
        self._window = None
        self._ready = False

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        number, family = chosen_instance(options, self.task, self.np_random)
        self.task.reset([0], [number], [family])
        self._ready = True
        if self.render_mode == "human":
            self.render()
        return self.task.observation_of(0), self.task.infos([0])[0]

    def step(self, action):
        if not self._ready:
            raise gymnasium.error.ResetNeeded("call reset before the first step")
        action = np.asarray(action, np.float32)
        if action.shape != self.action_space.shape or not np.isfinite(action).all():
            raise ValueError(f"an action is {self.action_space.shape[0]} finite numbers, this is {action!r}")
        rewards, terminated, truncated = self.task.step([0], action)
        if self.render_mode == "human":
            self.render()
        return (self.task.observation_of(0), float(rewards[0]), bool(terminated[0]), bool(truncated[0]),
                self.task.infos([0])[0])

    def render(self):
        if self.render_mode is None:
            raise ValueError('render() needs render_mode="rgb_array" or "human" when the environment is made')
        if not self._ready:
            raise gymnasium.error.ResetNeeded("call reset before render")
        picture = scene_picture(self.task, 0)
        if self.render_mode == "rgb_array":
            return picture
        from .pictures import Window

        if self._window is None:
            self._window = Window("relign-bench", self.metadata["render_fps"])
        self._window.show(picture)
        return None

    def close(self):
        if self._window is not None:
            self._window.close()
            self._window = None


def made_by_gymnasium(**arguments):
    """An AlignmentEnv for gymnasium.make, which keeps max_episode_steps for a wrapper of its own: two limits would be the
    smaller one."""
    return AlignmentEnv(max_episode_steps=None, **arguments)


def chosen_instance(options, task, random):
    """Number and family of an episode's instance. Options name it; else the generator draws one."""
    options = dict(options or {})
    family = options.pop("instances", task.instances)
    number = options.pop("instance", None)
    if options:
        raise ValueError(f"reset knows no option {', '.join(map(repr, options))}; options: instance, instances")
    if number is None:
        number = task.draw_number(random)
    if int(number) < 0:
        raise ValueError(f"instance={number}: allowed: 0 or more")
    return int(number), family
