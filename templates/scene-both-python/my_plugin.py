"""A synthetic scene of image and reading: a pinhole in the focus of a laser, a power meter behind it, a camera on its plate."""
import math
import random

from relign_bench.plugin import Assembly, Scene, parameter, serve, uncertain_values

WAIST_UM = 40.0  # radius of the spot in the focus, where the intensity is 1/e^2
RAYLEIGH_MM = 5.0  # at this distance from the focus the spot has twice the area
TRAVEL = {"x": 50.0, "y": 50.0, "z": 10.0}  # half of the travel: um, um and mm
UNITS = {"x": "um", "y": "um", "z": "mm"}
SPEED_PER_S = {"x": 100.0, "y": 100.0, "z": 10.0}
DARKEST_DB = 60.0  # the power meter's range
WIDTH, HEIGHT, PIXEL_UM = 32, 24, 8.0  # of the camera, which looks at the plate with the pinhole in its middle
# What is uncertain: where the focus is.
QUANTITIES = {"focus_x": ("um", 15.0), "focus_y": ("um", 15.0), "focus_z": ("mm", 2.0)}


def spot(true_pose, focus):
    """Where the pinhole is from the middle of the spot, um, and the area of the spot against that in the focus."""
    # True pose 0..1 to um and mm, 0 is the middle of the travel.
    x, y, z = ((2 * p - 1) * half - place for p, half, place in zip(true_pose, TRAVEL.values(), focus))
    return x, y, 1 + (z / RAYLEIGH_MM) ** 2


def intensity(x, y, area):
    """Of the light at a distance from the middle of the spot, against the brightest in the focus."""
    return math.exp(-2 * (x * x + y * y) / (WAIST_UM**2 * area)) / area


def loss_db(true_pose, focus):
    """Of the power that passes a pinhole much smaller than the spot, against the pinhole in the focus."""
    share = intensity(*spot(true_pose, focus))
    return min(-10 * math.log10(max(share, 1e-30)), DARKEST_DB)


def picture(true_pose, focus):
    """What the camera sees: rows of pixels, 1 is the brightest in the focus."""
    x, y, area = spot(true_pose, focus)
    columns = [x + PIXEL_UM * (k - (WIDTH - 1) / 2) for k in range(WIDTH)]
    rows = [y + PIXEL_UM * (k - (HEIGHT - 1) / 2) for k in range(HEIGHT)]
    return [[intensity(u, v, area) for u in columns] for v in rows]


class Pinhole(Assembly):
    """One laser with its focus where it is. Images and readings are pure functions of their arguments."""

    def __init__(self, focus, noise, pixel_noise):
        self.focus = focus
        self.noise = noise
        self.pixel_noise = pixel_noise

    def capture(self, true_pose, frame_seed):
        """Rows of pixels, and one number per reading of the description. The noise comes from the seed alone."""
        drawn = random.Random(frame_seed)
        loss = loss_db(true_pose, self.focus) + self.noise * drawn.gauss(0, 1)
        rows = [[pixel + self.pixel_noise * drawn.gauss(0, 1) for pixel in row] for row in picture(true_pose, self.focus)]
        return rows, [loss]

    def render_noise_free(self, true_pose):
        return picture(true_pose, self.focus), [loss_db(true_pose, self.focus)]

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
    pixel_noise = parameter(0.02, minimum=0.0, maximum=10.0, description="Standard deviation of a pixel; 1 is white")

    def describe(self):
        return {
            "name": "my_plugin",
            "summary": "A pinhole in the focus of a laser, a power meter behind it and a camera on its plate",
            "axes": [{"name": name, "unit": UNITS[name], "lower": -half, "upper": half, "speed_per_s": SPEED_PER_S[name]}
                     for name, half in TRAVEL.items()],
            "nominal_pose": [0.5, 0.5, 0.5],
            "image": {"width": WIDTH, "height": HEIGHT, "white": 1.0},
            "readings": [{"name": "loss", "unit": "dB"}],
            # Lower is better, from 0. Methods see image and reading; the score is the same number without noise.
            "score": {"name": "loss", "unit": "dB", "resolution": 0.01, "reading": "loss"},
            "elements": [],
            "uncertain": [{"name": name, "unit": unit, "meaning": "place of the laser's focus",
                           "law": {"law": "normal", "sigma": sigma}} for name, (unit, sigma) in QUANTITIES.items()],
            "machine_time": {"settle_ms": 20, "exposure_ms": 5, "readout_ms": 0},
            "spec": {"score": 0.5},
        }

    def reference(self):
        """Image and readings of the perfect device at the nominal pose, without noise."""
        return Pinhole([0.0] * len(QUANTITIES), 0.0, 0.0).render_noise_free([0.5] * len(TRAVEL))

    def mount(self, offsets):
        """Sets up one device. Offsets: {"focus_x": {"value": 3.0}, ...}; {} is the perfect one."""
        values = uncertain_values(offsets, QUANTITIES)
        return Pinhole([values.get(name, 0.0) for name in QUANTITIES], self.noise, self.pixel_noise)


if __name__ == "__main__":
    serve(MyPlugin)
