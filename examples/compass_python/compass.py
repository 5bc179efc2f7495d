"""Compass search: try one stride along every axis; when none helps, halve the stride."""
from relign_bench.plugin import Optimizer, parameter, serve


class Compass(Optimizer):
    first_stride = parameter(0.1, minimum=0.001, maximum=0.5, unit="share of the travel")

    def run(self, trial):
        best, stride = trial.first, self.first_stride
        while stride > 1e-4:  # finer moves are below the stage's resolution: finished
            improved = False
            for axis in range(len(best.pose)):
                for sign in (+1, -1):
                    candidate = list(best.pose)
                    candidate[axis] += sign * stride
                    observation = trial.step(trial.box.clamp(candidate))
                    if observation is None:  # budget spent
                        return
                    if observation.merit < best.merit:  # observation.image: 2-D numpy array
                        best, improved = observation, True
                        trial.recommend(best.pose)
                        break
            if not improved:
                stride /= 2


if __name__ == "__main__":
    serve(Compass)
