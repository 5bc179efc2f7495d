"""Random local search: steps away from the best pose, longer after a success, shorter after a failure."""
import random

from relign_bench.plugin import Optimizer, parameter, serve


class MyPlugin(Optimizer):
    id = "my_plugin"
    observes = ("merit", "start", "box")
    presets = {"my_plugin-wide": {"first_stride": 0.3}}

    first_stride = parameter(
        0.1, minimum=0.001, maximum=0.5, unit="share of the travel",
        description="Standard deviation of the first moves, per axis",
    )

    def run(self, trial):
        rng = random.Random(trial.seed)  # same seed, same trial
        best = trial.first  # step 0: the capture at the start pose
        stride = self.first_stride
        while stride > 1e-4:  # finer moves are below the stage's resolution: finished
            candidate = [coordinate + stride * rng.gauss(0, 1) for coordinate in best.pose]
            observation = trial.step(trial.box.clamp(candidate))  # one move + one capture
            if observation is None:  # budget spent: not an error
                return
            if observation.merit < best.merit:
                best = observation
                trial.recommend(best.pose)  # the final pose, if the trial ended now
                stride *= 1.5
            else:
                stride *= 0.9  # balanced when one move in five is a success


if __name__ == "__main__":
    serve(MyPlugin)
