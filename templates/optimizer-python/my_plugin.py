"""Random local search: steps away from the best pose, longer after a success, shorter after a failure."""
import random

from relign_bench.plugin import Optimizer, parameter, serve


class MyPlugin(Optimizer):
    id = "my_plugin"
    knows = ("merit", "start", "box")
    presets = {"my_plugin-wide": {"first_stride": 0.3}}

    first_stride = parameter(
        0.1, minimum=0.001, maximum=0.5, unit="share of the travel",
        description="Standard deviation of the first moves, per axis",
    )

    def run(self, talk):
        chance = random.Random(talk.seed)  # same seed, same trial
        best = talk.first  # step 0: the capture at the start pose
        stride = self.first_stride
        while stride > 1e-4:  # finer moves mean nothing to the stage: finished
            candidate = [coordinate + stride * chance.gauss(0, 1) for coordinate in best.pose]
            seen = talk.step(talk.box.clamp(candidate))  # one move + one capture
            if seen is None:  # budget spent: not an error
                return
            if seen.merit < best.merit:
                best = seen
                talk.recommend(best.pose)  # "I would glue here now"
                stride *= 1.5
            else:
                stride *= 0.9  # in balance when one move in five is a success


if __name__ == "__main__":
    serve(MyPlugin)
