"""A start anywhere and a shifted element: ../toy_level in Python, bit for bit."""

from philox import Random
from relign_bench.plugin import NoiseLevel, parameter, serve


class ToyLevel(NoiseLevel):
    id = "toy-level"
    width = parameter(0.0, minimum=0, maximum=1, unit="mm")
    presets = {"toy-wild": {"width": 0.1}}

    def draw(self, seed, scene):
        random = Random(seed)
        start = [random.uniform(0.1, 0.9) for _ in scene["axes"]]
        distortion = [[1.0 if i == j else 0.01 if i < j else 0.0 for j in range(len(start))] for i in range(len(start))]
        return {
            "start": start,
            "distortion": distortion,
            "elements": {scene["elements"][0]: {"shift_mm": [self.width * random.normal(), 0, 0]}},
        }


if __name__ == "__main__":
    serve(ToyLevel)
