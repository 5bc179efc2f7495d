"""A synthetic scene: the image of a point source through a lens of two elements, a round spot that is small in focus."""
import array
import math
import random

from relign_bench.plugin import Assembly, Scene, parameter, serve

PIXELS = 64  # a side
PITCH_MM = 0.005  # from pixel to pixel
TRAVEL_MM = {"x": 0.1, "y": 0.1, "z": 0.2}  # half of the travel
NOMINAL_POSE = [0.5, 0.5, 0.5]
SHARP_MM = 0.010  # radius of the spot in focus
BLUR_PER_MM = 0.2  # growth of the radius out of focus
SPOT_PER_DEGREE = 0.02  # mm that the spot moves when an element tilts


def render(true_pose, shift_mm):
    """The noise-free image: rows of pixels, row 0 on top."""
    # True pose 0..1 to mm, 0 is the middle of the travel.
    x, y, z = ((2 * p - 1) * half + shift for p, half, shift in zip(true_pose, TRAVEL_MM.values(), shift_mm))
    radius = math.hypot(SHARP_MM, BLUR_PER_MM * z)
    peak = (SHARP_MM / radius) ** 2  # the same light on a larger spot

    def profile(centre):
        places = [(pixel - 0.5 * (PIXELS - 1)) * PITCH_MM - centre for pixel in range(PIXELS)]
        return [math.exp(-(place**2) / (2 * radius**2)) for place in places]

    across, down = profile(x), profile(y)
    return [array.array("f", [peak * row * column for column in across]) for row in down]


class Spot(Assembly):
    """One lens with its element offsets. Images are pure functions of their arguments, whatever was rendered before."""

    def __init__(self, shift_mm, read_noise):
        self.shift_mm = shift_mm
        self.read_noise = read_noise

    def capture(self, true_pose, frame_seed):
        rng = random.Random(frame_seed)
        return [[p + self.read_noise * rng.gauss(0, 1) for p in row] for row in render(true_pose, self.shift_mm)]

    # This model is exact: the render has no error, and the seed is not used. A scene that samples would multiply the
    # differences of two independent renders to two independent references: their noise then averages out instead of
    # adding to the error, and the standard error measures what is left.
    def noise_free_mse(self, true_pose, seed):
        pairs = zip(render(true_pose, self.shift_mm), render(NOMINAL_POSE, [0, 0, 0]))
        return sum((a - b) ** 2 for row, other in pairs for a, b in zip(row, other)) / PIXELS**2, 0.0

    def render_noise_free(self, true_pose):
        return render(true_pose, self.shift_mm)


class MyPlugin(Scene):
    id = "my_plugin"
    reproducible = "this_cpu"

    read_noise = parameter(
        0.01, minimum=0.0, maximum=1.0, unit="share of the peak",
        description="Standard deviation of the noise of each pixel",
    )

    def describe(self):
        return {
            "name": "my_plugin",
            "summary": "A point source as a round spot",
            "axes": [{"name": name, "unit": "mm", "lower": -half, "upper": half} for name, half in TRAVEL_MM.items()],
            "nominal_pose": NOMINAL_POSE,
            "image": {"width": PIXELS, "height": PIXELS, "white": 1.0},
            "elements": ["L1", "L2"],
        }

    def reference(self):
        """O*: the noise-free image of the perfect lens at the nominal pose."""
        return render(NOMINAL_POSE, [0, 0, 0])

    def mount(self, offsets):
        """Assembles one lens. Offsets: {"L1": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}, ...}; {} is the perfect lens."""
        total = [0.0, 0.0, 0.0]
        for element, offset in offsets.items():
            if element not in ("L1", "L2"):
                raise ValueError(f"unknown element '{element}'; elements: L1, L2")
            rx, ry = offset.get("tilt_deg", [0, 0])
            moves = [SPOT_PER_DEGREE * ry, -SPOT_PER_DEGREE * rx, 0]
            total = [t + shift + move for t, shift, move in zip(total, offset.get("shift_mm", [0, 0, 0]), moves)]
        return Spot(total, self.read_noise)


if __name__ == "__main__":
    serve(MyPlugin)
