"""What operators do: steer the beam to its place, then change one quadrupole after the other for its size, and steer again."""
from relign_bench.plugin import Optimizer, parameter, serve

# Axis, and the reading of the place that it moves: CH and x, CV and y.
STEERERS = ((4, "mu_x off the goal"), (2, "mu_y off the goal"))
QUADRUPOLES = (0, 1, 3)
SIZES = ("sigma_x off the goal", "sigma_y off the goal")
PROBE = 0.02  # shares of the travel
FARTHEST = 0.4  # of a correction


class Operator(Optimizer):
    id = "steer-then-focus"
    observes = ("merit", "images", "box")

    stride = parameter(0.08, minimum=0.001, maximum=0.5, unit="travel", description="First stride of a quadrupole")

    def run(self, trial):
        self.trial, self.lowest = trial, trial.first
        self.slopes = {}
        here, stride = self.steer(trial.first), self.stride
        while here:
            before = self.lowest.merit
            for axis in QUADRUPOLES:
                here = here and self.focus(here, axis, stride)
            if here and self.lowest.merit > 0.9 * before:
                stride /= 2

    def look(self, pose):
        """Readings and pose after a move; None: budget spent."""
        seen = self.trial.step(self.trial.box.clamp(pose))
        if seen and seen.merit < self.lowest.merit:
            self.lowest = seen
            self.trial.recommend(seen.pose)
        return seen

    def steer(self, seen):
        """Both steerers at once, since each moves one place only: measure what a small move does, then correct twice."""
        for _ in range(3):
            place = self.places(seen)
            pose = list(seen.pose)
            for axis, reading in STEERERS:
                slope = self.slopes.get(axis)
                wanted = PROBE if slope is None else -place[reading] / slope
                pose[axis] += max(-FARTHEST, min(FARTHEST, wanted))
            after = self.look(pose)
            if after is None:
                return None
            moved = self.places(after)
            for axis, reading in STEERERS:
                made = after.pose[axis] - seen.pose[axis]
                if abs(made) > PROBE / 2 and abs(moved[reading] - place[reading]) > 1:
                    self.slopes[axis] = (moved[reading] - place[reading]) / made
            seen = after
        return seen

    def focus(self, here, axis, stride):
        """The best of three strengths of a quadrupole and of the vertex of the parabola through them, steered again."""
        def size(seen):
            return sum(seen.readings[reading] ** 2 for reading in SIZES)

        tried = [(size(here), 0.0)]
        for step in (-stride, stride):
            pose = list(here.pose)
            pose[axis] += step
            seen = self.look(pose)
            if seen is None:
                return None
            tried.append((size(seen), seen.pose[axis] - here.pose[axis]))
        (middle, _), (low, left), (high, right) = tried
        best = min(tried)[1]
        if left < 0 < right and right * (low - middle) - left * (high - middle) > 0:
            below, above = (low - middle) / left, (high - middle) / right
            bend = (above - below) / (right - left)
            best = max(-2 * stride, min(2 * stride, (bend * left - below) / (2 * bend))) if bend > 0 else best
        pose = list(here.pose)
        pose[axis] += best
        seen = self.look(pose)
        return seen and self.steer(seen)

    @staticmethod
    def places(seen):
        return {reading: seen.readings[reading] for _, reading in STEERERS}


if __name__ == "__main__":
    serve(Operator)
