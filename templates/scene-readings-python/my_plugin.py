"""A synthetic scene of readings: a pinhole on a stage in the focus of a laser, and the loss of a power meter behind it."""
import math
import random

from relign_bench.plugin import Assembly, Scene, parameter, serve, uncertain_values

WAIST_UM = 40.0  # radius of the spot in the focus, where the intensity is 1/e^2
RAYLEIGH_MM = 5.0  # at this distance from the focus the spot has twice the area
TRAVEL = {"x": 50.0, "y": 50.0, "z": 10.0}  # half of the travel: um, um and mm
UNITS = {"x": "um", "y": "um", "z": "mm"}
SPEED_PER_S = {"x": 100.0, "y": 100.0, "z": 10.0}
DARKEST_DB = 60.0  # the power meter's range
# What is uncertain: where the focus is.
QUANTITIES = {"focus_x": ("um", 15.0), "focus_y": ("um", 15.0), "focus_z": ("mm", 2.0)}


def loss_db(true_pose, focus):
    """Of the power that passes a pinhole much smaller than the spot, against the pinhole in the focus."""
    # True pose 0..1 to um and mm, 0 is the middle of the travel.
    x, y, z = ((2 * p - 1) * half - place for p, half, place in zip(true_pose, TRAVEL.values(), focus))
    area = 1 + (z / RAYLEIGH_MM) ** 2  # of the spot, against that in the focus
    share = math.exp(-2 * (x * x + y * y) / (WAIST_UM**2 * area)) / area
    return min(-10 * math.log10(max(share, 1e-30)), DARKEST_DB)


class Pinhole(Assembly):
    """One laser with its focus where it is. Readings are pure functions of their arguments."""

    def __init__(self, focus, noise):
        self.focus = focus
        self.noise = noise

    def capture(self, true_pose, frame_seed):
        """One number per reading of the description. The noise comes from the seed alone."""
        return [loss_db(true_pose, self.focus) + self.noise * random.Random(frame_seed).gauss(0, 1)]

    def render_noise_free(self, true_pose):
        return [loss_db(true_pose, self.focus)]

    def score(self, true_pose, seed):
        """The truth, which methods never see, and its standard error: 0, since this model is exact."""
        return loss_db(true_pose, self.focus), 0.0

    def own_optimum(self, seed):
        """The best pose within the travel, its score and standard error."""
        pose = [min(max(0.5 + 0.5 * place / half, 0.0), 1.0) for place, half in zip(self.focus, TRAVEL.values())]
        return pose, *self.score(pose, seed)


class MyPlugin(Scene):
    id = "my_plugin"
    reproducible = "this_cpu"

    noise = parameter(0.05, minimum=0.0, maximum=10.0, unit="dB", description="Standard deviation of a reading")

    def describe(self):
        return {
            "name": "my_plugin",
            "summary": "A pinhole in the focus of a laser, with a power meter behind it",
            "axes": [{"name": name, "unit": UNITS[name], "lower": -half, "upper": half, "speed_per_s": SPEED_PER_S[name]}
                     for name, half in TRAVEL.items()],
            "nominal_pose": [0.5, 0.5, 0.5],
            "readings": [{"name": "loss", "unit": "dB"}],
            # Lower is better, from 0. Methods see the reading; the score is the same number without noise.
            "score": {"name": "loss", "unit": "dB", "resolution": 0.01, "reading": "loss"},
            "elements": [],
            "uncertain": [{"name": name, "unit": unit, "meaning": "place of the laser's focus",
                           "law": {"law": "normal", "sigma": sigma}} for name, (unit, sigma) in QUANTITIES.items()],
            "machine_time": {"settle_ms": 20, "exposure_ms": 5, "readout_ms": 0},
            "spec": {"score": 0.5},
        }

    def reference(self):
        """The readings of the perfect device at the nominal pose, without noise."""
        return [0.0]

    def mount(self, offsets):
        """Sets up one device. Offsets: {"focus_x": {"value": 3.0}, ...}; {} is the perfect one."""
        values = uncertain_values(offsets, QUANTITIES)
        return Pinhole([values.get(name, 0.0) for name in QUANTITIES], self.noise)


if __name__ == "__main__":
    serve(MyPlugin)
