"""Many instances of one scene, moved and captured together on all cores; environments and training are built on it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _cuda, _native
from ._errors import require_integer, require_seeds

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from ._typing import BoolArray, Float32Array, Float64Array, Parameters, Plugin, Slots


class Batch:
    """`slots` instances, each with a stage of its own.

    Results do not depend on `threads`. Lists of slots name each slot at most once. Poses are in shares of the travel, 0 to
    1 on every axis, with shape (n, axes) for n slots. Images are in the scene's units.

    Args:
        slots: How many instances are held at once.
        scene: Id, preset or path of a scene, or an object as in a suite: {"use": ..., "parameters": {...}}.
        noise_level: A noise level, likewise.
        clipping: "soft" stops every axis at its own limit, "hard" stops the whole move at the first limit.
        suite_seed: Seed of the instances, as in a suite.
        size: Columns of the sensor, for scenes whose sensor can be chosen; None keeps the scene's own.
        scene_parameters: Parameters of the scene.
        noise_level_parameters: Parameters of the noise level.
        threads: Threads that render; None uses all cores.
        device: "cuda" renders on the first NVIDIA GPU. Images are then PyTorch tensors in its memory: `frames`, and those
            that `capture_at` returns. Their values, and all others, have the bits of "cpu"; with
            transport "ghost" images have its distribution.

    Attributes:
        slots: Number of slots.
        axes: Number of axes of the stage.
        threads: Number of threads.
        description: The scene's description: axes, nominal_pose, image, elements.
        nominal_pose: Nominal pose, shape (axes,).
        white: Value of a white pixel, in the scene's units.
        has_ground_truth: Whether the scene offers noise-free errors.
        reference: Noise-free image of the perfect lens at the nominal pose, shape (height, width).
        frames: The latest captures, shape (slots, height, width): a read-only view of the compiled module's memory, or
            the tensor that it writes to. Later captures change it.
        device: "cpu" or "cuda".

    Raises:
        ValueError: A name, parameter or size is not valid; or device "cuda" cannot be used: the message has the reason,
            as `relign-bench doctor`.
    """

    def __init__(self, slots: int, scene: Plugin = "relign_od", noise_level: Plugin = "rho0.25", clipping: str = "soft",
                 suite_seed: int = 1, size: int | None = None, scene_parameters: Parameters | None = None,
                 noise_level_parameters: Parameters | None = None, threads: int | None = None,
                 device: str = "cpu") -> None:
        if device == "cuda":
            _cuda.find_compiler()
        scene, scene_parameters = _native.chosen_plugin("scene", scene, scene_parameters)
        noise_level, noise_level_parameters = _native.chosen_plugin("noise level", noise_level, noise_level_parameters)
        self._core = _native.make_batch(
            scene, _native.sized_parameters(scene, scene_parameters, size), noise_level, noise_level_parameters,
            clipping, require_integer(suite_seed, "suite_seed", 0), require_integer(slots, "slots", 1, 2**31 - 1),
            _native.chosen_threads(threads), device)
        self.device = device
        self.slots, self.axes, self.threads = self._core.slots, self._core.axes, self._core.threads
        self.description: dict[str, Any] = json.loads(self._core.facts)
        self.nominal_pose: Float64Array = np.array(self._core.nominal_pose)
        self.white = self._core.white
        self.has_ground_truth = self._core.has_ground_truth
        self.reference: Float32Array = np.empty((self._core.height, self._core.width), np.float32)
        self._core.read_reference(self.reference)
        self.frames: Float32Array
        if device == "cuda":
            self.frames = self._images(self.slots)
            self._core.set_frames(self.frames.data_ptr())  # type: ignore[attr-defined]
        else:
            self.frames = np.asarray(self._core)

    def _images(self, count: int) -> Any:
        return _cuda.images(count, self.reference.shape)

    def reset(self, slots: Slots, numbers: Sequence[int], instances: str = "training") -> None:
        """Mounts another instance in each of these slots, at its start pose, and captures it.

        Args:
            slots: The slots.
            numbers: The number of each slot's instance.
            instances: Family of the instances: "training", "tuning" or "benchmark".

        Raises:
            ValueError: A number is not a non-negative integer below 2**63, or the family is unknown.
        """
        self._core.reset(list(slots), instances, [require_integer(number, "instance", 0) for number in numbers])

    def move_by(self, slots: Slots, moves: npt.ArrayLike) -> None:
        """Moves the stages by commanded moves, shape (n, axes), and captures each slot once."""
        self._core.move_by(list(slots), np.ascontiguousarray(moves, np.float64))

    def capture_at(self, slots: Slots, true_poses: npt.ArrayLike, seeds: Sequence[int] | npt.NDArray[np.integer[Any]],
                   ) -> Float32Array:
        """Captures at given true poses; the stages do not move.

        Args:
            slots: The slots.
            true_poses: True poses in [0, 1], shape (n, axes).
            seeds: Frame seeds, which decide the noise.

        Returns:
            Images, shape (n, height, width).

        Raises:
            ValueError: A seed is not an integer from 0 to 2**64 - 1, or another argument is not valid.
        """
        poses, numbers = np.ascontiguousarray(true_poses, np.float64), require_seeds(seeds)
        if self.device == "cuda":
            images: Float32Array = self._images(len(slots))
            self._core.capture_into(list(slots), poses, numbers, images.data_ptr())  # type: ignore[attr-defined]
            return images
        frames = np.empty((len(slots), *self.reference.shape), np.float32)
        self._core.capture_at(list(slots), poses, numbers, frames)
        return frames

    def render_at(self, slots: Slots, true_poses: npt.ArrayLike) -> Float32Array:
        """Noise-free images at given true poses, an array of shape (n, height, width); the stages do not move.

        Raises:
            ValueError: The scene does not render noise-free images.
        """
        frames = np.empty((len(slots), *self.reference.shape), np.float32)
        self._core.render_at(list(slots), np.ascontiguousarray(true_poses, np.float64), frames)
        return frames

    def derivatives_at(self, slots: Slots, true_poses: npt.ArrayLike, seeds: Sequence[int] | npt.NDArray[np.integer[Any]],
                       samples: int = 64) -> tuple[Float32Array, Float32Array]:
        """Images without a sensor's noise at given true poses, and their derivatives by the pose; the stages do not move.

        Args:
            slots: The slots.
            true_poses: True poses in [0, 1], shape (n, axes).
            seeds: Seeds of the rays; other seeds give independent images.
            samples: Rays per pixel, from 1 to a million.

        Returns:
            Images, shape (n, height, width), and derivatives, shape (n, axes, height, width), per whole travel of the axis,
            from the same rays: what is left out of them is in docs/derivatives.md. With device "cuda" too they are
            computed on the CPU and are arrays.

        Raises:
            ValueError: The scene has no derivatives, or an argument is not valid.
        """
        both = np.empty((len(slots), self.axes + 1, *self.reference.shape), np.float32)
        self._core.render_slopes_at(list(slots), np.ascontiguousarray(true_poses, np.float64), require_seeds(seeds),
                                    require_integer(samples, "samples", 1, 1_000_000), both)
        # JAX takes no strided arrays by DLPack.
        return np.ascontiguousarray(both[:, 0]), np.ascontiguousarray(both[:, 1:])

    def fields_at(self, slots: Slots, true_poses: npt.ArrayLike, lp_per_mm: float) -> Float64Array:
        """Where each lens images the scene's fields, and how sharply, without noise; the stages do not move.

        Args:
            slots: The slots.
            true_poses: True poses in [0, 1], shape (n, axes).
            lp_per_mm: Spatial frequency of the MTF on the sensor, in line pairs per millimetre.

        Returns:
            Array of shape (n, fields, 4), with fields in the order of `description["fields"]`: x and y of the field's
            image in pixels, NaN where no light arrives, and the tangential and sagittal MTF.

        Raises:
            ValueError: The scene has no fields whose MTF can be computed, or an argument is not valid.
        """
        values = np.empty((len(slots), len(self.description.get("fields", [])), 4))
        self._core.fields_at(list(slots), np.ascontiguousarray(true_poses, np.float64), float(lp_per_mm), values)
        return values

    def true_poses(self, slots: Slots) -> Float64Array:
        """True poses, shape (n, axes)."""
        return self._read(self._core.read_true_poses, slots)

    def commanded_poses(self, slots: Slots) -> Float64Array:
        """Poses by the stages' encoders, shape (n, axes). At the start they equal the true poses."""
        return self._read(self._core.read_commanded_poses, slots)

    def _read(self, fill: Callable[[list[int], Float64Array], None], slots: Slots) -> Float64Array:
        poses = np.empty((len(slots), self.axes))
        fill(list(slots), poses)
        return poses

    def measured_error(self, slots: Slots) -> Float64Array:
        """RMSE of the latest captures against the reference, noise included, shape (n,)."""
        rmse = np.empty(len(slots))
        self._core.read_measured_error(list(slots), rmse)
        return rmse

    def noise_free_mse(self, slots: Slots) -> tuple[Float64Array, Float64Array]:
        """Ground truth: unbiased estimates of the noise-free MSE at the true poses, and their standard errors.

        Returns:
            Two arrays of shape (n,). An estimate may be slightly negative near an optimum.
        """
        mse, error = self._core.noise_free_mse(list(slots))
        return np.array(mse), np.array(error)

    def noise_free_mse_at(self, slots: Slots, true_poses: npt.ArrayLike, steps: Sequence[int],
                          ) -> tuple[Float64Array, Float64Array]:
        """What `noise_free_mse` returned at an earlier step of the same instances.

        Args:
            slots: The slots.
            true_poses: True poses at that step, shape (n, axes).
            steps: Number of moves since the reset.
        """
        mse, error = self._core.noise_free_mse_at(list(slots), np.ascontiguousarray(true_poses, np.float64),
                                                  [require_integer(step, "step", 0, 2**32 - 1) for step in steps])
        return np.array(mse), np.array(error)

    def optima(self, slots: Slots) -> list[tuple[Float64Array, float] | None]:
        """Each instance's optimum: (true pose, noise-free MSE), or None where the scene does not search for it."""
        return [None if found is None else (np.array(found[0]), found[1]) for found in self._core.optima(list(slots))]

    def limits(self, slots: Slots) -> BoolArray:
        """Which axes met a limit during the latest move, shape (n, axes)."""
        met = np.empty((len(slots), self.axes), np.uint8)
        self._core.read_limits(list(slots), met)
        return met.astype(bool)

    def instance(self, slot: int) -> dict[str, Any]:
        """The instance in a slot, with its perturbations.

        Returns:
            number, seed, start (true pose, shape (axes,)), distortion (true move = distortion @ commanded move, shape
            (axes, axes)), elements (offsets by element: shift_mm, tilt_deg), cure_shift (shape (axes,), or empty) and
            stage (errors of the stage in shares of the travel: backlash, repeatability, encoder_step, drift,
            drift_seconds; empty for a linear stage).
        """
        drawn = self._core.instance(slot)
        drawn["start"], drawn["cure_shift"] = np.array(drawn["start"]), np.array(drawn["cure_shift"])
        drawn["distortion"] = np.array(drawn["distortion"]).reshape(self.axes, self.axes)
        drawn["elements"] = json.loads(drawn["elements"])
        return drawn
