"""What the single and the vector environment share: a batch with spaces, scores, rewards and frame stacks."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import numbers
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from gymnasium import spaces

from . import _cuda
from . import rewards as _rewards
from ._errors import check_name, require_flag, require_integer
from ._info import Later
from ._score import score_of
from ._stacks import DeviceStacks, Stacks
from .batch import Batch
from .conventions import LARGEST_MOVE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ._typing import AnyArray, BoolArray, Float32Array, Float64Array, Observation, Parameters, Plugin, Slots

FLOAT_WHITES = 30.0  # upper bound of float32 observations, in white pixels

OBSERVATIONS = ("uint8", "float32")
ACTIONS = ("unit", "move", "absolute")
FAMILIES = ("training", "tuning", "benchmark")
MAX_EPISODE_STEPS = 200  # the package's
LARGEST_BINNING = 10  # that the message for a wrong observation_size lists


@dataclasses.dataclass
class Settings:
    """The keywords of the environments, which `AlignmentEnv` documents; checked when they are made."""

    scene: Plugin = "relign_od"
    noise_level: Plugin = "rho0.25"
    reward: str = "paper"
    score: str = "combined"
    observation: str | None = None
    size: int | None = None
    frame_stack: int = 1
    include_actions: bool = False
    action: str = "unit"
    clipping: str = "soft"
    goal: float | None = None
    max_episode_steps: int | None = MAX_EPISODE_STEPS
    noise_free: bool = True
    instances: str = "training"
    suite_seed: int = 1
    scene_parameters: Parameters | None = None
    noise_level_parameters: Parameters | None = None
    threads: int | None = None
    observation_size: int | None = None
    device: str = "cpu"

    def __post_init__(self) -> None:
        check_name(self.reward, _rewards.REWARDS, "reward")
        check_name(self.score, _rewards.SCORES, "score")
        if self.observation is not None:
            check_name(self.observation, OBSERVATIONS, "observation")
        check_name(self.action, ACTIONS, "action")
        if self.reward == "minus_one_plus" and self.goal is None:
            raise ValueError("reward 'minus_one_plus' needs a goal, such as goal=0.05")
        if self.goal is not None and not (isinstance(self.goal, numbers.Real) and math.isfinite(self.goal)):
            raise ValueError(f"goal must be a finite number or None, not {self.goal!r}")
        check_family(self.instances)
        self.frame_stack = require_integer(self.frame_stack, "frame_stack", 1)
        require_flag(self.include_actions, "include_actions")
        require_flag(self.noise_free, "noise_free")
        if self.max_episode_steps is not None:
            self.max_episode_steps = require_integer(self.max_episode_steps, "max_episode_steps", 1)

    def batch(self, slots: int, threads: int | None, device: str = "cpu") -> Batch:
        """A batch of instances of the scene and noise level."""
        return Batch(slots, self.scene, self.noise_level, self.clipping, self.suite_seed, self.size, self.scene_parameters,
                     self.noise_level_parameters, threads, device)


Environment = TypeVar("Environment", bound=type[Any])


def takes_settings(environment: Environment) -> Environment:
    """Decorates an environment whose constructor passes its **settings on to Settings: help and editors show them."""
    own = [one for one in inspect.signature(environment.__init__).parameters.values() if one.kind is not one.VAR_KEYWORD]
    names = {one.name for one in own}
    further = [one.replace(kind=one.KEYWORD_ONLY) for one in inspect.signature(Settings).parameters.values()
               if one.name not in names]
    environment.__signature__ = inspect.Signature([*own[1:], *further])
    return environment


class AlignmentTask:
    """`slots` episodes of one scene and noise level."""

    def __init__(self, slots: int, settings: Settings) -> None:
        scene, observation, device = settings.scene, settings.observation, settings.device
        self.reward, self.score, self.action = settings.reward, settings.score, settings.action
        self.frame_stack, self.include_actions = settings.frame_stack, settings.include_actions
        self.goal, self.instances = settings.goal, settings.instances
        self.max_episode_steps = np.inf if settings.max_episode_steps is None else settings.max_episode_steps
        self.batch = settings.batch(slots, settings.threads, device)
        self.noise_free = settings.noise_free and self.batch.has_ground_truth
        self.axes, self.white = self.batch.axes, self.batch.white
        self.nominal_pose, self.reference = self.batch.nominal_pose, self.batch.reference
        self.frames = self.batch.frames  # a view: always the latest captures
        height, width = self._observed_shape(settings.observation_size)
        shape = (self.frame_stack, height, width)
        description = self.batch.description
        readings = "image" not in description
        least, most = (-np.inf, np.inf) if readings else (0.0, float(np.float32(FLOAT_WHITES * self.white)))
        if observation is None:
            observation = "float32" if readings else "uint8"
        elif readings and observation != "float32":
            raise ValueError(f"scene '{scene}' has readings, not images; observation must be 'float32' or None")
        self.observation = observation
        image: spaces.Space[Any] = (spaces.Box(0, 255, shape, np.uint8) if observation == "uint8" else
                                    spaces.Box(least, most, shape, np.float32))
        low, high = {"unit": (-1.0, 1.0), "move": (-LARGEST_MOVE, LARGEST_MOVE), "absolute": (0.0, 1.0)}[self.action]
        self.action_space = spaces.Box(low, high, (self.axes,), np.float32)
        parts: dict[str, spaces.Space[Any]] = {"image": image}
        count = len(description["readings"]) if "readings" in description and not readings else 0
        if count:
            parts["readings"] = spaces.Box(-np.inf, np.inf, (self.frame_stack, 1, count), np.float32)
        if self.include_actions:
            parts["actions"] = spaces.Box(low, high, (self.frame_stack * self.axes,), np.float32)
        self.observation_space: spaces.Space[Any] = image if len(parts) == 1 else spaces.Dict(parts)
        kind = DeviceStacks if device == "cuda" else Stacks
        self._stacks = kind(slots, shape, self._binning, self.white if observation == "uint8" else None,
                            most)
        self._readings = kind(slots, (self.frame_stack, 1, count), 1, None, np.inf) if count else None
        self.past_actions: Float32Array = np.zeros((slots, self.frame_stack, self.axes), np.float32)
        self.scores: Float64Array = np.zeros(slots)
        self.steps = np.zeros(slots, np.int64)
        self.numbers = np.zeros(slots, np.int64)  # of the instances
        self.families = [self.instances] * slots
        self._make_spare = functools.partial(settings.batch, 1, threads=1)
        self._spare: Batch | None = None

    def _observed_shape(self, columns: int | None) -> tuple[int, int]:
        height, width = self.reference.shape
        if {"image", "readings"} <= self.batch.description.keys():
            height -= 1  # the row of readings
        self._rows = height
        columns = width if columns is None else require_integer(columns, "observation_size", 1)
        if width % columns or height % (width // columns):
            sizes = [str(width // k) for k in range(1, LARGEST_BINNING + 1) if width % k == height % k == 0]
            raise ValueError(f"observation_size={columns} does not divide captures of {width} x {height} pixels; "
                             f"possible sizes: {', '.join(sizes)}")
        self._binning = width // columns
        return height // self._binning, columns

    # ---- episodes ------------------------------------------------------------------------------

    def draw_number(self, random: np.random.Generator) -> int:
        """The number of a new instance, drawn from an episode's own generator."""
        return int(random.integers(2**53))

    def reset(self, slots: Slots, numbers: Sequence[int], families: Sequence[str]) -> None:
        """Starts an episode in each of these slots, on the instance of this number and family."""
        for family in sorted(set(families)):
            chosen = [k for k, other in enumerate(families) if other == family]
            self.batch.reset([slots[k] for k in chosen], [numbers[k] for k in chosen], family)
        for stacks in filter(None, (self._stacks, self._readings)):
            stacks.clear(slots)
        self.past_actions[slots] = 0
        self.steps[slots] = 0
        self.numbers[slots] = numbers
        for slot, family in zip(slots, families):
            self.families[slot] = family
        self._push(slots)
        self.scores[slots] = self._scores(self.score, slots)

    def step(self, slots: Slots, actions: AnyArray) -> tuple[Float64Array, BoolArray, BoolArray]:
        """Moves and captures once.

        Args:
            slots: The slots, n of them.
            actions: Actions, n x axes values.

        Returns:
            Rewards, terminated and truncated, each of shape (n,).
        """
        actions = np.asarray(actions, np.float32).reshape(len(slots), self.axes)
        self.batch.move_by(slots, self.moves(slots, actions))
        self.steps[slots] += 1
        self.past_actions[slots] = np.roll(self.past_actions[slots], -1, axis=1)
        self.past_actions[slots, -1] = actions
        self._push(slots)
        before, after = self.scores[slots], self._scores(self.score, slots)
        combined = after if self.score == "combined" else self._scores("combined", slots)
        self.scores[slots] = after
        gained = _rewards.rewards(self.reward, before, after, combined, self.batch.true_poses(slots), self.goal)
        reached = np.zeros(len(slots), bool) if self.goal is None else after < self.goal
        return gained, reached, self.steps[slots] >= self.max_episode_steps

    def moves(self, slots: Slots, actions: Float32Array) -> Float64Array:
        """Commanded moves in shares of the travel, shape (n, axes), for actions of the same shape."""
        if self.action == "absolute":  # in the stage's coordinates, whose origin is the true start
            return actions.astype(np.float64) - self.batch.commanded_poses(slots)
        scale = LARGEST_MOVE if self.action == "unit" else 1.0
        return np.clip(actions.astype(np.float64) * scale, -LARGEST_MOVE, LARGEST_MOVE)

    # ---- observations --------------------------------------------------------------------------

    def _scores(self, name: str, slots: Slots) -> Float64Array:
        frames = _cuda.on_host(self.frames[slots]) if name == "rmse_binary" else None
        return _rewards.scores(name, self.batch.measured_error(slots), self.batch.true_poses(slots), self.nominal_pose,
                               frames, self.reference)

    def _push(self, slots: Slots) -> None:
        self._stacks.push(slots, self.frames[:, :self._rows])
        if self._readings:
            count = self._readings.one(0).shape[-1]
            self._readings.push(slots, self.frames[:, self._rows:, :count])

    def observation_of(self, slot: int) -> Observation:
        """A slot's observation; a copy, which later steps do not change."""
        return self._observation(lambda stacks: stacks.one(slot), self.past_actions[slot].ravel())

    def observations(self) -> Observation:
        """The observations of all slots, stacked; a copy, which later steps do not change."""
        return self._observation(lambda stacks: stacks.all(), self.past_actions.reshape(len(self.scores), -1))

    def _observation(self, copy: Callable[[Stacks], AnyArray], actions: Float32Array) -> Observation:
        parts = {"image": copy(self._stacks)}
        if self._readings:
            parts["readings"] = copy(self._readings)
        if self.include_actions:
            parts["actions"] = _cuda.on_device(actions) if self.batch.device == "cuda" else actions.copy()
        return parts["image"] if len(parts) == 1 else parts

    def infos(self, slots: Slots) -> dict[str, AnyArray]:
        """The infos of these slots, without the noise-free error; see `AlignmentEnv`. Arrays with one row per slot."""
        return {
            "true_pose": self.batch.true_poses(slots),
            "commanded_pose": self.batch.commanded_poses(slots),
            "measured_error": self.batch.measured_error(slots),
            "score": self.scores[slots],
            "limits": self.batch.limits(slots),
            "instance": self.numbers[slots],
        }

    def noise_free_error(self, slots: Slots) -> Later:
        """The noise-free score of each slot now, shape (n,), for whenever it is read.

        Instances are mounted again where an episode has ended by then, so that the value does not depend on the time.
        """
        slots = list(slots)
        true_poses, steps = self.batch.true_poses(slots), [int(self.steps[slot]) for slot in slots]
        drawn = [(self.families[slot], int(self.numbers[slot])) for slot in slots]

        def compute() -> Float64Array:
            mse = np.zeros(len(slots))
            here = [k for k, slot in enumerate(slots) if drawn[k] == (self.families[slot], self.numbers[slot])]
            if here:
                mse[here] = self.batch.noise_free_mse_at([slots[k] for k in here], true_poses[here],
                                                         [steps[k] for k in here])[0]
            for k in sorted(set(range(len(slots))) - set(here)):
                if self._spare is None:
                    self._spare = self._make_spare()
                self._spare.reset([0], [drawn[k][1]], drawn[k][0])
                mse[k] = self._spare.noise_free_mse_at([0], true_poses[k:k + 1], steps[k:k + 1])[0][0]
            return score_of(self.batch.description).shown(mse)

        return Later(compute)


def check_family(name: str) -> None:
    """Raises ValueError when `name` is not a family of instances."""
    if name not in FAMILIES:
        raise ValueError(f"unknown instances '{name}'; instances: {', '.join(FAMILIES)}")


def choose_instance(options: dict[str, Any] | None, task: AlignmentTask, random: np.random.Generator) -> tuple[int, str]:
    """The instance of an episode: the one that the options name, else one drawn from the generator.

    Args:
        options: Options of `reset`: instance (a number), instances (a family); both may be missing.
        task: The task, which has the default family.
        random: The episode's generator, used where the options name no instance.

    Returns:
        Number and family.

    Raises:
        ValueError: An option is unknown.
    """
    options = dict(options or {})
    family = options.pop("instances", task.instances)
    number = options.pop("instance", None)  # Batch.reset checks it
    if options:
        raise ValueError(f"unknown reset option {', '.join(map(repr, options))}; options: instance, instances")
    return task.draw_number(random) if number is None else number, family
