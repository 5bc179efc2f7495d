"""Reinforcement learning with Stable-Baselines3: the paper's recipe, and one that starts from imitation learning.

A run consists of training segments. Each starts with fresh instances, seeded by the segment's number, and ends with an
evaluation on tuning instances and a checkpoint: an interrupted run repeats its last segment bit for bit.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import math
import pathlib
import time
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from .._native import chosen_threads
from . import curves
from .devices import check_device, trained_on
from .evaluation import evaluate, tuning_instances
from .folder import RunFolder, read_recipe, reading
from .logs import check_loggers, opened
from .recipe import SHAPED_REWARDS, TUNED_LEVELS, Recipe, check_recipe, check_warm_start
from .settings import kept_recipe

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from .._typing import Float64Array
    from .instances import InstanceSet
    from .logs import Loggers


SECONDS_BETWEEN_PICTURES = 60  # drawing takes half a second, on a GPU a tenth of a training segment


class Reinforcement:
    """A run in a folder: checkpoint and curve.csv after every training segment, best.pt, and curve.png once a minute.

    An interrupted run resumes.

    Args:
        recipe: The recipe.
        folder: Folder of the run.
        warm_start: Folder of the run whose network is the initial one, as recipe.check_warm_start describes; the learner of
            a run of relign-train ppo continues with its optimizer's state. A run that has a checkpoint needs it no more.
        threads: Threads that render and train; None uses all cores.
        log: Gets one line about each training segment.
        opened: Opens a run without its warm start, to export its network.
        device: Torch device of the learner: "cpu", or "cuda" for a GPU.
        render: Where images are rendered: "cpu", or "cuda", whose images stay on the GPU of the learner.
        loggers: Get the learning curve and what the learner records (logs.py): names, or functions of a step and its values.

    Attributes:
        model: The learner of Stable-Baselines3.
        done: Training segments that are complete.
        drawn: Training segments in curve.png.
        seconds: Time spent so far, over all sessions of the run.
        warm_seconds: Time that training the initial weights took.
        trained_on: As devices.trained_on returns it; empty before the first checkpoint.
        rows: Rows of the learning curve; curves.write_csv documents the columns.
        best: Lowest score so far, None before the first evaluation.
        segments: Training segments of the whole run. The last one is as long as the others, even if `total` is reached before.

    Raises:
        ValueError: The recipe is not valid, or the folder has a run with another one.
    """

    packaged = True  # the network is the package's, whose training can be recorded as CUDA graphs

    def __new__(cls, recipe: Recipe, *_: Any, **__: Any) -> Reinforcement:
        """A run of the class for the recipe's preset."""
        return super().__new__(TunedReinforcement if recipe.preset == "tuned" else cls)

    @classmethod
    def open(cls, recipe: Recipe, folder: str | os.PathLike[str], log: Callable[[str], object] = print) -> Reinforcement:
        """Opens a run without its warm start, to export its network."""
        return cls(recipe, folder, log=log, opened=True)

    def __init__(self, recipe: Recipe, folder: str | os.PathLike[str], warm_start: str | os.PathLike[str] | None = None,
                 threads: int | None = None, log: Callable[[str], object] = print, opened: bool = False,
                 device: str = "cpu", render: str = "cpu", loggers: Loggers = ()) -> None:
        check_recipe(recipe)
        check_loggers(loggers)
        self.loggers = loggers
        check_device(device, render)
        if render != "cpu" and recipe.algorithm == "recurrent-ppo":
            raise ValueError("algorithm 'recurrent-ppo' keeps its images in host memory; use --render cpu")
        initial: dict[str, Any] | None = None
        kept = "" if opened else begun_from(folder)
        checkpoint = None if opened or (kept and warm_start is None) else check_warm_start(recipe, warm_start)
        if checkpoint:
            initial, begins = self._initial(checkpoint)
            if checkpoint.parent.resolve() == pathlib.Path(folder).resolve():
                raise ValueError(f"--warm-start '{warm_start}' is the folder of the run itself; choose another one")
            if kept and begins != kept:
                raise ValueError(f"'{folder}' was begun from another checkpoint than --warm-start '{warm_start}' has now; "
                                 "leave --warm-start out to resume it, or choose another folder")
            recipe = replace(recipe, warm_start=begins)
        if kept:  # it continues from its own checkpoint
            recipe, initial = replace(recipe, warm_start=kept), None
        self.recipe, self.threads, self.log, self.device, self.render = recipe, threads, log, device, render
        # A longer run has the same beginning only if the learning rate is constant.
        self.folder = RunFolder(folder, recipe, may_grow=("total",) if recipe.rate == recipe.last_rate else ())
        if not opened:
            # Torch's threads wait busily, on cores that could render, and the matrices outside the compiled layers are
            # small. With one, weights do not depend on the number of threads.
            alone = self.packaged and recipe.algorithm in ("ppo", "a2c") and torch.device(device).type == "cpu"
            torch.set_num_threads(1 if alone else chosen_threads(threads))
        self.done, self.seconds, self.warm_seconds = 0, 0.0, 0.0
        self.drawn, self._next_picture = 0, 0.0
        self.trained_on: dict[str, Any] = {}
        self.rows: list[dict[str, Any]] = []
        self.best: float | None = None
        self.segments = -(-recipe.total // recipe.stretch)
        self.levels: tuple[float, ...]
        torch.manual_seed(recipe.seed)
        self._make()
        if initial and checkpoint:
            self._start_from(initial, checkpoint)
        self._load()
        if self.done and not opened:
            self.log(f"resuming at step {self.model.num_timesteps}")

    @property
    def recurrent(self) -> bool:
        """Whether the policy has a memory."""
        return self.recipe.algorithm == "recurrent-ppo"

    # ---- environment and learner ---------------------------------------------------------------

    def _make(self) -> None:
        from .policies import PackageFeatures, PackagePolicy
        from .stable_baselines import StableBaselinesEnv

        recipe = self.recipe
        self.frames, self.levels = recipe.frames, (recipe.level,)
        arguments: dict[str, Any] = {
            "scene": recipe.scene, "noise_level": recipe.noise_level, "noise_level_parameters": {"level": recipe.level},
            "observation": recipe.input, "observation_size": recipe.size, "frame_stack": recipe.frames, "action": "move",
            "goal": recipe.goal or None, "max_episode_steps": recipe.episode, "noise_free": False, "threads": self.threads,
            "device": self.render}
        if recipe.reward in SHAPED_REWARDS:
            from .directions import Directions
            from .instances import OptimumModel
            from .shaped import ShapedEnv

            optimum = OptimumModel(recipe.scene, recipe.size, recipe.optimum_samples, recipe.level or 0.25, self.threads,
                                   noise_level=recipe.noise_level)
            self.env: Any = ShapedEnv(recipe.environments, recipe.reward, Directions(recipe.scene, recipe.size), optimum,
                                      **arguments)
        else:
            self.env = StableBaselinesEnv(recipe.environments, reward=recipe.reward, **arguments)
        self._make_learner("CnnLstmPolicy" if self.recurrent else PackagePolicy,
                           {"features_extractor_class": PackageFeatures,
                            "features_extractor_kwargs": {"compiled": recipe.algorithm != "trpo", "threads": self.threads},
                            "log_std_init": recipe.first_log_std,
                            "net_arch": {"pi": list(recipe.heads), "vf": list(recipe.heads)}})

    def _make_learner(self, policy: Any, policy_arguments: dict[str, Any]) -> None:
        from .stable_baselines import falling_rate

        recipe = self.recipe
        self.model: Any = None  # the learner asks for the rate while it is made
        rate = falling_rate(recipe, lambda: self.model.num_timesteps if self.model else 0)
        arguments = {"learning_rate": rate, "n_steps": recipe.steps, "gamma": recipe.gamma, "gae_lambda": recipe.gae_lambda,
                     "seed": recipe.seed, "device": self.device, "policy_kwargs": policy_arguments}
        if not self.recurrent:
            from .frames import FrameRolloutBuffer, ImageRolloutBuffer

            arguments["rollout_buffer_class"] = FrameRolloutBuffer if self.packaged else ImageRolloutBuffer
        if recipe.algorithm in ("ppo", "recurrent-ppo"):
            arguments.update(batch_size=recipe.batch, n_epochs=recipe.epochs, clip_range=recipe.clip,
                             ent_coef=recipe.entropy, target_kl=recipe.target_kl or None)
        if recipe.algorithm == "a2c":
            arguments.update(ent_coef=recipe.entropy, normalize_advantage=True)  # as the package
        elif recipe.algorithm == "trpo":
            arguments.update(batch_size=recipe.batch)
        learner = _learner(recipe.algorithm, recorded=self.packaged and torch.device(self.device).type == "cuda")
        self.model = learner(policy, self.env, **arguments)

    def _log_learner(self, log: Callable[[int, dict[str, Any]], None]) -> None:
        from stable_baselines3.common.logger import KVWriter, Logger

        class Forward(KVWriter):
            """Passes on what the learner records."""

            def write(self, key_values: dict[str, Any], key_excluded: dict[str, Any], step: int = 0) -> None:
                log(step, {key: value for key, value in key_values.items() if "tensorboard" not in key_excluded[key]})

            def close(self) -> None:
                """Nothing to close."""

        self.model.set_logger(Logger(str(self.folder.path), [Forward()]))

    # ---- the policy as agents run it -----------------------------------------------------------

    def moves(self, frames: Any, step: int, memory: Any = None) -> tuple[Float64Array, Any]:
        """The policy without exploration.

        Args:
            frames: What the policy observes, an array or a tensor of shape (n, frames, height, width), the newest last.
            step: Number of the step, from 1.
            memory: Memory of a recurrent policy; None at the first step.

        Returns:
            Moves in shares of the travel, shape (n, axes), and the memory.
        """
        if not self.recurrent:  # model.predict would copy the frames to the host
            with torch.no_grad():
                actions = self.model.policy._predict(torch.as_tensor(frames, device=self.device), deterministic=True)
            return np.clip(actions.double().cpu().numpy(), self.env.action_space.low, self.env.action_space.high), None
        starts = np.full(len(frames), step == 1)
        actions, memory = self.model.predict(frames, state=memory, episode_start=starts, deterministic=True)
        return actions.astype(np.float64), memory

    # ---- training segments ---------------------------------------------------------------------

    def run(self, until: int | None = None, minutes: float | None = None) -> Any:
        """Trains to the end.

        Args:
            until: Stops after this many training segments of the run.
            minutes: Begins no training segment that, as long as the last one, would end later than this from now.

        Returns:
            The learner.

        Raises:
            ValueError: Another process trains in the folder.
        """
        tuning = None
        if self.done < self.segments:  # before a folder is made, since some scenes refuse it
            tuning = tuning_instances(self.recipe.scene, self.levels, self.recipe.size, self.threads, self.recipe.noise_level,
                                      self.recipe.input, self.render)
        with self.folder.alone(), opened(self.loggers, self.folder, asdict(self.recipe), self.model.num_timesteps,
                                         self.log) as log:
            self._log_learner(log)
            if self.rows:  # the process may have been killed after the last checkpoint
                self._write_curves()
            self._run(tuning, until, math.inf if minutes is None else time.monotonic() + 60 * minutes, log)
            if self.drawn < self.done:
                self._write_curves()
        return self.model

    def _run(self, tuning: InstanceSet | None, until: int | None, end: float,
             log: Callable[[int, dict[str, Any]], None]) -> None:
        from stable_baselines3.common.callbacks import BaseCallback

        class Episodes(BaseCallback):
            """Collects what is published of episodes that end, without their last observations, which are large."""

            def _init_callback(self) -> None:
                self.ended: list[tuple[float, int, bool]] = []

            def _on_step(self) -> bool:
                self.ended += [(info["episode"]["r"], info["episode"]["l"], info["is_success"])
                               for info in self.locals["infos"] if "episode" in info]
                return True

        steps = self.segments * self.recipe.stretch
        if steps > self.recipe.total and self.done < self.segments:
            self.log(f"the run ends at step {steps}: training segments are of {self.recipe.stretch} steps")
        while self.done < min(self.segments, self.segments if until is None else until):
            begun = time.monotonic()
            hours = [0.0, *(row["hours"] for row in self.rows)]
            if begun + 3600 * (hours[-1] - hours[-2:][0]) > end:
                self.log(f"stopped at step {self.model.num_timesteps} of {steps}; the same command resumes")
                return
            self._begin(self.done)
            episodes = Episodes()
            self.model._last_obs = None  # fresh instances
            self.model.learn(self.recipe.stretch, callback=episodes, reset_num_timesteps=False)
            trained = time.monotonic() - begun
            row: dict[str, Any] = {"steps": self.model.num_timesteps, **episode_means(episodes.ended)}
            assert tuning is not None
            row.update(evaluate(self.moves, tuning, self.frames), std=float(self.model.policy.log_std.detach().exp().mean()))
            lasted = time.monotonic() - begun
            self.seconds += lasted
            row["hours"] = self.seconds / 3600
            self.rows.append(row)
            self.done += 1
            log(row["steps"], {f"curve/{name}": value for name, value in row.items()})
            self._save()
            self.log(f"{row['steps']} of {steps} steps, {self.recipe.stretch / trained:.0f} steps/s; "
                     f"reward {shown(row['reward'], '.4f')} per step, {shown(row['episode'], '.0f')} steps per episode; "
                     f"tuning RMSE {row['rmse_6']:.4f} after 6 steps, {row['rmse_12']:.4f} after 12; "
                     f"{(self.segments - self.done) * lasted / 60:.0f} min left")

    def _begin(self, segment: int) -> None:
        from .stable_baselines import seed_segment

        self.env.seed(seed_segment(self.recipe, segment) * 1000)

    def _save(self) -> None:
        self.trained_on = trained_on(self.trained_on, self.threads, self.device, self.render)
        state = {"policy": self.model.policy.state_dict(), "optimizer": self.model.policy.optimizer.state_dict(),
                 "steps": self.model.num_timesteps, "updates": self.model._n_updates, "done": self.done,
                 "seconds": self.seconds, "warm_seconds": self.warm_seconds, "trained_on": self.trained_on,
                 "rows": self.rows, "best": self.best}
        score = self.rows[-1]["score"]
        if self.done > self.recipe.warm_up and (self.best is None or score < self.best):
            self.best = state["best"] = score
            best = {name: value for name, value in state.items() if name not in ("optimizer", "rows")}
            self.folder.keep("best.pt", lambda out: torch.save(best, out))
        self.folder.keep("checkpoint.pt", lambda out: torch.save(state, out))
        self._write_curves(time.monotonic() > self._next_picture)

    def _write_curves(self, picture: bool = True) -> None:
        curves.write_csv(self.folder, self.rows)
        curves.write_errors(self.folder, self.rows)
        if not picture:
            return
        self.drawn, self._next_picture = self.done, time.monotonic() + SECONDS_BETWEEN_PICTURES
        curves.draw(self.folder, f"{self.recipe.algorithm}, preset {self.recipe.preset}, {self.recipe.scene}", self.rows)

    def _initial(self, checkpoint: pathlib.Path) -> tuple[dict[str, Any], str]:
        """The state in the checkpoint of a warm start, and its hash.

        Raises:
            ValueError: It is damaged, not that of such a run, or has a value that is not finite.
        """
        with reading(checkpoint):
            content = checkpoint.read_bytes()
            # Not on the GPU: the optimizer's numbers of steps would stay there, and it would wait for each.
            state = torch.load(io.BytesIO(content), weights_only=True, map_location="cpu")
            finite = all(bool(torch.isfinite(value).all()) for value in state["policy" if self.packaged else "net"].values())
        if not finite:
            raise ValueError(f"--warm-start: '{checkpoint}' has weights that are not finite")
        if self.packaged and not state.get("optimizer"):
            raise ValueError(f"--warm-start: '{checkpoint}' has no state of the optimizer; use the checkpoint.pt of a run")
        return state, "sha256:" + hashlib.sha256(content).hexdigest()

    def _start_from(self, state: dict[str, Any], checkpoint: pathlib.Path) -> None:
        source = kept_recipe(Recipe, checkpoint.parent)
        with reading(checkpoint):
            self._take(state)
            steps, self.warm_seconds = state["steps"], state["seconds"] + state.get("warm_seconds", 0.0)
        if self.recipe.first_log_std != source.first_log_std:
            torch.nn.init.constant_(self.model.policy.log_std, self.recipe.first_log_std)
        self.log(f"starts from '{checkpoint.parent}' after {steps} steps, with a standard deviation of moves of "
                 f"{float(self.model.policy.log_std.detach().exp().mean()):.3g}")
        if self.recipe.seed == source.seed:
            self.log(f"warning: seed {source.seed} is that of --warm-start, so training repeats its instances; choose another "
                     "one")

    def _take(self, state: dict[str, Any]) -> None:
        self.model.policy.load_state_dict(state["policy"])
        if "optimizer" in state:
            self.model.policy.optimizer.load_state_dict(state["optimizer"])

    def _load(self, name: str = "checkpoint.pt") -> None:
        path = self.folder / name
        if not path.is_file():
            return
        with reading(path):
            state = torch.load(path, weights_only=True, map_location="cpu")
            self._take(state)
            self.model.num_timesteps, self.model._n_updates = state["steps"], state["updates"]
            self.done, self.seconds, self.best = state["done"], state["seconds"], state["best"]
            self.rows = state.get("rows", self.rows)
            self.warm_seconds, self.trained_on = state.get("warm_seconds", 0.0), state.get("trained_on", self.trained_on)
        if self.best is not None and not (self.folder / "best.pt").is_file():
            raise ValueError(f"'{self.folder / 'best.pt'}' is missing, the network with the best score; restore it from a "
                             "copy, or train in another folder")

    def untrained(self) -> str:
        """Why no network can be exported yet; "" if one can."""
        if self.best is not None:
            return ""
        why = "its first training segments train the critic only" if self.done else "it has no checkpoint.pt"
        return f"nothing trained yet in '{self.folder.path}': {why}"

    def load_best(self) -> int:
        """Loads the policy with the best score, for export.

        Returns:
            Its number of steps.

        Raises:
            ValueError: There is none yet.
        """
        if self.untrained():
            raise ValueError(self.untrained())
        self._load("best.pt")
        return self.model.num_timesteps


class TunedReinforcement(Reinforcement):
    """A run of the preset "tuned", which continues imitation learning with a privileged critic."""

    packaged = False

    def _make(self) -> None:
        from .directions import Directions
        from .instances import OptimumModel
        from .policies import PrivilegedCriticPolicy
        from .privileged import PrivilegedEnv

        recipe = self.recipe
        self.frames, self.levels = recipe.frames, TUNED_LEVELS
        directions = Directions(recipe.scene, recipe.size)
        optimum = OptimumModel(recipe.scene, recipe.size, recipe.optimum_samples, max(self.levels), self.threads)
        self.env = PrivilegedEnv(recipe.scene, self.levels, recipe.environments // len(self.levels), recipe.size, directions,
                                 optimum, recipe.seed, self.threads, self.render)
        self._make_learner(PrivilegedCriticPolicy, {"size": recipe.size, "directions": directions.vectors,
                                                    "spread": self.env.spread, "log_std_init": recipe.first_log_std})

    def _start_from(self, state: dict[str, Any], checkpoint: pathlib.Path) -> None:
        self.model.policy.net.load_residual(state["net"])
        self.warm_seconds = state.get("seconds", 0.0)

    def moves(self, frames: Any, step: int, memory: Any = None) -> tuple[Float64Array, Any]:
        """The policy without exploration; see Reinforcement."""
        from . import policy

        with torch.no_grad():
            residuals = self.model.policy.net(torch.as_tensor(frames, device=self.device)).double().cpu().numpy()
        return policy.moves(residuals, step), None

    def _begin(self, segment: int) -> None:
        super()._begin(segment)
        self.env.start_at(segment * 2**20)
        for parameter in self.model.policy.actor_parameters():
            parameter.requires_grad_(segment >= self.recipe.warm_up)


def begun_from(folder: str | os.PathLike[str]) -> str:
    """The hash of the initial weights of the run in a folder that has a checkpoint; "" if it has none, or no such weights."""
    folder = pathlib.Path(folder)
    if not (folder / "checkpoint.pt").is_file() or not (folder / "recipe.json").is_file():
        return ""
    return str(read_recipe(folder).get("warm_start", ""))


def _learner(algorithm: str, recorded: bool) -> Any:
    """The class of the learner; recorded: with CUDA graphs, where there is one."""
    if algorithm == "ppo" and recorded:
        from .graphs import GraphPPO

        return GraphPPO
    module = "stable_baselines3" if algorithm in ("ppo", "a2c") else "sb3_contrib"
    names = {"ppo": "PPO", "a2c": "A2C", "trpo": "TRPO", "recurrent-ppo": "RecurrentPPO"}
    return getattr(importlib.import_module(module), names[algorithm])


def episode_means(ended: list[tuple[float, int, bool]]) -> dict[str, float | None]:
    """Means over the episodes that ended: episodes (their number), reward (per step), episode (length) and success (share).

    Without episodes all but their number are None.

    Args:
        ended: Of each the sum of its rewards, its steps, and whether it met the goal.
    """
    if not ended:
        return {"episodes": 0, "reward": None, "episode": None, "success": None}
    rewards, lengths, successes = zip(*ended)
    return {"episodes": len(ended), "reward": sum(rewards) / sum(lengths), "episode": sum(lengths) / len(ended),
            "success": float(np.mean(successes))}


def shown(value: float | None, form: str) -> str:
    """A number as text; "-" for None."""
    return "-" if value is None else format(value, form)
