"""The null walker as a process, for measuring the overhead of the harness."""
from relign_bench.plugin import Optimizer, serve


class NullWalker(Optimizer):
    knows = ("merit", "box")

    def run(self, talk):
        pose, place = [0.1] * 5, 0.0
        while talk.step(pose):
            place += 1e-7
            pose[0] = place


if __name__ == "__main__":
    serve(NullWalker)
