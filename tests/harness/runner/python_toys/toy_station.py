"""A simulated station with a distorted stage and a hidden start: ../toy_station in Python."""

import os

from philox import Random
from relign_bench.plugin import Moved, Station, parameter, serve
from toy_scene import HEIGHT, WIDTH, spot


class ToyStation(Station):
    reproducible = "this_cpu"
    id = "toy-station"
    dies_in_trial = parameter(0, minimum=0, description="The process dies in its trial of this number; 0 for none")
    trials = 0

    def describe(self):
        axes = [{"name": name, "unit": "mm", "lower": -1, "upper": 1} for name in "xy"]
        return {"name": "toy station", "axes": axes, "image": {"width": WIDTH, "height": HEIGHT, "white": 1}}

    def reference(self):
        return spot(0.5, 0.5)

    def begin(self, seed):
        random = Random(seed)
        self.place = [random.uniform(), random.uniform()]
        self.trials += 1
        self.moves = 0

    def move_by(self, delta):
        self.moves += 1
        if self.trials == self.dies_in_trial and self.moves == 2:
            print("process", os.getpid(), "lost its reference")
            os._exit(9)
        moved, limits = [], []
        for axis, share in enumerate(delta):
            wanted = self.place[axis] + share
            reached = min(1.0, max(0.0, wanted))
            limits.append(-1 if wanted < 0 else 1 if wanted > 1 else 0)
            moved.append(share if reached == wanted else reached - self.place[axis])
            self.place[axis] = reached
        return Moved(moved, 0.25, limits)

    def capture(self):
        x, y = self.place
        return spot(x + 0.05 * y, y - 0.05 * x), 0.5


if __name__ == "__main__":
    serve(ToyStation)
