"""For measurements of the harness: the null walker as a process."""
from relign_bench.plugin import Optimizer, serve


class NullWalker(Optimizer):
    observes = ("merit", "box")

    def run(self, trial):
        pose, place = [0.1] * 5, 0.0
        while trial.step(pose):
            place += 1e-7
            pose[0] = place


if __name__ == "__main__":
    serve(NullWalker)
