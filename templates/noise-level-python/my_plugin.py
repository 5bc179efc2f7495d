"""Starts near the nominal pose, a slightly distorted stage, every element shifted and tilted evenly."""
import random

from relign_bench.plugin import NoiseLevel, parameter, serve


class MyPlugin(NoiseLevel):
    id = "my_plugin"
    presets = {"my_plugin-loose": {"shift_mm": 0.005, "tilt_deg": 2.0}}

    start_range = parameter(
        0.3, minimum=0.0, maximum=0.5, unit="share of the travel",
        description="Largest distance of a start from the middle of the travel, per axis",
    )
    movement_std = parameter(
        0.01, minimum=0.0, maximum=0.2, description="Standard deviation of each entry of the movement distortion"
    )
    shift_mm = parameter(
        0.0005, minimum=0.0, maximum=10.0, unit="mm", description="Largest shift of an element along each axis"
    )
    tilt_deg = parameter(
        0.5, minimum=0.0, maximum=45.0, unit="deg", description="Largest tilt of an element about x and y"
    )

    def draw(self, seed, scene):
        """The perturbations of one instance: a pure function of the seed and the scene's description."""
        axes = len(scene["axes"])
        return {
            "start": self.start(stream(seed, "start"), axes),
            "distortion": self.distortion(stream(seed, "movement"), axes),
            "elements": {name: self.offsets(stream(seed, "element " + name)) for name in scene.get("elements", [])},
        }

    def start(self, rng, axes):
        """True start pose, 0 to 1 along each axis."""
        return [rng.uniform(0.5 - self.start_range, 0.5 + self.start_range) for _ in range(axes)]

    def distortion(self, rng, axes):
        """The matrix that turns a commanded move into the true move."""
        return [
            [float(row == column) + self.movement_std * rng.gauss(0, 1) for column in range(axes)]
            for row in range(axes)
        ]

    def offsets(self, rng):
        """Offsets of one element."""
        return {
            "shift_mm": [rng.uniform(-self.shift_mm, self.shift_mm) for _ in range(3)],
            "tilt_deg": [rng.uniform(-self.tilt_deg, self.tilt_deg) for _ in range(2)],
        }


def stream(seed, name):
    """A separate stream for each part: its values do not depend on how many others draw."""
    return random.Random(f"{seed} {name}")


if __name__ == "__main__":
    serve(MyPlugin)
