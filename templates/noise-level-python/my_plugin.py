"""Starts near the nominal pose, a slightly distorted stage, every element shifted and tilted evenly."""
import random

from relign_bench.plugin import NoiseLevel, parameter, serve


class MyPlugin(NoiseLevel):
    id = "my_plugin"
    presets = {"my_plugin-loose": {"shift_mm": 0.005, "tilt_deg": 2.0}}

    start_range = parameter(
        0.3, minimum=0.0, maximum=0.5, unit="share of the travel",
        description="Starts lie this far from the middle of the travel at most, per axis",
    )
    movement_std = parameter(
        0.01, minimum=0.0, maximum=0.2, description="Standard deviation of every entry that distorts a move"
    )
    shift_mm = parameter(
        0.0005, minimum=0.0, maximum=10.0, unit="mm", description="Largest shift of an element along each axis"
    )
    tilt_deg = parameter(
        0.5, minimum=0.0, maximum=45.0, unit="deg", description="Largest tilt of an element about x and y"
    )

    def draw(self, seed, scene):
        """One instance: a pure function of the seed and of what the scene says of itself."""
        axes = len(scene["axes"])
        return {
            "start": self.start(stream(seed, "start"), axes),
            "distortion": self.distortion(stream(seed, "movement"), axes),
            "elements": {name: self.offsets(stream(seed, "element " + name)) for name in scene.get("elements", [])},
        }

    def start(self, chance, axes):
        """True pose, 0 to 1 along each axis."""
        return [chance.uniform(0.5 - self.start_range, 0.5 + self.start_range) for _ in range(axes)]

    def distortion(self, chance, axes):
        """A commanded move times this matrix is the true move."""
        return [
            [float(row == column) + self.movement_std * chance.gauss(0, 1) for column in range(axes)]
            for row in range(axes)
        ]

    def offsets(self, chance):
        return {
            "shift_mm": [chance.uniform(-self.shift_mm, self.shift_mm) for _ in range(3)],
            "tilt_deg": [chance.uniform(-self.tilt_deg, self.tilt_deg) for _ in range(2)],
        }


def stream(seed, name):
    """Chance of its own for each part: it keeps its values when another part draws more or fewer of them."""
    return random.Random("%d %s" % (seed, name))


if __name__ == "__main__":
    serve(MyPlugin)
