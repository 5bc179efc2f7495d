"""What one does at the bench: bring the spots together, turn fringes away by their phase, find the place by moving the beam
to both sides, repeat.

It knows the distances and the focal length of the design, but no zero error, no place and no radius of the beams.
"""
import math
import random

from interferometer import COLUMNS, FOCAL, FRAMES, PITCH_MM, SIDE, TO_CAMERA, TO_M2, TURNS
from optics import WAVE_NUMBER, need_numpy, np

from relign_bench.plugin import Optimizer, parameter, serve

M1, M2, LENS = (0, 1), (2, 3), 4  # axes
WINDOW_MM = 0.6  # standard deviation of the weight within which the light's spread is measured: less noise of dark pixels
LEAST = 0.05  # share of the light that must interfere for fringes to be measured
ENOUGH = 0.5  # for beams that need not be brought upon each other first
SEEN = 0.1  # share of the brightest pixel by which the light changes where a beam moves


class Fringes:
    """Of an image: what the frames tell of the two beams, in mm and rad."""

    def __init__(self, image):
        if np.shape(image) != (COLUMNS * SIDE + 1, COLUMNS * SIDE):
            raise ValueError(f"expected the image of the scene 'interferometer', {COLUMNS * SIDE + 1} rows of {COLUMNS * SIDE} "
                             f"pixels, found one of shape {np.shape(image)}")
        frames = np.asarray(image[:-1], dtype=float)
        frames = frames.reshape(COLUMNS, SIDE, COLUMNS, SIDE).swapaxes(1, 2).reshape(FRAMES, SIDE, SIDE)
        self.light = frames.mean(axis=0)
        self.wave = np.tensordot(np.exp(2j * math.pi * np.arange(FRAMES) / FRAMES), frames, 1) / FRAMES
        places = PITCH_MM * (np.arange(SIDE) - 0.5 * (SIDE - 1))
        self.x, self.y = np.meshgrid(places, places)

    def spread(self):
        """Variance of the light along x and y in mm^2, which grows with the square of the distance of the beams."""
        x = y = 0.0
        for _ in range(4):  # the window follows the light
            light = self.light * np.exp(-((self.x - x) ** 2 + (self.y - y) ** 2) / (2 * WINDOW_MM**2))
            total = max(light.sum(), 1e-9)
            x, y = (light * self.x).sum() / total, (light * self.y).sum() / total
        seen = [(light * (u - middle) ** 2).sum() / total for u, middle in ((self.x, x), (self.y, y))]
        return [float(1 / max(1 / max(v, 1e-9) - 1 / WINDOW_MM**2, 1e-9)) for v in seen]  # of a Gaussian without a window

    def weight(self):
        """Of each pixel by its fringes, 0 where there is noise only; and the share of the light that interferes."""
        strength = np.abs(self.wave) ** 2
        weight = np.where(strength > 20 * np.median(strength[[0, -1]]), strength, 0.0)
        return weight, 2 * np.sqrt(weight).sum() / max(self.light.sum(), 1e-9)

    def phase(self):
        """Angle of the first beam minus that of the second along x and y, and difference of their curvatures; or None."""
        weight, share = self.weight()
        if share < LEAST:
            return None
        total = weight.sum()
        x, y = (u - (weight * u).sum() / total for u in (self.x, self.y))
        steps = [self.wave[:, 1:] * self.wave[:, :-1].conj(), self.wave[1:] * self.wave[:-1].conj()]
        slopes = [np.angle(step.sum()) / PITCH_MM for step in steps]
        bends = (steps[0][:, 1:] * steps[0][:, :-1].conj()).sum() + (steps[1][1:] * steps[1][:-1].conj()).sum()
        bend = np.angle(bends) / PITCH_MM**2
        # What is left is a small phase: fitted by least squares, twice.
        for _ in range(2):
            left = self.wave * np.exp(-1j * (slopes[0] * x + slopes[1] * y + 0.5 * bend * (x * x + y * y)))
            left *= np.exp(-1j * np.angle((weight * left).sum()))
            terms = np.stack([np.ones_like(x), x, y, 0.5 * (x * x + y * y)]).reshape(4, -1) * np.sqrt(weight).ravel()
            found = np.linalg.lstsq(terms.T, (np.sqrt(weight) * np.angle(left)).ravel(), rcond=None)[0]
            slopes, bend = [slopes[0] + found[1], slopes[1] + found[2]], bend + found[3]
        return [slope / WAVE_NUMBER for slope in slopes], bend / WAVE_NUMBER


class Bench(Optimizer):
    id = "flatten-then-shift"
    observes = ("images", "box")

    rounds = parameter(6, minimum=1, maximum=100, description="How often the place is measured")
    lever_mm = parameter(0.25, minimum=0.01, maximum=2.0, unit="mm", description="Move of the beam to either side")

    def run(self, trial):
        need_numpy()
        self.trial, self.random = trial, random.Random(trial.seed)
        self.travel = [axis["travel"] for axis in trial.axes]
        self.pose, self.fringes = list(trial.first.pose), Fringes(trial.first.image)
        for _ in range(self.rounds):
            if not (self.meet() and self.flatten() and self.centre()):
                return
        self.flatten()

    def go(self, shift_mm=(0.0, 0.0), turn_rad=(0.0, 0.0), along_mm=0.0):
        """Moves the beam of the mirrors at the camera, and the lens; False: budget spent."""
        pose = list(self.pose)
        for shift, turn, gain, first, second in zip(shift_mm, turn_rad, TURNS, M1, M2):
            share = 1000 / gain / self.travel[first]  # per rad, the same for both mirrors
            pose[first] += share * (shift - TO_CAMERA * turn) / TO_M2
            pose = self.trial.box.clamp(pose)  # at the end of the travel the angle counts for more than the place
            pose[second] += share * turn - (pose[first] - self.pose[first])
        pose[LENS] += along_mm / self.travel[LENS]
        return self.look(pose)

    def look(self, pose):
        seen = self.trial.step(self.trial.box.clamp(pose))
        if seen is None:
            return False
        self.pose, self.fringes = list(seen.pose), Fringes(seen.image)
        return True

    def flatten(self):
        """Makes the phase between the beams flat."""
        phase = self.fringes.phase()
        if phase is None:
            return True
        angle, curvature = phase
        if not self.go(turn_rad=angle, along_mm=curvature * FOCAL**2):
            return False
        self.trial.recommend(self.pose)
        return True

    def meet(self):
        """Brings two separate spots together: what changes by a small move is the light of the beam that moved."""
        move, box = (self.lever_mm, self.lever_mm), self.trial.box
        for _ in range(5):
            before = self.fringes.light
            if self.fringes.weight()[1] > ENOUGH:
                break
            if not self.go(shift_mm=move):
                return False
            now = self.fringes
            change = np.abs(now.light - before)
            if change.max() < SEEN * now.light.max():  # no beam that moves: it is beside the camera
                if not self.look([low + self.random.random() * (high - low) for low, high in zip(box.lower, box.upper)]):
                    return False
                continue
            change[change < 0.3 * change.max()] = 0.0
            moved = [(change * u).sum() / change.sum() + self.lever_mm / 2 for u in (now.x, now.y)]
            total = max(now.light.sum(), 1e-9)
            both = [(now.light * u).sum() / total for u in (now.x, now.y)]  # the middle of beams of equal power
            if not self.go(shift_mm=[2 * (b - m) for b, m in zip(both, moved)]):
                return False
        return True

    def centre(self):
        """Brings the beam upon the other: the light is as broad at equal distances to both sides."""
        lever = self.lever_mm
        spreads = []
        for move in (lever, -2 * lever):
            if not self.go(shift_mm=(move, move)):
                return False
            spreads.append(self.fringes.spread())
        distances = [(high - low) / lever for high, low in zip(*spreads)]
        return self.go(shift_mm=[lever - max(-lever, min(lever, distance)) for distance in distances])


if __name__ == "__main__":
    serve(Bench)
