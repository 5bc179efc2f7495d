"""The procedure of the trade: a spiral until there is light, then the peak of a parabola along one axis after the other."""
from relign_bench.plugin import Optimizer, parameter, serve


class Spiral(Optimizer):
    id = "spiral-then-climb"

    pitch = parameter(0.2, minimum=0.001, maximum=1.0, unit="travel", description="Distance of its places")
    light = parameter(3.0, minimum=0.0, maximum=60.0, unit="dB", description="Loss below that of the start that is light")
    stride = parameter(0.04, minimum=0.001, maximum=0.5, unit="travel", description="First stride of the climb")
    least = parameter(0.002, minimum=1e-5, maximum=0.1, unit="travel", description="Last stride of the climb")

    def run(self, trial):
        best = self.first_light(trial)
        stride = self.stride
        while best and stride >= self.least:
            before = best
            for axis in range(len(best.pose)):
                best = self.peak(trial, best, axis, stride)
                if best is None:  # budget spent
                    return
                trial.recommend(best.pose)
            if before.merit - best.merit < 0.1:  # dB
                stride /= 2

    def first_light(self, trial):
        """The first place along a square spiral in x and y where there is light; the darkest part of the travel is flat."""
        first = best = trial.first
        x = y = 0
        dx, dy, side, walked, turns = 1, 0, 1, 0, 0
        while best.merit > first.merit - self.light and side * self.pitch < 2.5:
            x, y = x + dx, y + dy
            walked += 1
            if walked == side:
                dx, dy, walked, turns = -dy, dx, 0, turns + 1
                side += turns % 2 == 0
            pose = list(first.pose)
            pose[0] += x * self.pitch
            pose[1] += y * self.pitch
            if pose != trial.box.clamp(pose):
                continue  # outside the travel
            seen = trial.step(pose)
            if seen is None:
                return None
            if seen.merit < best.merit:
                best = seen
                trial.recommend(best.pose)
        return best

    @staticmethod
    def peak(trial, best, axis, stride):
        """The best of three places along an axis and of the peak of the parabola through them; None: budget spent."""
        def look(step):
            pose = list(best.pose)
            pose[axis] += step
            return trial.step(trial.box.clamp(pose))

        low, high = look(-stride), look(stride)
        if low is None or high is None:
            return None
        seen = [best, low, high]
        bend = low.merit - 2 * best.merit + high.merit
        if bend > 1e-4:  # a level in dB is a parabola near its peak
            step = 0.5 * stride * (low.merit - high.merit) / bend
            seen.append(look(max(-3 * stride, min(3 * stride, step))))
        if seen[-1] is None:
            return None
        return min(seen, key=lambda one: one.merit)


if __name__ == "__main__":
    serve(Spiral)
