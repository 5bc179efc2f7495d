"""Many lenses of one scene, moved and captured together over all cores: what environments and training stand on."""

import json

import numpy as np

from . import _native


class Batch:
    """`slots` lenses, each on a stage of its own; slot k keeps its last frame in `frames[k]`.

    The numbers that come out do not depend on `threads`. Lists of slots name each slot at most once. Poses are shares
    of the travel, shape (n, axes) for n slots. Raises ValueError for what cannot be, with the words of the program.
    """

    def __init__(self, slots, scene="relign_od", noise_level="rho0.25", clipping="soft", suite_seed=1, size=None,
                 scene_parameters=None, noise_level_parameters=None, threads=None):
        self._core = _native.make_batch(
            scene, _native.sized_parameters(scene, scene_parameters, size), noise_level, noise_level_parameters,
            clipping, int(suite_seed), int(slots), threads or _native.cores())
        self.slots, self.axes, self.threads = self._core.slots, self._core.axes, self._core.threads
        self.description = json.loads(self._core.facts)  # what the scene says of itself
        self.nominal_pose = np.array(self._core.nominal_pose)
        self.white = self._core.white  # display value of a lit pixel
        self.tells_truth = self._core.tells_truth
        self.reference = np.empty((self._core.height, self._core.width), np.float32)
        self._core.read_reference(self.reference)
        # A view of the compiled part's own memory: float32, slots x height x width, always the last captures.
        self.frames = np.asarray(self._core)

    def reset(self, slots, numbers, instances="training"):
        """Another lens in each of these slots, by its number in "training", "tuning" or "benchmark"; frame 0."""
        self._core.reset(list(slots), instances, [int(number) for number in numbers])

    def move_by(self, slots, moves):
        """Commanded moves, shape (n, axes), then a frame each."""
        self._core.move_by(list(slots), np.ascontiguousarray(moves, np.float64))

    def capture_at(self, slots, true_poses, seeds):
        """Frames of the lenses in these slots at true poses in [0, 1]; the stages stay. float32, n x height x width."""
        frames = np.empty((len(slots), *self.reference.shape), np.float32)
        self._core.capture_at(list(slots), np.ascontiguousarray(true_poses, np.float64), list(map(int, seeds)), frames)
        return frames

    def render_at(self, slots, true_poses):
        """The same without noise. Raises ValueError where the scene offers none."""
        frames = np.empty((len(slots), *self.reference.shape), np.float32)
        self._core.render_at(list(slots), np.ascontiguousarray(true_poses, np.float64), frames)
        return frames

    def true_poses(self, slots):
        return np.array(self._core.true_poses(list(slots))).reshape(len(slots), self.axes)

    def commanded_poses(self, slots):
        """What the encoders tell; they count from the true start."""
        return np.array(self._core.commanded_poses(list(slots))).reshape(len(slots), self.axes)

    def measured(self, slots):
        """RMSE of the last frames against the reference, shape (n,)."""
        return np.array(self._core.measured(list(slots)))

    def truths(self, slots):
        """Noise-free MSE at the true poses and their standard errors, both of shape (n,)."""
        mse, error = self._core.truths(list(slots))
        return np.array(mse), np.array(error)

    def optima(self, slots):
        """Per slot (true pose, noise-free MSE) where the lens is best; None where the scene does not look for it."""
        return [None if found is None else (np.array(found[0]), found[1]) for found in self._core.optima(list(slots))]

    def limits(self, slot):
        """Which axes met a limit on the last move: bool, shape (axes,)."""
        low, high = self._core.limits(slot)
        return np.array([bool((low | high) >> axis & 1) for axis in range(self.axes)])

    def instance(self, slot):
        """What was drawn for the lens in a slot: number, seed, start, distortion, elements, cure_shift."""
        drawn = self._core.instance(slot)
        drawn["start"], drawn["cure_shift"] = np.array(drawn["start"]), np.array(drawn["cure_shift"])
        drawn["distortion"] = np.array(drawn["distortion"]).reshape(self.axes, self.axes)
        drawn["elements"] = json.loads(drawn["elements"])
        return drawn
