"""Imitation learning for any scene with a score: the policy remembers poses and readings, and sees its latest images.

A network learns the displacement to an instance's optimum from what a trajectory has shown so far. Trajectories are random
searches around the optimum and, from the first pass on, what the policy itself does from starts and other poses (DAgger: Ross,
Gordon and Bagnell 2011). Instances are a fixed pool of the family "training", because their optima can take seconds each.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from .._native import chosen_threads
from .devices import check_device
from .episodes import SLOTS, Episode, Pool, probed, searching, tuning_scores
from .folder import RunFolder
from .history import HistoryFormat, HistoryNet
from .logs import check_loggers, opened
from .passes import PassTraining

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
    scene_parameters: str = ""  # of the scene, a JSON object
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


def parameters_of(recipe: Any) -> dict[str, Any]:
    """The parameters of scene and noise level, as Batch takes them.

    Raises:
        ValueError: They are not a JSON object.
    """
    found = {}
    for name, keyword in (("scene_parameters", "scene_parameters"), ("noise_parameters", "noise_level_parameters")):
        text = getattr(recipe, name)
        try:
            found[keyword] = json.loads(text or "{}")
        except ValueError as problem:
            raise ValueError(f"{name}='{text}' is not JSON: {problem}") from None
        if not isinstance(found[keyword], dict):
            raise ValueError(f"{name} must be a JSON object such as {{\"name\": 0.5}}, not {text}")
    return found


class Training(PassTraining):
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

    RECIPE, DATA = Recipe, "captures"
    net: HistoryNet

    def __init__(self, recipe: Recipe, folder: str | os.PathLike[str], threads: int | None = None,
                 log: Callable[[str], object] = print, device: str = "cpu", loggers: Loggers = ()) -> None:
        check_device(device, "cpu")
        check_loggers(loggers)
        self.recipe, self.threads, self.log, self.device, self.loggers = recipe, threads, log, device, loggers
        self.folder = RunFolder(folder, recipe)
        torch.set_num_threads(chosen_threads(threads))
        self.pool = Pool(recipe.scene, recipe.noise_level, recipe.pool, recipe.columns, threads=threads,
                         parameters=parameters_of(recipe))
        measured = self.pool.reading
        self.format = HistoryFormat(self.pool.axes, recipe.last, 0 if measured is None else recipe.best, np.empty(0),
                                    np.empty(0), np.empty(0), measured)
        count = len(self.pool.readings)
        self.format.mean, self.format.deviation, self.format.fine = np.zeros(count), np.ones(count), np.ones(count)
        torch.manual_seed(recipe.seed)
        images = (recipe.frames, *self.pool.shape) if self.pool.images else None
        self.net = HistoryNet(self.format.count, self.pool.axes, recipe.hidden, images)  # type: ignore[arg-type]
        self.net.to(device)
        self.probes: tuple[Float64Array, float] = np.empty((0, self.pool.axes)), 0.0
        self._begin()

    def run(self) -> HistoryNet:
        """Trains to the end; returns the network.

        Raises:
            ValueError: Another process trains in the folder, or the scene does not search for optima.
        """
        optimizer = torch.optim.Adam(self.net.parameters(), lr=self.recipe.rate)
        done = self.load(optimizer)
        if done < self.recipe.passes:
            with self.folder.alone(), opened(self.loggers, self.folder, asdict(self.recipe), done, self.log) as log:
                self.pool.find_optima(self.folder, self.log)
                if not done:
                    self._prepare()
                self._train_passes(done, optimizer, log)
        return self.net

    def _prepare(self) -> None:
        """Chooses probes, and how readings are normalised."""
        recipe, pool = self.recipe, self.pool
        random = np.random.default_rng([recipe.seed, 3])
        if not pool.readings:
            return
        if pool.reading is not None and not pool.images and recipe.probes:
            self.probes = pool.choose_probes(recipe.probes, random)
            self.log(f"{len(self.probes[0])} probes, until {pool.score.name} is below {self.probes[1]:.4g} {pool.score.unit}")
        chosen = np.arange(min(SLOTS, pool.count))
        begin, policy = searching(pool.optima[chosen], random, recipe.moves)
        readings = pool.episode(chosen, policy, recipe.moves, begin).readings.reshape(-1, len(pool.readings))
        self.format.mean, self.format.deviation, self.format.fine = pool.spread(readings)

    def _data(self, number: int) -> tuple[list[torch.Tensor], torch.Tensor]:
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
        history = self.format.inputs(seen.poses[:, :captures], seen.readings[:, :captures])
        if not self.pool.images:
            return [history]
        frames = np.zeros((len(history), self.recipe.frames, *self.pool.shape), np.uint8)
        latest = seen.images[:, max(0, captures - self.recipe.frames):captures]
        frames[:, self.recipe.frames - latest.shape[1]:] = latest
        return [frames, history]

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
                self._set_rate(optimizer, number + (epoch * batches + k) / count)
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
                    parameters=parameters_of(recipe))
        return tuning_scores(pool, self.policy(), recipe.tuning_steps)

    def _state(self) -> dict[str, Any]:
        form = self.format
        return {"probes": self.probes[0].tolist(), "until": self.probes[1],
                "readings": [form.mean.tolist(), form.deviation.tolist(), form.fine.tolist()]}

    def _restore(self, state: dict[str, Any]) -> None:
        self.probes = np.array(state["probes"]).reshape(-1, self.pool.axes), state["until"]
        self.format.mean, self.format.deviation, self.format.fine = map(np.array, state["readings"])
