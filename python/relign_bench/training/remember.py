"""Imitation learning for any scene with a score: the policy remembers poses and readings, or poses beside its latest images.

A network learns the displacement to an instance's own optimum from what a trajectory has shown so far. Trajectories are random
searches around the optimum and, from the first pass on, what the policy itself does from starts and other poses (DAgger: Ross,
Gordon and Bagnell 2011). Instances are a fixed pool of the family "training", because their optima can take seconds each.
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from .._native import chosen_threads
from .devices import check_device, trained_on
from .episodes import SLOTS, Episode, Pool, probed, searching, tuning_scores
from .folder import RunFolder, reading
from .history import HistoryFormat, HistoryNet
from .logs import check_loggers, opened
from .settings import kept_recipe

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from .._typing import AnyArray, Float64Array
    from .logs import Loggers


@dataclass
class Recipe:
    """Settings of a run; recipe.json has them under these names, and python/README.md documents them."""

    scene: str = ""
    noise_level: str = "declared"
    noise_parameters: str = ""  # of the noise level, a JSON object
    columns: int = 0  # of the images, 0: the scene's
    frames: int = 1  # latest images that the network sees
    last: int = 16  # latest captures that it remembers
    best: int = 8  # and those with the lowest score, where a reading measures it
    probes: int = 40  # at most, before its output is followed
    pool: int = 256  # instances
    passes: int = 60
    epochs: int = 6  # over the captures of a pass
    moves: int = 40  # of a trajectory
    visited: float = 0.6  # share of trajectories that the policy makes
    largest_move: float = 0.2
    least: float = 0.01  # error that counts as much as a share of 0.15 of the residual
    hidden: tuple[int, ...] = (256, 256)
    batch: int = 256
    rate: float = 1e-3
    last_rate: float = 1e-5
    tuning_steps: int = 100  # moves on tuning instances, at the end
    seed: int = 0

    def __post_init__(self) -> None:
        self.hidden = tuple(self.hidden)  # JSON has a list


TUNING_INSTANCES = 20
RELATIVE = 0.15  # of the residual, in the loss
NOISE = (0.003, 0.1)  # of moves of half of the policy's trajectories, log-uniform


def noise_parameters(recipe: Any) -> dict[str, Any]:
    """The parameters of the noise level.

    Raises:
        ValueError: They are not a JSON object.
    """
    try:
        parameters = json.loads(recipe.noise_parameters or "{}")
    except ValueError as problem:
        raise ValueError(f"noise_parameters='{recipe.noise_parameters}' is not JSON: {problem}") from None
    if not isinstance(parameters, dict):
        raise ValueError(f"noise_parameters must be a JSON object such as {{\"start\": 0.5}}, not {recipe.noise_parameters}")
    return parameters


class Training:
    """A run in a folder, with a checkpoint after every pass, and curve.csv. An interrupted run resumes.

    Args:
        recipe: The recipe.
        folder: Folder of the run.
        threads: Threads that capture and train; None uses all cores.
        log: Gets one line about each part of the work.
        device: Torch device that trains.
        loggers: Get the learning curve (logs.py).

    Attributes:
        pool: The training instances.
        format: How captures become numbers; None before the first pass.
        net: The network; None before the first pass.
        probes: Poses relative to the start, shape (n, axes), and the reading below which they end.
        curve: [pass, mean loss] of each pass.
        seconds: Time spent so far, over all sessions of the run.
        trained_on: As devices.trained_on returns it; empty before the first checkpoint.

    Raises:
        ValueError: The folder has a run with another recipe, or the scene does not suit.
    """

    def __init__(self, recipe: Recipe, folder: str | os.PathLike[str], threads: int | None = None,
                 log: Callable[[str], object] = print, device: str = "cpu", loggers: Loggers = ()) -> None:
        check_device(device, "cpu")
        check_loggers(loggers)
        self.recipe, self.threads, self.log, self.device, self.loggers = recipe, threads, log, device, loggers
        self.folder = RunFolder(folder, recipe)
        torch.set_num_threads(chosen_threads(threads))
        self.pool = Pool(recipe.scene, recipe.noise_level, recipe.pool, recipe.columns, threads=threads,
                         noise_parameters=noise_parameters(recipe))
        measured = self.pool.reading
        self.format = HistoryFormat(self.pool.axes, recipe.last, 0 if measured is None else recipe.best, np.empty(0),
                                    np.empty(0), np.empty(0), measured)
        if not self.pool.images:
            count = self.pool.shape[0]
            self.format.mean, self.format.deviation, self.format.fine = np.zeros(count), np.ones(count), np.ones(count)
        torch.manual_seed(recipe.seed)
        images = (recipe.frames, *self.pool.shape) if self.pool.images else None
        self.net = HistoryNet(self.format.count, self.pool.axes, recipe.hidden, images)  # type: ignore[arg-type]
        self.net.to(device)
        self.probes: tuple[Float64Array, float] = np.empty((0, self.pool.axes)), 0.0
        self.curve: list[list[Any]] = []
        self.seconds = 0.0
        self.trained_on: dict[str, Any] = {}

    @classmethod
    def open(cls, folder: str | os.PathLike[str], threads: int | None = None,
             log: Callable[[str], object] = lambda _: None) -> Training:
        """Opens a run, complete or not.

        Raises:
            ValueError: The folder is not that of such a run, or it has no checkpoint yet.
        """
        training = cls(kept_recipe(Recipe, folder), folder, threads, log)
        if not training.load():
            raise ValueError(f"nothing trained yet in '{folder}': it has no checkpoint.pt")
        return training

    def run(self) -> HistoryNet:
        """Trains to the end; returns the network.

        Raises:
            ValueError: Another process trains in the folder, or the scene does not search for own optima.
        """
        optimizer = torch.optim.Adam(self.net.parameters(), lr=self.recipe.rate)
        done = self.load(optimizer)
        if done < self.recipe.passes:
            with self.folder.alone(), opened(self.loggers, self.folder, asdict(self.recipe), done, self.log) as log:
                self.pool.find_optima(self.folder, self.log)
                if not done:
                    self._prepare()
                self._train(done, optimizer, log)
        return self.net

    def _prepare(self) -> None:
        """Chooses probes, and how readings are normalised."""
        recipe, pool = self.recipe, self.pool
        random = np.random.default_rng([recipe.seed, 3])
        if pool.images:
            return
        if pool.reading is not None and recipe.probes:
            self.probes = pool.choose_probes(recipe.probes, random)
            self.log(f"{len(self.probes[0])} probes, until {pool.score.name} is below {self.probes[1]:.4g} {pool.score.unit}")
        chosen = np.arange(min(SLOTS, pool.count))
        begin, policy = searching(pool.optima[chosen], random, recipe.moves)
        values = pool.episode(chosen, policy, recipe.moves, begin).values.reshape(-1, *pool.shape).astype(np.float64)
        deviation = values.std(0)
        self.format.mean, self.format.deviation = values.mean(0), np.where(deviation > 0, deviation, 1.0)
        self.format.fine = self.format.deviation / 1000
        if pool.reading is not None:
            self.format.fine[pool.reading] = pool.batch.description["score"]["resolution"]

    def _train(self, done: int, optimizer: torch.optim.Optimizer, log: Callable[[int, dict[str, Any]], None]) -> None:
        for number in range(done, self.recipe.passes):
            begun = time.monotonic()
            inputs, residuals = self._data(number)
            captured = time.monotonic() - begun
            loss = self._pass(inputs, residuals, optimizer, number)
            seconds = time.monotonic() - begun
            self.curve.append([number + 1, loss])
            self.seconds += seconds
            log(number + 1, {"curve/loss": loss, "curve/hours": self.seconds / 3600})
            self.log(f"pass {number + 1} of {self.recipe.passes}: loss {loss:.4f}, {len(residuals)} captures in "
                     f"{captured:.0f} + {seconds - captured:.0f} s")
            self._save(number + 1, optimizer)

    def _data(self, number: int) -> tuple[list[torch.Tensor], torch.Tensor]:
        """Inputs and residuals of pass `number`, from 0."""
        recipe, pool = self.recipe, self.pool
        random = np.random.default_rng([recipe.seed, 1, number])
        order = random.permutation(pool.count)
        inputs: list[list[AnyArray]] = []
        residuals = []
        for first in range(0, pool.count, pool.batch.slots):
            chosen = order[first:first + pool.batch.slots]
            if first < recipe.visited * pool.count:
                seen = self._visit(chosen, random)
            else:
                begin, policy = searching(pool.optima[chosen], random, recipe.moves)
                seen = pool.episode(chosen, policy, recipe.moves, begin)
            for step in range(recipe.moves + 1):
                inputs.append(self.inputs(seen, step + 1))
                residuals.append(seen.residuals[:, step])
        joined = [torch.from_numpy(np.concatenate(part)) for part in zip(*inputs)]
        return joined, torch.from_numpy(np.concatenate(residuals).astype(np.float32))

    def _visit(self, chosen: AnyArray, random: np.random.Generator) -> Episode:
        """What the policy does on these instances: half from starts, half with noise of one size for each trajectory."""
        count, axes = len(chosen), self.pool.axes
        low, high = map(math.log, NOISE)
        sizes = np.exp(random.uniform(low, high, (count, 1))) * (random.uniform(size=(count, 1)) < 0.5)
        jump = random.uniform(size=(count, axes))
        jump[random.uniform(size=count) < 0.5] = np.nan
        policy = self.policy()
        return self.pool.episode(chosen, lambda seen: policy(seen) + sizes * random.normal(size=(count, axes)),
                                 self.recipe.moves, jump)

    def inputs(self, seen: Episode, captures: int) -> list[AnyArray]:
        """The network's inputs after so many captures: the latest images, where there are any, and the history."""
        poses = seen.poses[:, :captures]
        if not self.pool.images:
            return [self.format.inputs(poses, seen.values[:, :captures])]
        frames = np.zeros((len(poses), self.recipe.frames, *self.pool.shape), np.uint8)
        latest = seen.values[:, max(0, captures - self.recipe.frames):captures]
        frames[:, self.recipe.frames - latest.shape[1]:] = latest
        return [frames, self.format.inputs(poses, np.empty((*poses.shape[:2], 0), np.float32))]

    def policy(self) -> Callable[[Episode], Float64Array]:
        """The policy as agents run it, with probes."""

        def moves(seen: Episode) -> Float64Array:
            with torch.no_grad():
                parts = [torch.from_numpy(part).to(self.device) for part in self.inputs(seen, seen.poses.shape[1])]
                output: Float64Array = self.net(*parts).double().cpu().numpy()
            return np.clip(output, -self.recipe.largest_move, self.recipe.largest_move)

        return probed(moves, *self.probes, self.format.score)

    def _pass(self, inputs: list[torch.Tensor], residuals: torch.Tensor, optimizer: torch.optim.Optimizer,
              number: int) -> float:
        """Trains on the captures `epochs` times; returns the mean loss."""
        recipe = self.recipe
        seen = torch.from_numpy(self.pool.observable.astype(np.float32)).to(self.device)
        random = np.random.default_rng([recipe.seed, 2, number])
        batches = max(1, len(residuals) // recipe.batch)
        total, count = 0.0, recipe.epochs * batches
        for epoch in range(recipe.epochs):
            order = random.permutation(len(residuals))
            for k in range(batches):
                share = (number + (epoch * batches + k) / count) / recipe.passes
                for group in optimizer.param_groups:  # cosine decay from the first rate to the last
                    group["lr"] = recipe.last_rate + (recipe.rate - recipe.last_rate) * 0.5 * (1 + math.cos(math.pi * share))
                chosen = torch.from_numpy(order[k * recipe.batch:(k + 1) * recipe.batch])
                goal = residuals[chosen].to(self.device)
                error = self.net(*(part[chosen].to(self.device) for part in inputs)) - goal
                scaled = seen * error / (recipe.least + RELATIVE * goal.abs())
                loss = torch.nn.functional.huber_loss(scaled, torch.zeros_like(scaled))
                optimizer.zero_grad()
                loss.backward()
                optimizer.step()
                total += loss.item()
        return total / count

    def tuning(self) -> Float64Array:
        """Noise-free scores at the recommended pose of tuning instances, shape (instances, tuning_steps + 1)."""
        recipe = self.recipe
        pool = Pool(recipe.scene, recipe.noise_level, TUNING_INSTANCES, recipe.columns, "tuning", self.threads,
                    noise_parameters=noise_parameters(recipe))
        return tuning_scores(pool, self.policy(), recipe.tuning_steps)

    def _save(self, done: int, optimizer: torch.optim.Optimizer) -> None:
        self.trained_on = trained_on(self.trained_on, self.threads, self.device, "cpu")
        form = self.format
        state = {"net": self.net.state_dict(), "done": done, "curve": self.curve, "seconds": self.seconds,
                 "trained_on": self.trained_on, "optimizer": optimizer.state_dict(), "probes": self.probes[0].tolist(),
                 "until": self.probes[1],
                 "readings": [form.mean.tolist(), form.deviation.tolist(), form.fine.tolist()]}
        self.folder.keep("checkpoint.pt", lambda out: torch.save(state, out))
        self.folder.keep_text("curve.csv", "pass,loss\n" + "".join(f"{row[0]},{row[1]:.6f}\n" for row in self.curve))

    def load(self, optimizer: torch.optim.Optimizer | None = None) -> int:
        """Loads the checkpoint, if there is one; returns the number of passes that are done."""
        path = self.folder / "checkpoint.pt"
        if not path.is_file():
            return 0
        with reading(path):
            state: dict[str, Any] = torch.load(path, weights_only=True, map_location=self.device)
            self.net.load_state_dict(state["net"])
            self.curve, self.seconds, self.trained_on = state["curve"], state["seconds"], state["trained_on"]
            self.probes = np.array(state["probes"]).reshape(-1, self.pool.axes), state["until"]
            self.format.mean, self.format.deviation, self.format.fine = map(np.array, state["readings"])
            if optimizer:
                optimizer.load_state_dict(state["optimizer"])
            done: int = state["done"]
        self.log(f"resuming after pass {done}")
        return done
