"""Reinforcement learning for any scene whose score a reading measures: preset "any" of relign-train ppo.

The policy observes what that of remember.py observes, and its reward is the decrease of log(1 + measured score / resolution),
so that training needs no optima. A run consists of training segments; each starts with fresh instances, seeded by the
segment's number, and ends with an evaluation on tuning instances and a checkpoint.
"""

from __future__ import annotations

import math
import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from gymnasium import spaces
from torch import nn

from .._native import chosen_threads
from .devices import check_device, trained_on
from .episodes import Episode, Pool, tuning_scores
from .folder import RunFolder, reading
from .history import HistoryFormat
from .logs import check_loggers, opened
from .remember import TUNING_INSTANCES, parameters_of
from .settings import kept_recipe
from .stable_baselines import BatchVecEnv, EpisodeStatistics, falling_rate, seed_segment

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from .._typing import AnyArray, BoolArray, Float32Array, Float64Array
    from .logs import Loggers


@dataclass
class Recipe:
    """Settings of a run; recipe.json has them under these names, and python/README.md documents them."""

    preset: str = "any"
    algorithm: str = "ppo"
    scene: str = ""
    noise_level: str = "declared"
    noise_parameters: str = ""  # of the noise level, a JSON object
    scene_parameters: str = ""  # of the scene, a JSON object
    last: int = 16  # latest captures that the policy remembers
    best: int = 8  # and those with the lowest score
    episode: int = 60  # moves
    largest_move: float = 0.2
    hidden: tuple[int, ...] = (128, 128)  # of actor and of critic
    environments: int = 32
    steps: int = 60  # of each environment between two updates
    batch: int = 480
    epochs: int = 6
    gamma: float = 0.97
    gae_lambda: float = 0.95
    clip: float = 0.2
    entropy: float = 1e-3
    rate: float = 5e-4
    last_rate: float = 5e-4
    first_log_std: float = -0.7  # of actions, whose unit is the largest move
    total: int = 960_000  # steps of all environments
    stretch: int = 19_200  # length of a training segment, in steps of all environments
    tuning_steps: int = 100  # moves on tuning instances
    seed: int = 0

    def __post_init__(self) -> None:
        self.hidden = tuple(self.hidden)  # JSON has a list


class HistoryEnv(BatchVecEnv):
    """Episodes of equal length on fresh training instances; the observation is a row of HistoryFormat.

    Args:
        pool: Its batch has the environments.
        form: How captures become numbers.
        episode: Moves of an episode.
        largest_move: Unit of the actions, in shares of the travel.
    """

    def __init__(self, pool: Pool, form: HistoryFormat, episode: int, largest_move: float) -> None:
        super().__init__(pool.batch.slots, spaces.Box(-np.inf, np.inf, (form.count,), np.float32),
                         spaces.Box(-1, 1, (pool.axes,), np.float32))
        self.pool, self.form, self.episode, self.largest_move = pool, form, episode, largest_move
        self._slots = list(range(self.num_envs))
        self.random = np.random.default_rng(0)

    def reset(self) -> Float32Array:
        """Starts an episode on other instances."""
        numbers = [int(self.random.integers(2**53)) for _ in self._slots]
        self.pool.batch.reset(self._slots, numbers, self.pool.family)
        shape = (self.num_envs, self.episode + 1)
        self._poses: Float64Array = np.empty((*shape, self.pool.axes))
        self._readings: Float32Array = np.empty((*shape, len(self.pool.readings)), np.float32)
        self._step = 0
        self._statistics = EpisodeStatistics(self.num_envs)
        self._look(self.pool.batch.commanded_poses(self._slots))
        return self._observation()

    def _look(self, commanded: Float64Array) -> None:
        self._poses[:, self._step] = commanded
        self._readings[:, self._step] = self.pool.readings_of(self.pool.batch.frames[self._slots])

    def _observation(self) -> Float32Array:
        return self.form.inputs(self._poses[:, :self._step + 1], self._readings[:, :self._step + 1])

    def _cost(self) -> Float64Array:
        return self.pool.log_costs(self._readings[:, self._step, self.form.score])

    def step_wait(self) -> tuple[Float32Array, Float32Array, BoolArray, list[dict[str, Any]]]:
        """Moves and captures; see Stable-Baselines3's VecEnv."""
        before = self._cost()
        commanded = self._poses[:, self._step] + self.largest_move * np.clip(self._actions, -1, 1)
        self.pool.batch.move_by(self._slots, commanded - self.pool.batch.commanded_poses(self._slots))
        self._step += 1
        self._look(commanded)
        rewards = before - self._cost()
        self._statistics.add(rewards)
        observation = self._observation()
        over = np.full(self.num_envs, self._step >= self.episode)
        infos: list[dict[str, Any]] = [{} for _ in self._slots]
        if over[0]:
            infos = [{"terminal_observation": observation[slot], "TimeLimit.truncated": True,
                      "episode": self._statistics.take(slot)} for slot in self._slots]
            observation = self.reset()
        return observation, rewards.astype(np.float32), over, infos


class Actor(nn.Module):
    """The mean move of a policy, in shares of the travel."""

    def __init__(self, policy: Any, largest_move: float) -> None:
        super().__init__()
        self.hidden, self.action, self.largest_move = policy.mlp_extractor.policy_net, policy.action_net, largest_move

    def forward(self, history: torch.Tensor) -> torch.Tensor:
        """Moves, shape (batch, axes), for histories of shape (batch, count)."""
        return self.action(self.hidden(history)) * self.largest_move


class Training:
    """A run in a folder, with a checkpoint and a row of curve.csv after every training segment. An interrupted run resumes.

    Args:
        recipe: The recipe.
        folder: Folder of the run.
        threads: Threads that capture and train; None uses all cores.
        log: Gets one line about each training segment.
        device: Torch device of the learner.
        loggers: Get the learning curve (logs.py).

    Attributes:
        pool: Has the environments' batch.
        format: How captures become numbers.
        model: The learner of Stable-Baselines3.
        probes: None, in the form of remember.Training.
        rows: steps, reward per move, mean and median score on tuning instances, and hours, by segment.
        best: Lowest mean of log(1 + score / resolution) on tuning instances so far; None before the first segment.
        seconds: Time spent so far, over all sessions of the run.
        trained_on: As devices.trained_on returns it.

    Raises:
        ValueError: The recipe is not valid, the scene has no reading that measures its score, or the folder has a run with
            another recipe.
    """

    def __init__(self, recipe: Recipe, folder: str | os.PathLike[str], threads: int | None = None,
                 log: Callable[[str], object] = print, device: str = "cpu", loggers: Loggers = ()) -> None:
        from stable_baselines3 import PPO

        check_device(device, "cpu")
        check_loggers(loggers)
        if recipe.stretch % (recipe.environments * recipe.steps):
            raise ValueError(f"stretch={recipe.stretch} must be a multiple of environments * steps, here "
                             f"{recipe.environments * recipe.steps}: a training segment consists of whole rollouts")
        self.recipe, self.threads, self.log, self.device, self.loggers = recipe, threads, log, device, loggers
        self.folder = RunFolder(folder, recipe)
        torch.set_num_threads(chosen_threads(threads))
        self.pool = Pool(recipe.scene, recipe.noise_level, recipe.environments, threads=threads,
                         parameters=parameters_of(recipe), only_readings=True)
        measured = self.pool.reading
        if measured is None:
            raise ValueError(f"scene '{recipe.scene}' has no reading that measures its score, which preset 'any' needs")
        self.probes: tuple[Float64Array, float] = np.empty((0, self.pool.axes)), 0.0
        self.format = HistoryFormat(self.pool.axes, recipe.last, recipe.best, *self._spread(), measured)
        self.env = HistoryEnv(self.pool, self.format, recipe.episode, recipe.largest_move)
        self.done, self.seconds, self.best = 0, 0.0, math.inf
        self.rows: list[dict[str, float]] = []
        self.trained_on: dict[str, Any] = {}
        self.segments = -(-recipe.total // recipe.stretch)
        self.model: Any = None  # the learner asks for the rate while it is made
        rate = falling_rate(recipe, lambda: self.model.num_timesteps if self.model else 0)
        self.model = PPO("MlpPolicy", self.env, learning_rate=rate, n_steps=recipe.steps, batch_size=recipe.batch,
                         n_epochs=recipe.epochs, gamma=recipe.gamma, gae_lambda=recipe.gae_lambda, clip_range=recipe.clip,
                         ent_coef=recipe.entropy, seed=recipe.seed, device=device,
                         policy_kwargs={"net_arch": {"pi": list(recipe.hidden), "vf": list(recipe.hidden)},
                                        "activation_fn": nn.ReLU, "log_std_init": recipe.first_log_std})
        self._load("checkpoint.pt")

    @classmethod
    def open(cls, folder: str | os.PathLike[str]) -> Training:
        """Opens a run, complete or not, to export its network."""
        return cls(kept_recipe(Recipe, folder), folder, log=lambda _: None)

    def _spread(self) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Mean, deviation and finest difference of the readings, from poses all over the travel."""
        random = np.random.default_rng([self.recipe.seed, 3])
        slots = self.pool.mount(np.arange(self.pool.count))
        found = [self.pool.batch.capture_at(slots, random.uniform(size=(len(slots), self.pool.axes)),
                                            random.integers(2**63, size=len(slots))) for _ in range(20)]
        return self.pool.spread(self.pool.readings_of(np.concatenate(found)))

    def policy(self) -> Callable[[Episode], Float64Array]:
        """The policy without exploration, as agents run it."""
        actor, largest = Actor(self.model.policy, self.recipe.largest_move), self.recipe.largest_move

        def moves(seen: Episode) -> Float64Array:
            with torch.no_grad():
                history = torch.from_numpy(self.format.inputs(seen.poses, seen.readings)).to(self.device)
                output: AnyArray = actor(history).double().cpu().numpy()
            return np.clip(output, -largest, largest)

        return moves

    def run(self, until: int | None = None, minutes: float | None = None) -> None:
        """Trains to the end; `until` and `minutes` as of reinforce.Reinforcement.run.

        Raises:
            ValueError: Another process trains in the folder.
        """
        from stable_baselines3.common.logger import Logger

        recipe, end = self.recipe, math.inf if minutes is None else time.monotonic() + 60 * minutes
        tuning = Pool(recipe.scene, recipe.noise_level, TUNING_INSTANCES, family="tuning", threads=self.threads,
                      parameters=parameters_of(recipe), only_readings=True)
        last = 0.0
        with self.folder.alone(), opened(self.loggers, self.folder, asdict(recipe), self.model.num_timesteps,
                                         self.log) as log:
            self.model.set_logger(Logger(None, []))
            while self.done < min(self.segments, self.segments if until is None else until):
                begun = time.monotonic()
                if begun + last > end:
                    self.log(f"stopped at step {self.model.num_timesteps}; the same command resumes")
                    return
                seed_segment(recipe, self.done)
                self.env.random = np.random.default_rng([recipe.seed, 1, self.done])
                self.model._last_obs = None  # fresh instances
                self.model.ep_info_buffer = None
                self.model.learn(recipe.stretch, reset_num_timesteps=False)
                gained = [episode["r"] for episode in self.model.ep_info_buffer]
                scores = tuning_scores(tuning, self.policy(), recipe.tuning_steps)[:, -1]
                last = time.monotonic() - begun
                self.seconds += last
                self.done += 1
                row = {"steps": self.model.num_timesteps, "reward": float(np.mean(gained)) / recipe.episode,
                       "median": float(np.median(scores)), "log_mean": float(tuning.log_costs(scores).mean()),
                       "hours": self.seconds / 3600}
                self.rows.append(row)
                log(int(row["steps"]), {f"curve/{name}": value for name, value in row.items()})
                self._save()
                self.log(f"{row['steps']} of {self.segments * recipe.stretch} steps, {recipe.stretch / last:.0f} steps/s; "
                         f"reward {row['reward']:.4f} per move; {tuning.score.label} on tuning instances: median "
                         f"{row['median']:.4g}")

    def _save(self) -> None:
        self.trained_on = trained_on(self.trained_on, self.threads, self.device, "cpu")
        state = {"policy": self.model.policy.state_dict(), "optimizer": self.model.policy.optimizer.state_dict(),
                 "steps": self.model.num_timesteps, "done": self.done, "seconds": self.seconds, "rows": self.rows,
                 "trained_on": self.trained_on, "best": min(self.best, self.rows[-1]["log_mean"])}
        if self.rows[-1]["log_mean"] < self.best:
            self.best = self.rows[-1]["log_mean"]
            self.folder.keep("best.pt", lambda out: torch.save(state, out))
        self.folder.keep("checkpoint.pt", lambda out: torch.save(state, out))
        names = list(self.rows[0])
        lines = [",".join(f"{row[name]:.6g}" if name != "steps" else str(row[name]) for name in names) for row in self.rows]
        self.folder.keep_text("curve.csv", "\n".join([",".join(names), *lines]) + "\n")

    def _load(self, name: str) -> None:
        path = self.folder / name
        if not path.is_file():
            return
        with reading(path):
            state = torch.load(path, weights_only=True, map_location=self.device)
            self.model.policy.load_state_dict(state["policy"])
            self.model.policy.optimizer.load_state_dict(state["optimizer"])
            self.model.num_timesteps, self.done, self.seconds = state["steps"], state["done"], state["seconds"]
            self.rows, self.trained_on, self.best = state["rows"], state["trained_on"], state["best"]

    def load_best(self) -> int:
        """Loads the policy with the lowest scores on tuning instances, for export; returns its number of steps.

        Raises:
            ValueError: There is none yet.
        """
        if not (self.folder / "best.pt").is_file():
            raise ValueError(f"nothing trained yet in '{self.folder.path}': it has no best.pt")
        self._load("best.pt")
        return int(self.model.num_timesteps)
