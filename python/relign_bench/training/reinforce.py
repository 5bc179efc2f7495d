"""Reinforcement learning with Stable-Baselines3: the paper's recipe, and one that begins with what imitation learnt.

A training is a row of stretches of so many steps. Every stretch begins with fresh lenses, seeded by its number, and
ends with a look at the policy on tuning lenses and a checkpoint: a run that was killed repeats its last stretch to the
bit.
"""

import hashlib
import pathlib
import random
import time
from dataclasses import dataclass, replace

import numpy as np
import torch

from . import curves
from .evaluation import evaluate
from .folder import RunFolder

SMALLEST = 64  # columns that the package's network leaves one of
ALGORITHMS = ("ppo", "a2c", "trpo", "recurrent-ppo")  # those that the paper compared


@dataclass
class Recipe:
    """The preset "paper": the package's network and settings."""

    preset: str = "paper"
    algorithm: str = "ppo"
    scene: str = "relign_od"
    size: int = 200  # columns of the pictures that the network sees, binned from the scene's
    level: float = 0.25
    goal: float = 0.0555  # an episode ends below this score; the package's for N = 0.25
    episode: int = 200  # steps at most
    frames: int = 5  # the last pictures, zeros before the start
    environments: int = 5
    steps: int = 100  # of each environment, then the network is fitted
    batch: int = 500
    epochs: int = 5
    gamma: float = 0.9
    gae_lambda: float = 0.95
    clip: float = 0.2
    rate: float = 1e-4
    last_rate: float = 1e-4
    entropy: float = 1e-3
    target_kl: float = 0.0  # 0: no stop
    first_log_std: float = -3.0
    total: int = 2_000_000  # steps of all environments
    stretch: int = 20_000
    warm_start: str = ""  # hash of the weights
    optimum_samples: int = 384  # exact optima that labels and rewards are fitted on
    warm_up: int = 0  # stretches in which the critic alone learns
    seed: int = 0


GOALS = {0.0: 0.051, 0.25: 0.0555, 0.5: 0.060}  # of the package, by noise level

PRESETS = {
    "paper": Recipe(),
    # One policy for all levels: the network of imitation, which sees one small picture.
    "tuned": Recipe(preset="tuned", size=100, level=0.5, goal=0.0, episode=12, frames=1, environments=160, steps=12,
                    batch=960, epochs=4, rate=3e-6, last_rate=0.0, entropy=0.0, target_kl=0.03, first_log_std=-1.0,
                    total=480_000, stretch=19_200, warm_up=1),
}
TUNED_LEVELS = (0.0, 0.125, 0.25, 0.375, 0.5)


def weights_hash(path):
    return "sha256:" + hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


class Reinforcement:
    """One run in a folder: checkpoint, curve.csv and curve.png after every stretch, best.pt. Goes on where it was stopped
    or killed."""

    @classmethod
    def opened(cls, recipe, folder, tell=print):
        """What is in the folder, without what it began with."""
        return cls(recipe, folder, tell=tell, opened=True)

    def __init__(self, recipe, folder, warm_start=None, threads=None, tell=print, opened=False):
        if recipe.algorithm not in ALGORITHMS:
            raise ValueError(f"there is no algorithm '{recipe.algorithm}'; algorithms: {', '.join(ALGORITHMS)}")
        if recipe.preset == "paper" and recipe.size < SMALLEST:
            raise ValueError(f"size={recipe.size}: the package's network, which halves pictures six times, needs "
                             f"{SMALLEST} columns or more")
        self._warm = None
        if recipe.preset == "tuned" and not opened:
            if not warm_start:
                raise ValueError("preset tuned begins with what imitation learnt: --warm-start FOLDER of relign-train imitate")
            if recipe.algorithm != "ppo":
                raise ValueError("preset tuned is made for ppo; the others go with --preset paper")
            self._warm = pathlib.Path(warm_start) / "checkpoint.pt"
            if not self._warm.is_file():
                raise ValueError(f"--warm-start {warm_start}: there is no checkpoint.pt in it; expected a folder of "
                                 "relign-train imitate")
            recipe = replace(recipe, warm_start=weights_hash(self._warm))
        self.recipe, self.threads, self.tell = recipe, threads, tell
        # A rate that falls to the end has another course when the end is another.
        self.folder = RunFolder(folder, recipe, may_grow=("total",) if recipe.rate == recipe.last_rate else ())
        if threads:
            torch.set_num_threads(threads)
        self.done, self.seconds, self.rows, self.best = 0, 0.0, [], None  # stretches; rows of the curve
        self.warm_seconds = 0.0  # that the training of its first weights took
        torch.manual_seed(recipe.seed)
        (self._make_tuned if recipe.preset == "tuned" else self._make_paper)()
        self._open_log()
        self._load()

    @property
    def recurrent(self):
        return self.recipe.algorithm == "recurrent-ppo"

    # ---- environment and learner ---------------------------------------------------------------

    def _make_paper(self):
        from .policies import PackageFeatures
        from .stable_baselines import StableBaselinesEnv

        recipe = self.recipe
        self.frames = 1 if self.recurrent else recipe.frames  # its memory takes the place of the stack
        self.env = StableBaselinesEnv(
            recipe.environments, scene=recipe.scene, noise_level="rho",
            noise_level_parameters={"level": recipe.level}, observation_size=recipe.size, frame_stack=self.frames, action="move",
            reward="paper", goal=recipe.goal or None, max_episode_steps=recipe.episode, noise_free=False,
            threads=self.threads)
        self.levels = (recipe.level,)
        self.white = self.env.environments.task.white
        self._learner("CnnLstmPolicy" if self.recurrent else "CnnPolicy",
                      dict(features_extractor_class=PackageFeatures, log_std_init=recipe.first_log_std, net_arch=[]))

    def _make_tuned(self):
        from .directions import Directions
        from .guided import GuidedEnv
        from .lenses import OptimumModel
        from .policies import GuidedPolicy

        recipe = self.recipe
        self.frames, self.levels = recipe.frames, TUNED_LEVELS
        self.directions = Directions(recipe.scene, recipe.size)
        optimum = OptimumModel(recipe.scene, recipe.size, recipe.optimum_samples, max(self.levels), self.threads)
        self.env = GuidedEnv(recipe.scene, self.levels, recipe.environments // len(self.levels), recipe.size,
                             self.directions, optimum, recipe.seed, self.threads)
        self._learner(GuidedPolicy, dict(size=recipe.size, directions=self.directions.vectors, spread=self.env.spread,
                                         log_std_init=recipe.first_log_std))
        if self._warm:
            begun_with = torch.load(self._warm, weights_only=True)
            self.model.policy.net.load_state_dict(begun_with["net"])
            self.warm_seconds = begun_with.get("seconds", 0.0)

    def _learner(self, policy, policy_arguments):
        recipe = self.recipe
        self.model = None  # the rate is asked for while the learner is made

        def rate(_):
            done = self.model.num_timesteps / recipe.total if self.model else 0.0
            return recipe.last_rate + (recipe.rate - recipe.last_rate) * max(0.0, 1 - done)

        common = dict(learning_rate=rate, n_steps=recipe.steps, gamma=recipe.gamma, gae_lambda=recipe.gae_lambda,
                      seed=recipe.seed, device="cpu", policy_kwargs=policy_arguments)
        if recipe.algorithm in ("ppo", "recurrent-ppo"):
            common.update(batch_size=recipe.batch, n_epochs=recipe.epochs, clip_range=recipe.clip,
                          ent_coef=recipe.entropy, target_kl=recipe.target_kl or None)
        if recipe.algorithm == "ppo":
            from stable_baselines3 import PPO as Learner
        elif recipe.algorithm == "a2c":
            from stable_baselines3 import A2C as Learner
            common.update(ent_coef=recipe.entropy)
        elif recipe.algorithm == "trpo":
            from sb3_contrib import TRPO as Learner
            common.update(batch_size=recipe.batch)
        else:
            from sb3_contrib import RecurrentPPO as Learner
        self.model = Learner(policy, self.env, **common)

    def _open_log(self):
        from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat

        formats = []
        try:
            formats.append(TensorBoardOutputFormat(str(self.folder / "tensorboard")))
        except (AssertionError, ImportError):
            self.tell("no TensorBoard log: pip install tensorboard")
        self.model.set_logger(Logger(str(self.folder.path), formats))

    # ---- the policy as it will be used -----------------------------------------------------------

    def moves(self, frames, step, memory=None):
        """Moves for bytes (n, frames, height, width) at step 1, 2, ...; second, what the policy remembers."""
        from . import policy

        if self.recipe.preset == "tuned":
            with torch.no_grad():
                return policy.moves(self.model.policy.net(torch.from_numpy(frames)).double().numpy(), step), None
        starts = np.full(len(frames), step == 1)
        actions, memory = self.model.predict(frames, state=memory, episode_start=starts, deterministic=True)
        return actions.astype(np.float64), memory

    # ---- stretches --------------------------------------------------------------------------------

    def run(self, until=None):
        """Trains to the end, or to so many stretches."""
        from stable_baselines3.common.callbacks import BaseCallback

        class Episodes(BaseCallback):
            def _init_callback(self):
                self.infos = []

            def _on_step(self):
                self.infos += [info for info in self.locals["infos"] if "episode" in info]
                return True

        last = -(-self.recipe.total // self.recipe.stretch)
        while self.done < min(last, until or last):
            begun = time.monotonic()
            self._seed(self.done)
            self._freeze(self.done < self.recipe.warm_up)
            episodes = Episodes()
            self.model._last_obs = None  # fresh lenses
            self.model.learn(self.recipe.stretch, callback=episodes, reset_num_timesteps=False)
            trained = time.monotonic() - begun
            row = {"steps": self.model.num_timesteps, **self._episodes(episodes.infos)}
            row.update(evaluate(self.moves, self.recipe.scene, self.levels, self.recipe.size, self.frames,
                                self.threads))
            self.seconds += time.monotonic() - begun
            row["hours"] = self.seconds / 3600
            self.rows.append(row)
            self.done += 1
            self._save()
            left = (last - self.done) * self.seconds / self.done
            self.tell(f"{row['steps']} of {self.recipe.total} steps, {self.recipe.stretch / trained:.0f} steps/s, "
                       f"reward {row['reward']:.4f} a step, episodes of {row['episode']:.0f} steps, tuning RMSE "
                       f"{row['rmse_6']:.4f} after 6 steps, {row['rmse_12']:.4f} after 12; {left / 60:.0f} min left")
        return self.model

    def _seed(self, stretch):
        seed = self.recipe.seed * 1_000_003 + stretch + 1
        torch.manual_seed(seed)
        np.random.seed(seed % 2**32)
        random.seed(seed)
        if self.recipe.preset == "tuned":
            self.env.begin_with(stretch * 2**20)
        else:
            self.env.seed(seed * 1000)

    def _freeze(self, frozen):
        if self.recipe.preset == "tuned":
            for parameter in self.model.policy.actor_parameters():
                parameter.requires_grad_(not frozen)

    def _episodes(self, infos):
        """Means over the episodes that ended."""
        length = sum(info["episode"]["l"] for info in infos)
        return {
            "episodes": len(infos),
            "reward": sum(info["episode"]["r"] for info in infos) / max(1, length),
            "episode": length / max(1, len(infos)),
            "success": float(np.mean([info["is_success"] for info in infos])) if infos else 0.0,
        }

    def _save(self):
        state = {"policy": self.model.policy.state_dict(), "optimizer": self.model.policy.optimizer.state_dict(),
                 "steps": self.model.num_timesteps, "updates": self.model._n_updates, "done": self.done,
                 "seconds": self.seconds, "warm_seconds": self.warm_seconds, "rows": self.rows, "best": self.best}
        score = self.rows[-1]["score"]
        if self.done > self.recipe.warm_up and (self.best is None or score < self.best):
            self.best = state["best"] = score
            self.folder.keep("best.pt", lambda out: torch.save(state, out))
        self.folder.keep("checkpoint.pt", lambda out: torch.save(state, out))
        curves.write_csv(self.folder, self.rows)
        curves.draw(self.folder, f"{self.recipe.algorithm}, preset {self.recipe.preset}, {self.recipe.scene}", self.rows)

    def _load(self, name="checkpoint.pt"):
        path = self.folder / name
        if not path.is_file():
            return
        state = torch.load(path, weights_only=True)
        self.model.policy.load_state_dict(state["policy"])
        self.model.policy.optimizer.load_state_dict(state["optimizer"])
        self.model.num_timesteps, self.model._n_updates = state["steps"], state["updates"]
        self.done, self.seconds, self.rows, self.best = state["done"], state["seconds"], state["rows"], state["best"]
        self.warm_seconds = state.get("warm_seconds", 0.0)
        self.tell(f"goes on at step {self.model.num_timesteps}")

    def load_best(self):
        """The policy of the stretch that did best on tuning lenses, for export. Returns its steps."""
        self._load("best.pt")
        return self.model.num_timesteps
