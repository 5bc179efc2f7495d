"""A Kirkpatrick-Baez pair at a synchrotron: two bent mirrors focus X-rays, V vertically and behind it H horizontally.

Rays by the closed form of optics.py; source, figure and diffraction are added as squares. A capture is what beamlines scan for:
both widths of the focus by a knife edge, its place, the flux, and the places of pencil beams that a narrow slit lets through.
"""
import math
import random

import optics

from relign_bench.plugin import Assembly, Scene, parameter, serve, uncertain_values

WAVELENGTH_M = 1.0e-10  # 12.4 keV
GRAZING = 3e-3
SLIT_M = 260e-6  # in front of the mirrors, square: nine tenths of what a mirror accepts
PENCILS_UM = (-110.0, -55.0, 0.0, 55.0, 110.0)  # places of the narrow slit
PIVOT_M = -0.1  # of the pitch stage, in front of the mirror's centre: 0.1 mrad of pitch also lift the mirror by 10 um
BEND_PER_UM = 1e-3  # relative change of curvature at an end of the mirror by 1 um of its bender
# V is 0.15 m in front of H. Both are 0.1 m long.
MIRRORS = {"V": optics.Mirror(0.1, 50.0, 0.30, GRAZING, PIVOT_M), "H": optics.Mirror(0.1, 50.15, 0.15, GRAZING, PIVOT_M)}
FIELD_UM = 500.0  # the widest focus that is measured; also what is read where there is too little light
CAMERA_UM = 1000.0  # half the field of the camera; also what is read for a pencil beam that misses the mirror
DARK = 1e-3  # share of the light below which no focus is measured

# Of each mirror: name, unit, half of the travel, speed per s.
MOTIONS = (("pitch", "mrad", 0.5, 0.1), ("height", "um", 200.0, 200.0), ("up", "um", 200.0, 50.0), ("down", "um", 200.0, 50.0))
AXES = [(f"{mirror}_{name}", unit, half, speed) for mirror in MIRRORS for name, unit, half, speed in MOTIONS]
AXES += [("H_roll", "mrad", 8.0, 2.0)]
NOMINAL_POSE = [0.5] * len(AXES)
# Normal laws, cut at 3 standard deviations: mean, standard deviation, unit, meaning.
EACH = {
    "pitch_zero": (0.0, 0.1, "mrad", "pitch at which the grazing angle is that of the design"),
    "height_zero": (0.0, 40.0, "um", "height, along its normal, at which the beam meets the mirror's centre"),
    "up_zero": (0.0, 40.0, "um", "upstream bender at which the mirror has its curvature"),
    "down_zero": (0.0, 40.0, "um", "downstream bender at which the mirror has its curvature"),
    "gain": (1.0, 0.1, "1", "curvature by 1 um of a bender, as a share of the design's"),
    "figure": (0.2, 0.05, "urad", "slope error, standard deviation"),
}
UNCERTAIN = {
    **{f"{mirror}_{name}": law for mirror in MIRRORS for name, law in EACH.items()},
    "H_roll_zero": (0.0, 2.0, "mrad", "roll at which the mirrors are perpendicular"),
    "V_source": (20.0, 2.0, "um", "vertical FWHM of the source"),
    "H_source": (100.0, 10.0, "um", "horizontal FWHM of the source"),
    "sample_y": (0.0, 15.0, "um", "height of the sample above the focus of the design"),
    "sample_x": (0.0, 15.0, "um", "place of the sample beside the focus of the design"),
}
CUT = 3.0
POSITIVE = [f"{mirror}_{name}" for mirror in MIRRORS for name in ("gain", "figure", "source")]


class Pair(Assembly):
    """A pair of mirrors as built."""

    def __init__(self, quantities, noise=0.0, centroid_um=0.0):
        self.q = {name: quantities.get(name, mean) for name, (mean, *_) in UNCERTAIN.items()}
        self.noise, self.centroid_um = noise, centroid_um

    def errors(self, true_pose):
        """Of each axis from its zero, in its unit."""
        return {name: (2 * p - 1) * half - self.q[f"{name}_zero"] for p, (name, _, half, _) in zip(true_pose, AXES)}

    def rays(self, name, errors):
        """Of a mirror."""
        pitch, height, up, down = (errors[f"{name}_{motion}"] for motion, *_ in MOTIONS)
        bend = BEND_PER_UM * self.q[f"{name}_gain"]
        return MIRRORS[name].rays(1e-3 * pitch, 1e-6 * height, bend * up, bend * down)

    def focus(self, lights, roll):
        """FWHM in um along y and x, with the blur of each mirror by the roll of H, and the share of the light."""
        v, h = (MIRRORS[name] for name in MIRRORS)
        # Behind V the beam converges: at H it is narrower.
        spreads = {"V": lights["H"].spread, "H": lights["V"].spread * h.focus / v.focus}
        widths = []
        for name, mirror in MIRRORS.items():
            light = lights[name]
            if light.share == 0.0:
                return FIELD_UM, FIELD_UM, 0.0
            parts = (
                optics.source_image(1e-6 * self.q[f"{name}_source"], mirror.source, mirror.focus),
                optics.figure_blur(1e-6 * self.q[f"{name}_figure"], mirror.focus),
                optics.diffraction(WAVELENGTH_M, mirror.focus, light.width),
                optics.FWHM * optics.skew(roll, h.source, h.focus, spreads[name]),
            )
            widths.append(min(1e6 * optics.width(light, *parts), FIELD_UM))
        return *widths, lights["V"].share * lights["H"].share

    def measured(self, true_pose, random=None):
        """The readings, with noise if there is a generator."""

        def noise(size):
            return size * random.gauss(0, 1) if random else 0.0

        def on_camera(place_um):
            return min(max(place_um, -CAMERA_UM), CAMERA_UM)

        errors = self.errors(true_pose)
        rays = {name: self.rays(name, errors) for name in MIRRORS}
        lights = {name: optics.beam(found, SLIT_M) for name, found in rays.items()}
        roll = 1e-3 * errors["H_roll"]
        y, x, flux = self.focus(lights, roll)
        y, x = (min(abs(width * (1 + noise(self.noise))), FIELD_UM) for width in (y, x))
        flux = max(flux * (1 + noise(self.noise / 6)), 0.0)
        places = {"V": 1e6 * (lights["V"].position + optics.sideways(roll, GRAZING, MIRRORS["H"].focus)) - self.q["sample_y"],
                  "H": 1e6 * lights["H"].position - self.q["sample_x"]}
        seen = [on_camera(places[name] + noise(self.centroid_um)) if flux > DARK else CAMERA_UM for name in MIRRORS]
        for name in MIRRORS:
            for place_um in PENCILS_UM:
                found = optics.pencil(rays[name], 1e-6 * place_um)
                seen.append(CAMERA_UM if found is None else on_camera(1e6 * found + noise(self.centroid_um)))
        return [spot_um(y, x, flux), y, x, flux, *seen]

    def capture(self, true_pose, frame_seed):
        return self.measured(true_pose, random.Random(frame_seed))

    def render_noise_free(self, true_pose):
        return self.measured(true_pose)

    def score(self, true_pose, seed):
        return self.measured(true_pose)[0], 0.0

    def own_optimum(self, seed):
        """All axes at their zeros: no ray misses the focus there, and no light is lost."""
        pose = [0.5 + 0.5 * self.q[f"{name}_zero"] / half for name, _, half, _ in AXES]
        pose = [min(max(p, 0.0), 1.0) for p in pose]
        return pose, *self.score(pose, seed)


def spot_um(y, x, flux):
    """Side of a square in which all the light would be as dense as it is in the focus: a mirror that cuts the beam gains
    nothing."""
    return min(math.sqrt(y * x / flux), FIELD_UM) if flux > DARK else FIELD_UM


READINGS = [("spot", "um"), ("width y", "um"), ("width x", "um"), ("flux", "1"), ("position y", "um"), ("position x", "um"),
            *((f"pencil {axis}{k}", "um") for axis in "yx" for k in range(1, len(PENCILS_UM) + 1))]


class Mirrors(Scene):
    id = "mirrors"
    reproducible = "this_cpu"

    noise = parameter(0.03, minimum=0.0, maximum=1.0, unit="1",
                      description="Relative standard deviation of a width; that of the flux is a sixth of it")
    centroid_um = parameter(0.1, minimum=0.0, maximum=100.0, unit="um", description="Standard deviation of a place")

    def describe(self):
        return {
            "name": "mirrors",
            "summary": "A Kirkpatrick-Baez pair of bent mirrors that focuses X-rays",
            "axes": [{"name": name, "unit": unit, "lower": -half, "upper": half, "speed_per_s": speed}
                     for name, unit, half, speed in AXES],
            "nominal_pose": NOMINAL_POSE,
            "readings": [{"name": name, "unit": unit} for name, unit in READINGS],
            "score": {"name": "spot size", "unit": "um", "scale": "log", "resolution": 0.01, "reading": "spot"},
            "elements": [],
            "uncertain": [{"name": name, "unit": unit, "meaning": meaning,
                           "law": {"law": "normal", "mean": mean, "sigma": sigma,
                                   "lower": mean - CUT * sigma, "upper": mean + CUT * sigma}}
                          for name, (mean, sigma, unit, meaning) in UNCERTAIN.items()],
            # Two scans of a knife edge of 10 s each, and a second for each pencil beam.
            "machine_time": {"settle_ms": 1000, "exposure_ms": 30000, "readout_ms": 0},
            "spec": {"score": 0.5},
        }

    def reference(self):
        return Pair({}).render_noise_free(NOMINAL_POSE)

    def mount(self, offsets):
        values = uncertain_values(offsets, UNCERTAIN)
        for name in POSITIVE:
            if (value := values.get(name, 1.0)) <= 0:
                raise ValueError(f"'{name}' is {value:g}, but must be above 0: no such mirror can be built")
        return Pair(values, self.noise, self.centroid_um)


if __name__ == "__main__":
    serve(Mirrors)
