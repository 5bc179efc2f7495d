"""A bright spot on 12 x 8 pixels that follows the pose, with noise: ../toy_scene in Python, bit for bit."""

import array
import math

from philox import Random
from relign_bench.plugin import Assembly, Scene, parameter, serve

WIDTH, HEIGHT = 12, 8


def spot(x, y):
    values = array.array("f")
    for row in range(HEIGHT):
        for column in range(WIDTH):
            dx, dy = (column + 0.5) / WIDTH - x, (row + 0.5) / HEIGHT - y
            values.append(math.exp(-20 * (dx * dx + dy * dy)))
    return values


class ToyAssembly(Assembly):
    def __init__(self, scene, shift):
        self.scene = scene
        self.shift = shift

    def capture(self, true_pose, frame_seed):
        if true_pose[0] > self.scene.broken_above:
            raise RuntimeError("the camera fell off")
        random = Random(frame_seed)
        image = spot(true_pose[0] + self.shift, true_pose[1])
        noise = array.array("f", (0.01 * random.normal() for _ in image))
        return array.array("f", (value + wave for value, wave in zip(image, noise)))

    def noise_free_mse(self, true_pose, seed):
        total = 0.0
        for value, wanted in zip(spot(true_pose[0] + self.shift, true_pose[1]), self.scene.wanted):
            total += (value - wanted) * (value - wanted)
        return total / (WIDTH * HEIGHT) + 1e-9 * Random(seed).normal(), 1e-9


class ToyScene(Scene):
    id = "toy-scene"
    broken_above = parameter(2.0, description="Captures fail where the first coordinate is larger.")

    def __init__(self):
        self.wanted = spot(0.5, 0.5)

    def describe(self):
        axes = [{"name": name, "unit": "mm", "lower": -1, "upper": 1} for name in "xy"]
        return {
            "name": "toy",
            "summary": "A spot.",
            "nominal_pose": [0.5, 0.5],
            "axes": axes,
            "image": {"width": WIDTH, "height": HEIGHT, "white": 1},
            "elements": ["L1"],
            "files": [],
        }

    def reference(self):
        return self.wanted

    def mount(self, offsets):
        if set(offsets) - {"L1"}:
            raise ValueError("this lens has no elements but L1, found %s" % sorted(offsets))
        return ToyAssembly(self, offsets["L1"]["shift_mm"][0] if offsets else 0.0)


if __name__ == "__main__":
    serve(ToyScene)
