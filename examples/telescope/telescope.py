"""The Rubin telescope out of alignment: its camera and its second mirror on a hexapod each, and donuts out of focus.

batoid, which is not part of this project, traces the rays: pip install batoid
"""
import functools
import math

import optics
from optics import TILE, need_batoid, np

from relign_bench.plugin import Assembly, Scene, parameter, serve, uncertain_values

# Of each hexapod. A turn about the axis changes nothing but the camera's orientation.
MOTIONS = (("x", "mm", 2.5), ("y", "mm", 2.5), ("z", "mm", 0.5), ("Rx", "deg", 0.05), ("Ry", "deg", 0.05))
AXES = [(f"{part}_{name}", unit, half) for part in ("M2", "camera") for name, unit, half in MOTIONS]
SPEED_PER_S = {"mm": 0.5, "deg": 0.02, "nm": 100.0}
ZERNIKES = range(4, 12)  # of a mirror's figure, in the order of Noll: focus to spherical aberration
MIRRORS = ("M1", "M2")
# With bending: what the actuators behind both mirrors add to their figures, in nm, as Zernike coefficients, too.
BENDING_HALF_NM = 200.0
BENDING = [(mirror, j) for mirror in MIRRORS for j in range(4, 24)]
WORST_NM, WORST_ARCSEC = 1e5, 1e3  # where rays fail
# Normal laws, cut at 2.5 standard deviations: standard deviation, unit, meaning.
UNCERTAIN = {
    **{f"{part}_{name}_zero": (half / 6, unit, "where the hexapod's zero is") for part in ("M2", "camera")
       for name, unit, half in MOTIONS},
    **{f"{mirror}_Z{j}": (20.0, "nm", "error of the mirror's figure, a Zernike coefficient in the order of Noll")
       for mirror in MIRRORS for j in ZERNIKES},
}
CUT = 2.5
RANGES = {"seeing": (0.5, 0.9, "arcsec", "width of a star by the atmosphere, full width at half maximum"),
          "photons": (1e5, 4e5, "1", "of a donut")}
DESIGN = {"seeing": 0.7, "photons": 2e5}
BACKGROUND = 20.0  # photons of a pixel
# What star images in focus over the whole field tell of the score: its relative error, and nm.
MEASURED_SHARE, MEASURED_NM = 0.03, 10.0


def motion(values):
    """Five values in mm and deg, in m and rad."""
    return tuple(1e-3 * v for v in values[:3]) + tuple(math.radians(v) for v in values[3:])


def telescope_at(values, figures_nm=None):
    """With M2 and camera moved by ten values in mm and deg.

    Args:
        values: In the order of AXES.
        figures_nm: {mirror: Zernike coefficients in the order of ZERNIKES}
    """
    outer_inner = optics.MIRRORS
    figures = [(mirror, *outer_inner[mirror], [0.0] * ZERNIKES.start + [1e-9 * v for v in coefficients])
               for mirror, coefficients in (figures_nm or {}).items()]
    return optics.telescope(m2=motion(values[:5]), camera=motion(values[5:]), figures=figures)


def residuals_nm(values, figures_nm=None):
    """What squares of add up to the square of the score: waves over field and pupil, without piston and tilt; NaN where rays
    fail."""
    return optics.residuals_nm(telescope_at(values, figures_nm))


def axes(bending):
    """(name, unit, half travel) of each: those of the hexapods, and with bending those of the mirrors."""
    return AXES + [(f"{mirror}_bend_Z{j}", "nm", BENDING_HALF_NM) for mirror, j in BENDING] * bending


def figures_of(values, errors_nm=None):
    """The figures of both mirrors.

    Args:
        values: Of all axes.
        errors_nm: {mirror: Zernike coefficients in the order of ZERNIKES}
    """
    figures = {mirror: list((errors_nm or {}).get(mirror, [0.0] * len(ZERNIKES))) for mirror in MIRRORS}
    if len(values) > len(AXES):
        for mirror in MIRRORS:
            bends = [value for value, (bent, _) in zip(values[len(AXES):], BENDING) if bent == mirror]
            errors = figures[mirror] + [0.0] * (len(bends) - len(figures[mirror]))
            figures[mirror] = [error + bend for error, bend in zip(errors, bends)]
    return figures


@functools.cache
def sensitivity(bending=False):
    """Derivatives of the design's residuals by all positions, in units of the half travel, shape (residuals, axes)."""
    need_batoid()
    columns, moving = [], axes(bending)
    for axis, (_, _, half) in enumerate(moving):
        ends = []
        for sign in (-1, 1):
            values = [0.0] * len(moving)
            values[axis] = sign * 0.02 * half
            ends.append(residuals_nm(values[:len(AXES)], figures_of(values)))
        columns.append((ends[1] - ends[0]) / 0.04)
    return np.stack(columns, axis=1)


def corrected(residuals, kept, bending=False):
    """The move, in half travels, that lowers the residuals most, along the directions of largest effect.

    Moves of both hexapods that cancel each other have hardly any effect: they are left out, as the observatory does.
    """
    u, s, v = np.linalg.svd(sensitivity(bending), full_matrices=False)
    return -(v[:kept].T / s[:kept]) @ (u[:, :kept].T @ residuals)


class Built(Assembly):
    """A telescope as built."""

    def __init__(self, quantities, bending=False):
        need_batoid()
        q = {name: quantities.get(name, DESIGN.get(name, 0.0)) for name in (*UNCERTAIN, *RANGES)}
        self.bending = bending
        self.zeros = [q[f"{name}_zero"] for name, *_ in AXES] + [0.0] * (len(BENDING) * bending)
        self.figures_nm = {mirror: [q[f"{mirror}_Z{j}"] for j in ZERNIKES] for mirror in MIRRORS}
        self.seeing, self.photons = q["seeing"], q["photons"]

    def values(self, true_pose):
        """Of all axes, in mm, deg and nm from where the design has them."""
        return [(2 * p - 1) * half + zero for p, (_, _, half), zero in zip(true_pose, axes(self.bending), self.zeros)]

    def parts(self, true_pose):
        """The ten values of the hexapods, and the figures."""
        values = self.values(true_pose)
        return values[:len(AXES)], figures_of(values, self.figures_nm)

    def residuals(self, true_pose):
        return residuals_nm(*self.parts(true_pose))

    def image(self, true_pose, rng):
        """Two rows of four donuts, in photons / 1000, and the measured score."""
        light = self.photons * optics.donuts(telescope_at(*self.parts(true_pose)), self.seeing)
        light = np.where(np.isfinite(light), light, 0.0).clip(0.0) + BACKGROUND
        measured = self.score(true_pose, 0)[0]
        if rng is not None:
            light = rng.poisson(light)
            measured = abs(measured * (1 + MEASURED_SHARE * rng.standard_normal()) + MEASURED_NM * rng.standard_normal())
        return (light / 1000).astype(np.float32), [measured]

    def capture(self, true_pose, frame_seed):
        return self.image(true_pose, np.random.default_rng(frame_seed))

    def render_noise_free(self, true_pose):
        return self.image(true_pose, None)

    def score(self, true_pose, seed):
        residuals = self.residuals(true_pose)
        score = float(np.sqrt(np.sum(residuals**2)))
        return (min(score, WORST_NM) if math.isfinite(score) else WORST_NM), 0.0

    def own_optimum(self, seed):
        """Gauss-Newton with the design's derivatives, which are nearly those of every telescope, within the travel."""
        pose = np.clip([0.5 - zero / half / 2 for (_, _, half), zero in zip(axes(self.bending), self.zeros)], 0, 1)
        best = self.score(pose, seed)[0], pose
        # From the directions of large effect to all; of fifty, many bend the mirrors against each other.
        for kept in (20, 20, 25, 25, 30, 30, 35, 35) if self.bending else (7, 7, 7, 9, 9, 10, 10, 10):
            pose = np.clip(best[1] + corrected(self.residuals(best[1]), kept, self.bending) / 2, 0, 1)
            best = min(best, (self.score(pose, seed)[0], pose), key=lambda found: found[0])
        return list(map(float, best[1])), best[0], 0.0

    def fwhm_arcsec(self, true_pose):
        """Full width at half maximum of the telescope's own share of a star image, 2.355 times the spot's deviation an axis,
        the root mean square over the field."""
        spots, fields, aperture = optics.spots_m(telescope_at(*self.parts(true_pose)))
        variance = float(fields @ ((spots**2).sum(2) @ aperture)) / 2
        return math.degrees(2.355 * math.sqrt(variance) / optics.FOCAL_LENGTH_M) * 3600


    def further_score(self, pose, seed, which):
        width = self.fwhm_arcsec(pose)
        return min(width, WORST_ARCSEC) if math.isfinite(width) else WORST_ARCSEC


class Telescope(Scene):
    id = "telescope"
    reproducible = "this_cpu"
    presets = {"telescope-bending": {"bending": True}}

    bending = parameter(False, description="Also bend both mirrors, by twenty modes each: 50 axes")
    spec_nm = parameter(250.0, minimum=1.0, maximum=1e5, unit="nm", description="Largest wavefront error of the specification")

    def describe(self):
        height, width = 2 * TILE, 4 * TILE
        laws = [(name, unit, meaning, {"law": "normal", "sigma": sigma, "lower": -CUT * sigma, "upper": CUT * sigma})
                for name, (sigma, unit, meaning) in UNCERTAIN.items()]
        laws += [(name, unit, meaning, {"law": "uniform", "lower": low, "upper": high})
                 for name, (low, high, unit, meaning) in RANGES.items()]
        return {
            "name": "telescope-bending" if self.bending else "telescope",
            "summary": "The Rubin telescope: second mirror and camera, a hexapod each, and donuts at the corners of the field",
            "axes": [{"name": name, "unit": unit, "lower": -half, "upper": half, "speed_per_s": SPEED_PER_S[unit]}
                     for name, unit, half in axes(self.bending)],
            "nominal_pose": [0.5] * len(axes(self.bending)),
            "image": {"width": width, "height": height, "white": 0.3},
            "readings": [{"name": "wavefront error", "unit": "nm"}],
            "score": {"name": "wavefront error", "unit": "nm", "scale": "log", "resolution": 1.0, "reading": "wavefront error",
                      "further": [{"name": "FWHM", "unit": "arcsec"}]},
            "elements": [],
            "uncertain": [{"name": name, "unit": unit, "meaning": meaning, "law": law} for name, unit, meaning, law in laws],
            "machine_time": {"settle_ms": 2000, "exposure_ms": 15000, "readout_ms": 2000},
            "spec": {"score": self.spec_nm},
        }

    def reference(self):
        return Built({}, self.bending).render_noise_free([0.5] * len(axes(self.bending)))

    def mount(self, offsets):
        return Built(uncertain_values(offsets, (*UNCERTAIN, *RANGES)), self.bending)


if __name__ == "__main__":
    serve(Telescope)
