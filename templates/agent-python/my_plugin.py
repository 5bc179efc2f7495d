"""Observes images only: tries each axis in turn and stays where the image is sharper."""
from relign_bench.plugin import Agent, parameter, serve


def sharpness(image):
    """Mean squared difference of neighbouring pixels: large when edges are sharp. Works without numpy."""
    rows = [row.tolist() for row in image]
    across = sum((b - a) ** 2 for row in rows for a, b in zip(row, row[1:]))
    down = sum((b - a) ** 2 for row, below in zip(rows, rows[1:]) for a, b in zip(row, below))
    return (across + down) / (len(rows) * len(rows[0]))


class Policy:
    """From an image to a move. Replace it by a trained network."""

    def __init__(self, axes, first_move):
        self.axes = axes
        self.stride = first_move
        self.best = -1.0
        self.sign = 1
        self.axis = 0
        self.going_back = False

    def decide(self, image):
        """The next move, relative to the current pose, from the image there."""
        value = sharpness(image)
        better = value > self.best
        if better:
            self.best = value
        move = [0.0] * self.axes
        if not better and not self.going_back:
            self.going_back = True  # worse: undo the move
            move[self.axis] = -self.sign * self.stride
            return move
        self.going_back = False
        if not better:
            self.next_direction()
        move[self.axis] = self.sign * self.stride
        return move

    def finished(self):
        return self.stride < 1e-4

    def next_direction(self):
        self.sign = -self.sign
        if self.sign < 0:  # the same axis in the other direction
            return
        self.axis = (self.axis + 1) % self.axes
        if self.axis == 0:
            self.stride /= 2


class MyPlugin(Agent):
    id = "my_plugin"
    observes = ("images",)

    first_move = parameter(
        0.1, minimum=0.001, maximum=0.5, unit="share of the travel", description="Length of the first moves"
    )

    def run(self, trial):
        policy = Policy(len(trial.axes), min(self.first_move, trial.largest_move))
        observation = trial.first  # step 0: the capture at the start pose
        while observation is not None and not policy.finished():
            observation = trial.move(policy.decide(observation.image))
        # Without trial.recommend(pose), the final pose of an agent is the current one.


if __name__ == "__main__":
    serve(MyPlugin)
