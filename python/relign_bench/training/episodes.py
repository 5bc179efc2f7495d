"""Episodes on a fixed pool of instances, whose optima are kept: data for imitation learning on any scene with a score."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .._score import score_of
from ..batch import Batch
from ..conventions import binned, to_bytes
from .folder import reading

if TYPE_CHECKING:
    from collections.abc import Callable

    from .._typing import AnyArray, Float64Array
    from .folder import RunFolder

    Policy = Callable[["Episode"], Float64Array]
    """From what was observed to moves in shares of the travel, shape (n, axes)."""

SLOTS = 64  # instances that are held at once
PROBED = 128  # instances that probes are chosen on
CANDIDATES = 200  # poses among which probes are chosen
LEAST_SIDE, LARGEST_SIDE = 10, 1024  # of images that agents accept (core/training/policies/side_file.cpp)
LEAST_GAIN = 0.01  # of a probe, as a share of what all candidates together gain


class Episode(NamedTuple):
    """What was observed on n instances, and labels; arrays grow along their second axis.

    Attributes:
        poses: Poses as commanded, which agents observe: beyond a limit of the stage they are not those reached. Shape (n,
            captures, axes).
        images: Bytes, shape (n, captures, rows, columns); of a scene without images (n, captures, 0).
        readings: Shape (n, captures, readings); of a scene without readings (n, captures, 0).
        residuals: Optimum minus true pose, shape (n, captures, axes).
        scores: Noise-free scores, shape (n, captures); NaN where they were not computed.
    """

    poses: Float64Array
    images: AnyArray
    readings: AnyArray
    residuals: Float64Array
    scores: Float64Array


class Pool:
    """A fixed number of instances of one family.

    Args:
        scene: Id, preset or path of a scene that declares a score.
        noise_level: Id, preset or path of a noise level.
        count: Number of instances.
        size: Columns of the images; 0 keeps those of the scene.
        family: "training" or "tuning".
        threads: Threads that capture; None uses all cores.
        first: Number of the first instance.
        parameters: Those of scene and noise level, as keywords of Batch.
        only_readings: Whether images are left out.

    Attributes:
        images: Whether captures have images that are observed.
        shape: Rows and columns of the images; (0,) without images.
        readings: Name and perhaps unit of each reading.
        score: The scene's score.
        reading: Place of the reading that measures it; None: none does.
        resolution: Of the score: smaller differences are not told apart.
        observable: Axes that the scene declares observable, shape (axes,).

    Raises:
        ValueError: The scene declares no score, or its images cannot be binned to the size.
    """

    def __init__(self, scene: str, noise_level: str, count: int, size: int = 0, family: str = "training",
                 threads: int | None = None, first: int = 0, parameters: dict[str, Any] | None = None,
                 only_readings: bool = False) -> None:
        self.batch = Batch(min(SLOTS, count), scene, noise_level, threads=threads, **(parameters or {}))
        self.scene, self.family, self.count, self.first = scene, family, count, first
        description = self.batch.description
        if "score" not in description:
            raise ValueError(f"scene '{scene}' declares no score")
        self.score, self.axes = score_of(description), self.batch.axes
        self.resolution = float(description["score"]["resolution"])
        self.images = "image" in description and not only_readings
        self.readings: list[dict[str, str]] = description.get("readings", [])
        names = [reading["name"] for reading in self.readings]
        measure = description["score"].get("reading")
        self.reading = names.index(measure) if measure in names else None
        self.observable = np.array([axis.get("observable", True) for axis in description["axes"]])
        self._bins = 1
        self.shape: tuple[int, ...] = (0,)
        if self.images:
            height, width = self.reference.shape
            size = size or width
            if width % size or height % (width // size):
                raise ValueError(f"size={size} does not divide images of {width} x {height} pixels of scene '{scene}'")
            self._bins = width // size
            self.shape = (height // self._bins, size)
            if not all(LEAST_SIDE <= side <= LARGEST_SIDE for side in self.shape):
                raise ValueError(f"networks see images of {LEAST_SIDE} to {LARGEST_SIDE} rows and columns; those of scene "
                                 f"'{scene}' would have {self.shape[0]} rows and {size} columns")
        self.optima: Float64Array = np.empty((0, self.axes))

    def numbers(self) -> AnyArray:
        """Numbers of the instances."""
        return np.arange(self.first, self.first + self.count)

    def find_optima(self, folder: RunFolder, log: Callable[[str], object]) -> None:
        """The instances' optima, from optima.npy of the folder where it has them.

        Raises:
            ValueError: The scene does not search for optima, or the file is damaged.
        """
        path = folder / "optima.npy"
        if path.is_file():
            with reading(path):
                self.optima = np.load(path, allow_pickle=False).reshape(-1, self.axes)[:self.count]
        while len(self.optima) < self.count:
            numbers = self.numbers()[len(self.optima):][:self.batch.slots]
            slots = list(range(len(numbers)))
            self.batch.reset(slots, [int(number) for number in numbers], self.family)
            found = [optimum for optimum in self.batch.optima(slots) if optimum is not None]
            if len(found) < len(slots):
                raise ValueError(f"scene '{self.scene}' does not search for optima, which training needs as labels")
            self.optima = np.concatenate([self.optima, [pose for pose, _ in found]])
            content = io.BytesIO()
            np.save(content, self.optima)
            folder.keep("optima.npy", lambda out, content=content: out.write(content.getbuffer()))  # type: ignore[misc]
            log(f"optima of {len(self.optima)} of {self.count} instances")

    @property
    def reference(self) -> AnyArray:
        """The reference image, without the line of readings; shape (height, width)."""
        return self.batch.reference[:-1] if self.readings else self.batch.reference

    def images_of(self, slots: list[int]) -> AnyArray:
        """The latest images as the policy observes them, shape (n, *shape)."""
        if not self.images:
            return np.empty((len(slots), 0), np.uint8)
        frames = self.batch.frames[slots][:, :-1 if self.readings else None]
        return to_bytes(np.ascontiguousarray(binned(frames, self._bins), np.float32), self.batch.white)

    def readings_of(self, frames: AnyArray) -> AnyArray:
        """The readings of captures, shape (n, readings), of frames of shape (n, rows, columns)."""
        return frames[:, -1, :len(self.readings)].copy()

    def mount(self, chosen: AnyArray) -> list[int]:
        """Mounts these of the pool's instances, by place; returns the slots."""
        slots = list(range(len(chosen)))
        self.batch.reset(slots, [int(number) for number in self.numbers()[chosen]], self.family)
        return slots

    def episode(self, chosen: AnyArray, policy: Policy, moves: int, jump: Float64Array | None = None,
                scored: bool = False) -> Episode:
        """Lets a policy move on some of the pool's instances.

        Args:
            chosen: Places of at most SLOTS instances in the pool, shape (n,).
            policy: The policy.
            moves: Number of moves.
            jump: True poses to which the stages go before the first capture, shape (n, axes); NaN stays at the start.
            scored: Whether noise-free scores are computed.
        """
        slots = self.mount(chosen)
        if jump is not None:
            away = np.nan_to_num(jump - self.batch.true_poses(slots))
            self.batch.move_by(slots, away)
        optima = self.optima[chosen] if len(self.optima) else np.full((len(chosen), self.axes), np.nan)
        commanded = self.batch.commanded_poses(slots)
        rows: list[tuple[AnyArray, ...]] = []

        def look() -> Episode:
            scores = self.batch.noise_free_mse(slots)[0] if scored else np.full(len(slots), np.nan)
            rows.append((commanded, self.images_of(slots), self.readings_of(self.batch.frames[slots]),
                         optima - self.batch.true_poses(slots), scores))
            return Episode(*(np.stack(part, 1) for part in zip(*rows)))

        seen = look()
        for _ in range(moves):
            commanded = commanded + policy(seen)
            self.batch.move_by(slots, commanded - self.batch.commanded_poses(slots))
            seen = look()
        return seen

    # ---- probes --------------------------------------------------------------------------------

    def costs(self, readings: AnyArray) -> Float64Array:
        """Measured scores on the scale that the scene declares, linear or logarithmic."""
        if self.batch.description["score"].get("scale") == "log":
            return self.log_costs(readings)
        return np.maximum(np.asarray(readings, np.float64), 0)

    def log_costs(self, scores: AnyArray) -> Float64Array:
        """log(1 + score / resolution), 0 for scores below 0."""
        costs: Float64Array = np.log(1 + np.maximum(np.asarray(scores, np.float64), 0) / self.resolution)
        return costs

    def spread(self, readings: AnyArray) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Mean, deviation and finest difference of readings of shape (n, readings), for HistoryFormat."""
        values = np.asarray(readings, np.float64)
        deviation = values.std(0)
        deviation = np.where(deviation > 0, deviation, 1.0)
        fine = deviation / 1000
        if self.reading is not None:
            fine[self.reading] = self.resolution
        return values.mean(0), deviation, fine

    def choose_probes(self, most: int, random: np.random.Generator) -> tuple[Float64Array, float]:
        """Poses relative to the start that together find a low score on most instances, greedily.

        Args:
            most: Number of probes at most.
            random: The generator of the candidates.

        Returns:
            Probes in their order, shape (n, axes), and the reading below which a start, or a probe, is as good as what half
            of the instances have after all of them.
        """
        assert self.reading is not None
        candidates = random.uniform(-0.5, 0.5, (CANDIDATES, self.axes))
        costs, readings = [], []
        for first in range(0, min(PROBED, self.count), self.batch.slots):
            slots = self.mount(np.arange(first, min(first + self.batch.slots, PROBED, self.count)))
            starts = self.batch.true_poses(slots)
            found = [self.readings_of(self.batch.frames[slots])[:, self.reading]]
            for candidate in candidates:
                poses = np.clip(starts + candidate, 0, 1)
                seeds = random.integers(2**63, size=len(slots))
                found.append(self.readings_of(self.batch.capture_at(slots, poses, seeds))[:, self.reading])
            readings.append(np.array(found, np.float64))
            costs.append(self.costs(readings[-1]))
        cost, reading_of = np.concatenate(costs, 1), np.concatenate(readings, 1)
        lowest = cost[0]
        kept: list[int] = []
        possible = lowest.mean() - cost.min(0).mean()
        while len(kept) < most:
            together = np.minimum(lowest, cost[1:])
            best = int(np.argmin(together.mean(1)))
            if lowest.mean() - together[best].mean() <= LEAST_GAIN * possible:
                break
            lowest = together[best]
            kept.append(best)
        enough = np.median(reading_of[[0, *(1 + place for place in kept)]].min(0))
        return candidates[kept].reshape(-1, self.axes), float(enough)


def probed(policy: Policy, probes: Float64Array, until: float, score: int | None) -> Policy:
    """A policy that visits probes first, on each instance until a reading below `until` was seen."""
    if score is None or not len(probes):
        return policy

    def moves(seen: Episode) -> Float64Array:
        step = seen.poses.shape[1] - 1
        found = policy(seen)
        if step < len(probes):
            dark = seen.readings[:, :, score].min(1).astype(np.float64) >= until
            found[dark] = (seen.poses[:, 0] + probes[step] - seen.poses[:, -1])[dark]
        return found

    return moves


def searching(optima: Float64Array, random: np.random.Generator, moves: int) -> tuple[Float64Array, Policy]:
    """Random searches around optima, with distances that shrink from step to step.

    Args:
        optima: True poses, shape (n, axes).
        random: The generator.
        moves: Number of moves of the search.

    Returns:
        True poses to begin at, shape (n, axes), and the policy.
    """
    count, axes = optima.shape
    first = np.exp(random.uniform(math.log(0.01), math.log(0.5), (count, 1)))
    last = first * np.exp(random.uniform(math.log(0.02), 0, (count, 1)))
    around = np.clip(optima + first * random.normal(size=(count, axes)) / 2, 0, 1)

    def policy(seen: Episode) -> Float64Array:
        step = seen.poses.shape[1] - 1
        size = first * (last / first) ** (step / moves)
        return seen.residuals[:, -1] + size * random.normal(size=(count, axes)) / 2

    return around, policy


def tuning_scores(pool: Pool, policy: Policy, moves: int) -> Float64Array:
    """Noise-free scores at the recommended pose of every instance, after each step.

    The recommendation is the visited pose with the lowest measured score; where no reading measures it, or there are images,
    the current pose.

    Returns:
        Shape (instances, moves + 1).
    """
    found = []
    for first in range(0, pool.count, pool.batch.slots):
        seen = pool.episode(np.arange(first, min(first + pool.batch.slots, pool.count)), policy, moves, scored=True)
        scores = seen.scores
        if pool.reading is not None and not pool.images:
            read = seen.readings[:, :, pool.reading]
            best = [np.argmin(read[:, :step + 1], 1) for step in range(moves + 1)]
            scores = np.stack([scores[np.arange(len(scores)), place] for place in best], 1)
        found.append(pool.score.shown(scores))
    return np.concatenate(found)
