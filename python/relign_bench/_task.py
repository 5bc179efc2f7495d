"""What single and vector environment have in common: a batch of lenses with spaces, scores and rewards."""

import numpy as np
from gymnasium import spaces

from . import rewards as _rewards
from .batch import Batch
from .conventions import LARGEST_MOVE, to_bytes

FLOAT_WHITES = 30.0  # float32 observations: the space's upper bound, in white pixels

OBSERVATIONS = ("uint8", "float32")
ACTIONS = ("unit", "move", "absolute")
FAMILIES = ("training", "tuning", "benchmark")
MAX_EPISODE_STEPS = 200  # of the package


class AlignmentTask:
    """n slots of one scene and noise level; see AlignmentEnv for the arguments."""

    def __init__(self, slots, scene="relign_od", noise_level="rho0.25", reward="paper", score="combined",
                 observation="uint8", size=None, frame_stack=1, include_actions=False, action="unit", clipping="soft",
                 goal=None, max_episode_steps=MAX_EPISODE_STEPS, noise_free=True, instances="training", suite_seed=1,
                 scene_parameters=None, noise_level_parameters=None, threads=None, observation_size=None):
        _rewards.check_name(reward, _rewards.REWARDS, "reward")
        _rewards.check_name(score, _rewards.SCORES, "score")
        _rewards.check_name(observation, OBSERVATIONS, "observation")
        _rewards.check_name(action, ACTIONS, "action")
        if reward == "minus_one_plus" and goal is None:
            raise ValueError("reward 'minus_one_plus' counts from a goal; give one, such as goal=0.05")
        if int(frame_stack) < 1:
            raise ValueError(f"frame_stack={frame_stack}: allowed: 1 or more")
        if max_episode_steps is not None and int(max_episode_steps) < 1:
            raise ValueError(f"max_episode_steps={max_episode_steps}: allowed: 1 or more, or None")
        if instances not in FAMILIES:
            raise ValueError(f"there are no instances '{instances}'; instances: {', '.join(FAMILIES)}")
        self.reward, self.score, self.observation, self.action = reward, score, observation, action
        self.frame_stack, self.include_actions = int(frame_stack), bool(include_actions)
        self.goal = goal
        self.max_episode_steps = np.inf if max_episode_steps is None else int(max_episode_steps)
        self.noise_free, self.instances = bool(noise_free), instances
        self.batch = Batch(slots, scene, noise_level, clipping, suite_seed, size, scene_parameters,
                           noise_level_parameters, threads)
        self.noise_free = self.noise_free and self.batch.tells_truth
        self.axes, self.white = self.batch.axes, self.batch.white
        self.nominal_pose, self.reference = self.batch.nominal_pose, self.batch.reference
        self.frames = self.batch.frames  # a view: always the last captures
        height, width = self._observed_shape(observation_size)
        if observation == "uint8":
            image = spaces.Box(0, 255, (self.frame_stack, height, width), np.uint8)
        else:
            image = spaces.Box(0, np.float32(FLOAT_WHITES * self.white), (self.frame_stack, height, width), np.float32)
        low, high = {"unit": (-1, 1), "move": (-LARGEST_MOVE, LARGEST_MOVE), "absolute": (0, 1)}[action]
        self.action_space = spaces.Box(low, high, (self.axes,), np.float32)
        self.observation_space = image
        if self.include_actions:
            past = spaces.Box(low, high, (self.frame_stack * self.axes,), np.float32)
            self.observation_space = spaces.Dict({"image": image, "actions": past})
        self.stacks = np.zeros((slots, self.frame_stack, height, width), image.dtype)
        self.past = np.zeros((slots, self.frame_stack, self.axes), np.float32)
        self.scores = np.zeros(slots)
        self.steps = np.zeros(slots, np.int64)
        self.numbers = np.zeros(slots, np.int64)  # of the instances

    def _observed_shape(self, columns):
        height, width = self.reference.shape
        columns = width if columns is None else int(columns)
        if columns < 1 or width % columns or height % (width // columns):
            raise ValueError(f"observation_size={columns}: captures of {width} x {height} pixels can be binned to "
                             f"{', '.join(str(width // k) for k in range(1, 11) if width % k == height % k == 0)} columns")
        self._bin = width // columns
        return height // self._bin, columns

    # ---- episodes ------------------------------------------------------------------------------

    def draw_number(self, random):
        """The number of another instance, from an episode's own generator."""
        return int(random.integers(2**53))

    def reset(self, slots, numbers, domains):
        """New lenses in these slots. `domains`: "training", "tuning" or "benchmark" per slot."""
        for domain in sorted(set(domains)):
            chosen = [k for k, other in enumerate(domains) if other == domain]
            self.batch.reset([slots[k] for k in chosen], [numbers[k] for k in chosen], domain)
        self.stacks[slots] = 0
        self.past[slots] = 0
        self.steps[slots] = 0
        self.numbers[slots] = numbers
        self._look(slots)
        self.scores[slots] = self._scores(self.score, slots)

    def step(self, slots, actions):
        """Moves and captures; returns rewards, terminated and truncated of these slots, shape (len(slots),)."""
        actions = np.asarray(actions, np.float32).reshape(len(slots), self.axes)
        self.batch.move_by(slots, self.moves(slots, actions))
        self.steps[slots] += 1
        self.past[slots] = np.roll(self.past[slots], -1, axis=1)
        self.past[slots, -1] = actions
        self._look(slots)
        before, after = self.scores[slots], self._scores(self.score, slots)
        combined = after if self.score == "combined" else self._scores("combined", slots)
        self.scores[slots] = after
        gained = _rewards.rewards(self.reward, before, after, combined, self.batch.true_poses(slots), self.goal)
        reached = np.zeros(len(slots), bool) if self.goal is None else after < self.goal
        return gained, reached, self.steps[slots] >= self.max_episode_steps

    def moves(self, slots, actions):
        """Commanded moves in shares of the travel, float64, shape (len(slots), axes)."""
        if self.action == "absolute":  # the stage's own coordinates, which count from the true start
            return actions.astype(np.float64) - self.batch.commanded_poses(slots)
        scale = LARGEST_MOVE if self.action == "unit" else 1.0
        return np.clip(actions.astype(np.float64) * scale, -LARGEST_MOVE, LARGEST_MOVE)

    # ---- what is seen --------------------------------------------------------------------------

    def _look(self, slots):
        if self.frame_stack > 1:
            self.stacks[slots, :-1] = self.stacks[slots, 1:]
        for slot in slots:
            frame = self.frames[slot]
            if self._bin > 1:
                height, width = self.stacks.shape[2:]
                frame = frame.reshape(height, self._bin, width, self._bin).mean(axis=(1, 3))
            if self.observation == "uint8":
                self.stacks[slot, -1] = to_bytes(frame, self.white)
            else:
                np.minimum(frame, FLOAT_WHITES * self.white, out=self.stacks[slot, -1])

    def _scores(self, name, slots):
        frames = self.frames[slots] if name == "rmse_binary" else ()
        return _rewards.scores(name, self.batch.measured(slots), self.batch.true_poses(slots), self.nominal_pose,
                               frames, self.reference)

    def observation_of(self, slot):
        """A copy: what was given away never changes."""
        image = self.stacks[slot].copy()
        return {"image": image, "actions": self.past[slot].ravel().copy()} if self.include_actions else image

    def infos(self, slots):
        """One dictionary per slot."""
        true_poses, commanded = self.batch.true_poses(slots), self.batch.commanded_poses(slots)
        measured = self.batch.measured(slots)
        if self.noise_free:
            rmse = np.sqrt(np.maximum(0.0, self.batch.truths(slots)[0]))
        infos = []
        for k, slot in enumerate(slots):
            info = {
                "true_pose": true_poses[k],
                "commanded_pose": commanded[k],
                "measured_rmse": float(measured[k]),
                "score": float(self.scores[slot]),
                "limits": self.batch.limits(slot),
                "instance": int(self.numbers[slot]),
            }
            if self.noise_free:
                info["noise_free_rmse"] = float(rmse[k])
            infos.append(info)
        return infos
