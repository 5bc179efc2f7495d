"""What beamline scientists do: centre the mirrors in the beam, steer the beam to the sample, bend by pencil beams, square up.

The benders' step is the interaction matrix of pencil-beam scans: see how the places of the pencils change by each bender, then
solve for the bending that brings them together (Sutter, Alcock and Sawhney, In situ beamline analysis and correction of active
optics, Journal of Synchrotron Radiation 19, issue 6, 2012; the ESRF's BLISS has it as KbFocus). The procedure knows lengths,
angles and lever arms of the design, but no zero, no gain of a bender, and neither figure nor source.
"""
import math

from mirrors import AXES, CAMERA_UM, MIRRORS, MOTIONS, PENCILS_UM, PIVOT_M, READINGS, SLIT_M

from relign_bench.plugin import Optimizer, parameter, serve

NAMES = [name for name, *_ in READINGS]
FLUX, WIDTHS = NAMES.index("flux"), (NAMES.index("width y"), NAMES.index("width x"))
PLACE = {"V": NAMES.index("position y"), "H": NAMES.index("position x")}
PENCILS = {"V": NAMES.index("pencil y1"), "H": NAMES.index("pencil x1")}
HALF_ACCEPTANCE_UM = 150.0  # of a mirror of the design: half its length times the grazing angle
LEAST_PENCILS = 4  # of a mirror, by which its two benders are set
ROLL = len(AXES) - 1


def axis(mirror, motion):
    return list(MIRRORS).index(mirror) * len(MOTIONS) + [name for name, *_ in MOTIONS].index(motion)


class Beamline(Optimizer):
    id = "centre-steer-bend"
    observes = ("images", "box")

    cut_um = parameter(100.0, minimum=10.0, maximum=150.0, unit="um", description="Move of a mirror to either side")
    bend_um = parameter(80.0, minimum=1.0, maximum=200.0, unit="um", description="Move of a bender, for its effect")
    rounds = parameter(3, minimum=1, maximum=20, description="Corrections of the benders")
    roll_mrad = parameter(4.0, minimum=0.1, maximum=8.0, unit="mrad", description="Move of the roll to either side")

    def run(self, trial):
        if len(trial.axes) != len(AXES) or [reading["name"] for reading in trial.readings] != NAMES:
            raise ValueError(f"expected the scene 'mirrors', with {len(AXES)} axes and {len(NAMES)} readings, found "
                             f"{len(trial.axes)} axes and {len(trial.readings)} readings")
        self.trial, self.pose = trial, list(trial.first.pose)
        self.readings = list(trial.first.readings.values())
        # Bends again at the end, since a stage that rolls also moves the rest a little.
        for part in (self.find, self.centre, self.steer, self.measure_benders, self.bend, self.square, self.bend):
            if not part():  # budget spent
                return

    def go(self, **moves):
        """Moves axes, in their units, and reads; False: budget spent."""
        pose = list(self.pose)
        for name, move in moves.items():
            number = [other for other, *_ in AXES].index(name)
            pose[number] += move / (2 * AXES[number][2])
        seen = self.trial.step(self.trial.box.clamp(pose))
        if seen is None:
            return False
        self.pose, self.readings = list(seen.pose), list(seen.readings.values())
        return True

    def pencils(self, mirror):
        """Places of a mirror's pencil beams in um, None of those that miss it."""
        first = PENCILS[mirror]
        return [None if abs(y) >= CAMERA_UM else y for y in self.readings[first:first + len(PENCILS_UM)]]

    def find(self):
        """Moves each mirror along its normal until all pencil beams meet it; those that miss it show how far it is off."""
        sweep = {mirror: iter((1, -2, 3, -4)) for mirror in MIRRORS}  # without any pencil: to both sides, farther and farther
        for _ in range(8):
            moves = {}
            for mirror in MIRRORS:
                met = [y is not None for y in self.pencils(mirror)]
                ends = [(a + b) / 2 for a, b, one, other in zip(PENCILS_UM, PENCILS_UM[1:], met, met[1:]) if one != other]
                if not any(met):
                    moves[f"{mirror}_height"] = next(sweep[mirror], 0) * HALF_ACCEPTANCE_UM
                elif ends:  # of the mirror, in the slit
                    moves[f"{mirror}_height"] = (-1 if met[-1] else 1) * HALF_ACCEPTANCE_UM - ends[0]
            if not moves:
                break
            if not self.go(**moves):
                return False
        return True

    def centre(self):
        """Moves the mirrors to the middle of the beam, at equal distances from which they cut off as much."""
        reach = 0.5e6 * SLIT_M + HALF_ACCEPTANCE_UM  # from the middle, where nothing is left
        for mirror in MIRRORS:
            height, cut = f"{mirror}_height", []
            for move in (self.cut_um, -2 * self.cut_um):
                if not self.go(**{height: move}):
                    return False
                cut.append((self.at(mirror, "height"), self.readings[FLUX]))
            (above, flux_above), (below, flux_below) = cut
            # What is left is proportional to reach - (above - middle) and to reach + (below - middle).
            share = flux_above / max(flux_above + flux_below, 1e-9)
            middle = share * (reach + below) - (1 - share) * (reach - above)
            if not self.go(**{height: middle - below}):
                return False
        return True

    def steer(self):
        """Turns the mirrors until the beam is at the sample: they are at their grazing angles then. Keeps them centred."""
        moves = {}
        for name, mirror in MIRRORS.items():
            turn_rad = -1e-6 * self.readings[PLACE[name]] / (2 * mirror.focus)
            moves[f"{name}_pitch"] = 1e3 * turn_rad
            moves[f"{name}_height"] = 1e6 * PIVOT_M * turn_rad
        return self.go(**moves)

    def measure_benders(self):
        """The interaction matrix of each mirror: how far its pencil beams move by 1 um of each bender."""
        self.effects = {mirror: [] for mirror in MIRRORS}
        for motion in ("up", "down"):
            before = {mirror: (self.pencils(mirror), self.at(mirror, motion)) for mirror in MIRRORS}
            # Away from the nearer end of the travel.
            moves = {f"{mirror}_{motion}": -math.copysign(self.bend_um, at) for mirror, (_, at) in before.items()}
            if not self.go(**moves):
                return False
            for mirror, (places, at) in before.items():
                moved = self.at(mirror, motion) - at
                self.effects[mirror].append([None if None in (a, b) else (b - a) / moved
                                             for a, b in zip(places, self.pencils(mirror))])
        return True

    def at(self, mirror, motion):
        """Of an axis, in its unit, from the middle of what the method may move it by."""
        number = axis(mirror, motion)
        low, high = (end[number] for end in (self.trial.box.lower, self.trial.box.upper))
        return (self.pose[number] - (low + high) / 2) * 2 * AXES[number][2]

    def bend(self):
        """Brings the pencil beams together: twice by all that is measured, then by less and less, which averages its noise."""
        for turn in range(self.rounds):
            moves = {}
            for mirror, effects in self.effects.items():
                seen = [row for row in zip(self.pencils(mirror), *effects) if None not in row]
                if len(seen) < LEAST_PENCILS:
                    continue
                places, up, down = (apart(column) for column in zip(*seen))
                a, b, c = dot(up, up), dot(up, down), dot(down, down)
                share = 1 / (max(turn, 1) * max(a * c - b * b, 1e-12))
                moves[f"{mirror}_up"] = share * (b * dot(down, places) - c * dot(up, places))
                moves[f"{mirror}_down"] = share * (b * dot(up, places) - a * dot(down, places))
            if not self.go(**moves):
                return False
            self.trial.recommend(self.pose)
        return True

    def square(self):
        """Turns the roll to the vertex of a parabola through the squares of the widths at three places."""
        for _ in range(3):
            seen = [(self.pose[ROLL], self.blur())]
            for move in (self.roll_mrad, -2 * self.roll_mrad):
                if not self.go(H_roll=move):
                    return False
                seen.append((self.pose[ROLL], self.blur()))
            best = vertex(seen)
            if not self.go(H_roll=(best - self.pose[ROLL]) * 2 * AXES[ROLL][2]):
                return False
            self.trial.recommend(self.pose)
            if min(place for place, _ in seen) <= best <= max(place for place, _ in seen):
                break
        return True

    def blur(self):
        return sum(self.readings[width] ** 2 for width in WIDTHS)


def dot(one, other):
    return sum(a * b for a, b in zip(one, other))


def apart(places):
    """Of each from their mean."""
    mean = sum(places) / len(places)
    return [place - mean for place in places]


def vertex(points):
    """Of the parabola through three points (place, height), at most as far beyond them as they are apart."""
    (x0, y0), (x1, y1), (x2, y2) = sorted(points)
    if x1 in (x0, x2):  # at the end of the travel
        return min(points, key=lambda point: point[1])[0]
    below, above = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
    bend = (above - below) / (x2 - x0)
    reach = x2 - x0
    if bend <= 0:
        return x0 - reach if y0 < y2 else x2 + reach
    return min(max((x0 + x1) / 2 - below / (2 * bend), x0 - reach), x2 + reach)


if __name__ == "__main__":
    serve(Beamline)
