"""A Mach-Zehnder interferometer: two mirrors in one arm and the lens of a telescope in the other bring two beams together.

After the task of Sorokin et al., Interferobot: aligning an optical interferometer by a reinforcement learning agent (NeurIPS
2020, arXiv 2006.02252), made anew: Gaussian beams in closed form (optics.py).
"""
import functools
import math

from optics import Camera, beam_of, log_overlap, lost_visibility, need_numpy, np, visibility_of

from relign_bench.plugin import Assembly, Scene, parameter, serve, uncertain_values

AXES = (("M1x", "mrad", -1.5, 1.5), ("M1y", "mrad", -1.5, 1.5), ("M2x", "mrad", -1.5, 1.5), ("M2y", "mrad", -1.5, 1.5),
        ("Lz", "mm", -4.0, 4.0), ("Lx", "mm", -0.1, 0.1))
TURNS = (2.0, math.sqrt(2))  # of a beam that meets a mirror at 45 degrees, by tilts about the vertical and the level axis
TO_M1, TO_M2, TO_CAMERA = 100.0, 400.0, 300.0  # the arm of the mirrors: from the first splitter, mirror to mirror, to the end
TO_L1, FROM_L2, FOCAL = 200.0, 400.0, 100.0  # the arm of the telescope, whose two lenses are alike
RADIUS, TO_WAIST = 0.9, 300.0  # of the laser's waist, and how far behind the first splitter it is: both beams get one size
FRAMES, SIDE, PITCH_MM = 16, 64, 0.06
COLUMNS = 4  # of frames in an image
PEAK = 4 * 2 / (math.pi * RADIUS**2)  # of two equal beams of unit power in phase, per mm^2
DARK = 0.01  # share of the light of two aligned beams below which no visibility is measured
NOMINAL_POSE = [0.5] * len(AXES)
# Normal laws, cut at 2.5 standard deviations: standard deviation, unit, meaning.
UNCERTAIN = {
    **{f"{mirror}{axis}_zero": (0.15, "mrad", "zero error of the mirror's tilt") for mirror in ("M1", "M2") for axis in "xy"},
    "Lz_zero": (0.5, "mm", "zero error of the lens along the beam"),
    **{f"L{axis}_zero": (0.02, "mm", "zero error of the lens across the beam") for axis in "xy"},
    **{f"laser_{axis}": (0.03, "mm", "place of the laser beam") for axis in "xy"},
    **{f"laser_a{axis}": (0.03, "mrad", "direction of the laser beam") for axis in "xy"},
    "divergence": (0.01, "1/m", "curvature of the laser beam minus that of the design"),
    "radius": (5.0, "%", "radius of the laser beam"),
    "magnification": (0.3, "%", "of the telescope: focal length of its fixed lens"),
    "arm": (5.0, "mm", "length of the arm of the mirrors"),
    "balance": (1.0, "%", "power in the arm of the mirrors"),
    **{f"camera_{axis}": (0.1, "mm", "place of the camera") for axis in "xy"},
}
CUT = 2.5
LEAST = {"radius": -100.0, "magnification": -100.0, "balance": -100.0, "arm": -TO_CAMERA}
BRIGHTNESS = (0.5, 0.9)  # uniform, share of what saturates the camera


class Interferometer(Assembly):
    """An interferometer as built."""

    def __init__(self, quantities, vibration_rad=0.0, noise=0.0):
        self.q = {name: quantities.get(name, 0.0) for name in UNCERTAIN}
        self.brightness = quantities.get("brightness", BRIGHTNESS[1])
        self.vibration_rad, self.noise = vibration_rad, noise
        self.powers = (1.0, 1 + self.q["balance"] / 100)

    @functools.cached_property
    def camera(self):
        return Camera(SIDE, PITCH_MM, (self.q["camera_x"], self.q["camera_y"]))

    def laser(self):
        """The beam at the first splitter."""
        q = self.q
        beam = beam_of(RADIUS * (1 + q["radius"] / 100), TO_WAIST, (q["laser_x"], q["laser_y"]),
                       (1e-3 * q["laser_ax"], 1e-3 * q["laser_ay"]))
        beam.curvature += 1e-3 * q["divergence"]
        return beam

    def mirrors(self, tilts_mrad):
        """The beam of this arm at the camera, by the tilts M1x, M1y, M2x and M2y."""
        zeros = (self.q[f"{name}_zero"] for name, *_ in AXES)
        turns = [1e-3 * gain * (tilt + zero) for tilt, zero, gain in zip(tilts_mrad, zeros, TURNS * 2)]
        beam = self.laser().drift(TO_M1).mirror(turns[:2]).drift(TO_M2).mirror(turns[2:])
        return beam.drift(TO_CAMERA + self.q["arm"])

    def telescope(self, along_mm, across_mm):
        """The beam of this arm at the camera. The camera stays where it is when the lens moves."""
        along = DESIGN_ALONG + along_mm + self.q["Lz_zero"]
        first = FOCAL * (1 + self.q["magnification"] / 100)
        beam = self.laser().drift(TO_L1).lens(first).drift(first + FOCAL + along)
        return beam.lens(FOCAL, (across_mm + self.q["Lx_zero"], self.q["Ly_zero"])).drift(FROM_L2 - along)

    def beams(self, true_pose):
        """Those of the telescope and of the mirrors at the camera."""
        values = [lower + p * (upper - lower) for p, (_, _, lower, upper) in zip(true_pose, AXES)]
        return self.telescope(*values[4:]), self.mirrors(values[:4])

    def image(self, true_pose, phases, noise):
        """The frames at these phases, and the measured 1 - visibility."""
        alone, wave = (self.brightness / PEAK * part for part in self.camera.fringes(*self.beams(true_pose), self.powers))
        turns = np.exp(-1j * np.asarray(phases))[:, None, None]
        frames = alone + 2 * (wave * turns).real + noise
        image = frames.reshape(COLUMNS, COLUMNS, SIDE, SIDE).swapaxes(1, 2).reshape(COLUMNS * SIDE, -1)
        totals = frames.sum(axis=(1, 2))
        dark = totals.mean() < DARK * self.brightness * 2 / (PEAK * PITCH_MM**2)
        return image.astype(np.float32), [1.0 if dark else 1 - min(visibility_of(totals), 1.0)]

    def capture(self, true_pose, frame_seed):
        rng = np.random.default_rng(frame_seed)
        start = rng.uniform(0, 2 * math.pi)  # the arms drift from capture to capture
        phases = start + 2 * math.pi * np.arange(FRAMES) / FRAMES + self.vibration_rad * rng.standard_normal(FRAMES)
        return self.image(true_pose, phases, self.noise * rng.standard_normal((FRAMES, SIDE, SIDE), dtype=np.float32))

    def render_noise_free(self, true_pose):
        return self.image(true_pose, 2 * math.pi * np.arange(FRAMES) / FRAMES, 0.0)

    def score_of(self, beams):
        return lost_visibility(*beams, self.powers)

    def score(self, true_pose, seed):
        return self.score_of(self.beams(true_pose)), 0.0

    def best_along(self):
        """The position of the lens along the beam at which the beams are most alike, but for places and angles."""
        still = [0.0, 0.0]
        mirrors = self.mirrors([0.0] * 4)
        mirrors.place = mirrors.angle = still

        def alike(along):
            beam = self.telescope(along, 0.0)
            beam.place = beam.angle = still
            return log_overlap(beam, mirrors)

        low, high = AXES[4][2:]
        for _ in range(80):  # one maximum
            third = (high - low) / 3
            if alike(low + third) < alike(high - third):
                low += third
            else:
                high -= third
        return (low + high) / 2

    def own_optimum(self, seed):
        """The lens makes the beams alike, the mirrors bring place and angle together, which they do in closed form."""
        along = self.best_along()
        wanted, found = self.telescope(along, 0.0), self.mirrors([0.0] * 4)
        tilts = []
        for axis, gain in enumerate(TURNS):
            angle = wanted.angle[axis] - found.angle[axis]
            first = (wanted.place[axis] - found.place[axis] - (TO_CAMERA + self.q["arm"]) * angle) / TO_M2
            tilts.append((1000 * first / gain, 1000 * (angle - first) / gain))
        values = [tilts[0][0], tilts[1][0], tilts[0][1], tilts[1][1], along, 0.0]
        pose = [min(max((value - lower) / (upper - lower), 0.0), 1.0) for value, (_, _, lower, upper) in zip(values, AXES)]
        return pose, *self.score(pose, seed)


DESIGN_ALONG = 0.0  # how far from the confocal place the lens of the design is, which makes its beams alike
DESIGN_ALONG = Interferometer({}).best_along()


class MachZehnder(Scene):
    id = "interferometer"
    reproducible = "this_cpu"

    vibration_rad = parameter(0.02, minimum=0.0, maximum=3.0, unit="rad", description="Standard deviation of a frame's phase")
    noise = parameter(0.01, minimum=0.0, maximum=1.0, unit="white", description="Standard deviation of a pixel")

    def describe(self):
        cut = [{"name": name, "unit": unit, "meaning": meaning,
                "law": {"law": "normal", "sigma": sigma, "lower": -CUT * sigma, "upper": CUT * sigma}}
               for name, (sigma, unit, meaning) in UNCERTAIN.items()]
        return {
            "name": "interferometer",
            "summary": "A Mach-Zehnder interferometer: two mirrors and a lens bring two beams together",
            "axes": [{"name": name, "unit": unit, "lower": lower, "upper": upper, "speed_per_s": (upper - lower) / 2}
                     for name, unit, lower, upper in AXES],
            "nominal_pose": NOMINAL_POSE,
            "image": {"width": COLUMNS * SIDE, "height": COLUMNS * SIDE, "white": 1.0},
            "readings": [{"name": "1 - visibility"}],
            "score": {"name": "1 - visibility", "scale": "log", "resolution": 1e-5, "reading": "1 - visibility"},
            "elements": [],
            "uncertain": [*cut, {"name": "brightness", "unit": "white", "meaning": "of two aligned beams in phase",
                                 "law": {"law": "uniform", "lower": BRIGHTNESS[0], "upper": BRIGHTNESS[1]}}],
            "machine_time": {"settle_ms": 100, "exposure_ms": 10 * FRAMES, "readout_ms": 0},
            "spec": {"score": 1e-4},
        }

    def reference(self):
        need_numpy()
        return Interferometer({}).render_noise_free(NOMINAL_POSE)

    def mount(self, offsets):
        values = uncertain_values(offsets, [*UNCERTAIN, "brightness"])
        for name, least in LEAST.items():
            if (value := values.get(name, 0.0)) <= least:
                raise ValueError(f"'{name}' is {value:g}, but must be above {least:g}: no such interferometer can be built")
        return Interferometer(values, self.vibration_rad, self.noise)


if __name__ == "__main__":
    serve(MachZehnder)
