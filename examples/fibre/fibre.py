"""A single-mode fibre in front of the facet of a photonic chip: the reading is the level of a photodiode, in dB."""
import math
import random

from coupling import coupling

from relign_bench.plugin import Assembly, Scene, parameter, serve, uncertain_values

DARKEST_DB = 60.0  # the largest loss that the logarithmic amplifier tells
DARK = 1e-6  # dark current, as a share of the current at full coupling
SHOT = 3e-4  # noise of the current at full coupling, as a share of it; that of a smaller one by the square root
NOMINAL_GAP_UM = 10.0
SPECIFIED_DB = 1.0  # of an end
AXES = (("x", "mm", -0.05, 0.05), ("y", "mm", -0.05, 0.05), ("z", "mm", -0.002, 0.098),
        ("Rx", "deg", -2.0, 2.0), ("Ry", "deg", -2.0, 2.0), ("Rz", "deg", -2.0, 2.0))
QUANTITIES = (("waist", "um", "waist of the facet's mode minus that of the fibre's", 0.3),
              ("facet_x", "um", "place of the facet's mode", 3.0),
              ("facet_y", "um", "place of the facet's mode", 3.0),
              ("exit_x", "deg", "angle at which light leaves the facet, towards x", 0.3),
              ("exit_y", "deg", "angle at which light leaves the facet, towards y", 0.3))


def loss_db(share):
    """Of a share of the power: 0 to 60 dB."""
    return min(-10 * math.log10(max(share, 1e-30)), DARKEST_DB)


class End:
    """A fibre and the facet that it faces."""

    def __init__(self, **quantities):
        self.waist_um = 5.2 + quantities.get("waist", 0.0)
        self.facet_um = [quantities.get("facet_x", 0.0), quantities.get("facet_y", 0.0)]
        self.exit_rad = [math.radians(quantities.get("exit_x", 0.0)), math.radians(quantities.get("exit_y", 0.0))]

    def share(self, x_mm, y_mm, z_mm, rx_deg, ry_deg, _):
        """Of the power; a turn of the fibre about its own axis changes nothing."""
        gap_um = NOMINAL_GAP_UM + 1000 * z_mm
        tilts = [math.radians(ry_deg), -math.radians(rx_deg)]  # of the fibre's axis towards x and y
        fibre_um = [1000 * x_mm, 1000 * y_mm]
        offsets = [facet + gap_um * angle - place for facet, angle, place in zip(self.facet_um, self.exit_rad, fibre_um)]
        return coupling(self.waist_um, gap_um, offsets, [angle - tilt for angle, tilt in zip(self.exit_rad, tilts)])

    def best(self):
        """The position at which most light is coupled, for a gap within the travel: mm and degrees."""
        def at(z_mm):
            gap_um = NOMINAL_GAP_UM + 1000 * z_mm
            place = [(facet + gap_um * angle) / 1000 for facet, angle in zip(self.facet_um, self.exit_rad)]
            return [*place, z_mm, -math.degrees(self.exit_rad[1]), math.degrees(self.exit_rad[0]), 0.0]

        low, high = AXES[2][2:]
        for _ in range(60):  # the coupling has one maximum along the gap
            third = (high - low) / 3
            if self.share(*at(low + third)) < self.share(*at(high - third)):
                low += third
            else:
                high -= third
        return at((low + high) / 2)


class Coupler(Assembly):
    """A chip as built, with one fibre or, in front of each of its facets, two."""

    def __init__(self, ends):
        self.ends = ends

    def share(self, true_pose):
        position = [lower + p * (upper - lower) for p, (_, _, lower, upper) in zip(true_pose, AXES * len(self.ends))]
        parts = [position[i : i + len(AXES)] for i in range(0, len(position), len(AXES))]
        return math.prod(end.share(*part) for end, part in zip(self.ends, parts))

    def capture(self, true_pose, frame_seed):
        share = self.share(true_pose)
        noise = SHOT * math.sqrt(share + DARK) * random.Random(frame_seed).gauss(0, 1)
        return [loss_db(abs(share + DARK + noise))]

    def render_noise_free(self, true_pose):
        return [loss_db(self.share(true_pose))]

    def score(self, true_pose, seed):
        return loss_db(self.share(true_pose)), 0.0

    def own_optimum(self, seed):
        position = [value for end in self.ends for value in end.best()]
        pose = [min(max((p - lower) / (upper - lower), 0.0), 1.0) for p, (_, _, lower, upper) in
                zip(position, AXES * len(self.ends))]
        return pose, *self.score(pose, seed)


class Fibre(Scene):
    id = "fibre"
    reproducible = "this_cpu"
    presets = {"fibre-both-ends": {"ends": 2}}

    ends = parameter(1, minimum=1, maximum=2, description="Facets of the chip with a fibre of its own, on a stage of six axes")

    def names(self, names):
        """Of each end: with a prefix where there are two."""
        return list(names) if self.ends == 1 else [f"{end}_{name}" for end in ("in", "out") for name in names]

    def describe(self):
        kinds = list(zip(self.names([axis[0] for axis in AXES]), AXES * self.ends))
        quantities = zip(self.names([quantity[0] for quantity in QUANTITIES]), QUANTITIES * self.ends)
        nominal = [-lower / (upper - lower) for _, _, lower, upper in AXES] * self.ends
        return {
            "name": "fibre" if self.ends == 1 else "fibre-both-ends",
            "summary": "A single-mode fibre in front of a photonic chip, and a photodiode that tells 60 dB",
            "axes": [{"name": name, "unit": unit, "lower": lower, "upper": upper, "observable": not name.endswith("Rz")}
                     for name, (_, unit, lower, upper) in kinds],
            "nominal_pose": nominal,
            "readings": [{"name": "loss", "unit": "dB"}],
            "score": {"name": "insertion loss", "unit": "dB", "resolution": 0.01, "reading": "loss"},
            "elements": [],
            "uncertain": [{"name": name, "unit": unit, "meaning": meaning, "law": {"law": "normal", "sigma": sigma}}
                          for name, (_, unit, meaning, sigma) in quantities],
            "machine_time": {"speed_mm_per_s": 1, "speed_deg_per_s": 5, "settle_ms": 10, "exposure_ms": 1, "readout_ms": 0},
            "spec": {"score": SPECIFIED_DB * self.ends},
        }

    def reference(self):
        return [loss_db(End().share(0, 0, 0, 0, 0, 0) ** self.ends)]

    def mount(self, offsets):
        values = uncertain_values(offsets, self.names([quantity[0] for quantity in QUANTITIES]))
        prefixes = [""] if self.ends == 1 else ["in_", "out_"]
        return Coupler([End(**{quantity[0]: values.get(prefix + quantity[0], 0.0) for quantity in QUANTITIES})
                        for prefix in prefixes])


if __name__ == "__main__":
    serve(Fibre)
