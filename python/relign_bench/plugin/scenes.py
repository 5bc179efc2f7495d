"""What authors of scenes derive from. Pixels are a 2-D numpy array, a list of rows of numbers, or float32 values
behind the buffer protocol (bytes, array("f")): height rows of width values, row 0 on top."""

from .base import Plugin


class Scene(Plugin):
    """A simulator: turns (assembly, true pose, frame seed) into an image. One object serves a worker's whole run;
    images and truths are functions of their arguments alone, in every process."""

    kind = "scene"

    def describe(self):
        """A dictionary: name, axes, nominal_pose, image, elements; as relign_scene_interface::describe in plugin.h."""
        raise self._lacks("describe(self)")

    def reference(self):
        """O*: the noise-free image of the perfect lens at the nominal pose. Asked once."""
        raise self._lacks("reference(self)")

    def mount(self, offsets):
        """An Assembly with {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}}; {} is the perfect lens. Raise
        ValueError for an element that there is not."""
        raise self._lacks("mount(self, offsets)")


class Assembly:
    """One lens with its element offsets. `true_pose` is a tuple, 0..1 on every axis of the description; offsets and
    noise may lead beyond."""

    def capture(self, true_pose, frame_seed):
        """Pixels of a noisy capture; equal arguments, equal pixels."""
        raise NotImplementedError("%s has no capture(self, true_pose, frame_seed)" % type(self).__name__)

    def noise_free_mse(self, true_pose, seed):
        """(mse, standard_error): an unbiased estimate against O*, with random numbers of its own. A scene that says
        "truth": False is not asked."""
        raise NotImplementedError("%s has no noise_free_mse(self, true_pose, seed)" % type(self).__name__)

    render_noise_free = None  # optional: render_noise_free(self, true_pose) gives pixels
    # optional: mtf(self, true_pose, lp_per_mm) gives (centre, corner), the lens's geometric MTF as relign_scene_mtf in
    # plugin.h defines it; suites whose spec has "mtf" need it
    mtf = None


class Station(Scene):
    """A scene that owns its stage: a hexapod and a camera, or a simulation of them. It is asked for begin, capture,
    then for move_by, capture at each step. A failure is the trial's outcome; the next one gets a fresh process.
    Its description gets "owns_stage": True and "truth": False."""

    def begin(self, seed):
        """Brings the station to a start pose; equal seeds ask for the same one. Its time does not count."""
        raise self._lacks("begin(self, seed)")

    def move_by(self, delta):
        """One move relative to where the stage is by its own encoders, a tuple of shares of the travel. A limit is no
        failure: stop there and say so. Gives Moved(moved, machine_seconds, limits)."""
        raise self._lacks("move_by(self, delta)")

    def capture(self):
        """(pixels, machine_seconds) of one picture from where the stage is."""
        raise self._lacks("capture(self)")


class Moved:
    """What a station's encoders tell of one move.

    moved            how far each axis came, in shares of the travel
    machine_seconds  measured, settling included
    limits           per axis: -1 met its lower limit, +1 its upper limit, 0 neither; () for none at all
    """

    __slots__ = ("moved", "machine_seconds", "limits")

    def __init__(self, moved, machine_seconds, limits=()):
        self.moved = moved
        self.machine_seconds = machine_seconds
        self.limits = limits

    def __repr__(self):
        return "Moved(moved=%r, machine_seconds=%r, limits=%r)" % (self.moved, self.machine_seconds, self.limits)
