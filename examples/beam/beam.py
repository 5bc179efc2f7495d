"""The experimental area of the accelerator ARES: quadrupoles and steerers bring a beam to the size and place that are wanted.

Cheetah, which is not part of this project, tracks the beam: pip install cheetah-accelerator
"""
import functools
import random

from relign_bench.plugin import Assembly, Scene, parameter, serve, uncertain_values

# Quadrupoles by their strength, in 1/m^2, steerers by their angle, in mrad; in the order of the beam.
AXES = (("Q1", "1/m^2", 0.0, 72.0), ("Q2", "1/m^2", -72.0, 0.0), ("CV", "mrad", -6.1782, 6.1782),
        ("Q3", "1/m^2", 0.0, 72.0), ("CH", "mrad", -6.1782, 6.1782))
START = (10.0, -10.0, 0.0, 10.0, 0.0)  # the operators' settings before they tune, focus, defocus, focus
LATTICE_M = (0.17504, ("Q1", 0.122), 0.428, ("Q2", 0.122), 0.204, ("CV", 0.02), 0.204, ("Q3", 0.122), 0.179, ("CH", 0.02), 0.45)
NOMINAL_POSE = [(value - lower) / (upper - lower) for value, (_, _, lower, upper) in zip(START, AXES)]
ENERGY_MEV = 107.0
STARTS = 4  # of the search for the best pose
HALF_SCREEN_UM = (1224 * 3.3198, 1020 * 2.4469)  # beyond this the screen sees nothing
BEAM = ("mu_x", "sigma_x", "mu_y", "sigma_y")
# What is uncertain, uniform: lower end, upper end, unit, meaning. Of incoming beams and misalignments as in the published task.
UNCERTAIN = {
    "energy": (80.0, 160.0, "MeV", "of the incoming beam"),
    **{f"in_mu_{axis}": (-1.0, 1.0, "mm", "place of the incoming beam") for axis in "xy"},
    **{f"in_mu_p{axis}": (-0.1, 0.1, "mrad", "direction of the incoming beam") for axis in "xy"},
    **{f"in_sigma_{axis}": (0.01, 0.5, "mm", "size of the incoming beam") for axis in "xy"},
    **{f"in_sigma_p{axis}": (0.001, 0.05, "mrad", "divergence of the incoming beam") for axis in "xy"},
    **{f"{magnet}_{axis}": (-0.5, 0.5, "mm", "misalignment") for magnet in ("Q1", "Q2", "Q3", "screen") for axis in "xy"},
    **{f"goal_mu_{axis}": (-2.0, 2.0, "mm", "where the beam is wanted") for axis in "xy"},
    **{f"goal_sigma_{axis}": (0.0, 2.0, "mm", "size that is wanted") for axis in "xy"},
}
DESIGN = {"energy": ENERGY_MEV, "in_sigma_x": 0.2, "in_sigma_y": 0.2, "in_sigma_px": 0.004, "in_sigma_py": 0.004,
          "goal_sigma_x": 0.2, "goal_sigma_y": 0.2}


class Area(Assembly):
    """An accelerator as it is today, and the beam that is wanted."""

    def __init__(self, quantities, noise_um):
        try:
            import cheetah
            import torch
        except ModuleNotFoundError:
            raise ModuleNotFoundError(
                "Cheetah, which tracks the beam, is not installed: pip install cheetah-accelerator") from None
        torch.set_num_threads(1)
        self.quantities = {name: quantities.get(name, DESIGN.get(name, 0.0)) for name in UNCERTAIN}
        self.noise_um = noise_um
        self.number = functools.partial(torch.tensor, dtype=torch.float64)
        q, number = self.quantities, self.number
        self.incoming = cheetah.ParameterBeam.from_parameters(
            energy=number(1e6 * q["energy"]), sigma_tau=number(1e-6), sigma_p=number(1e-4),
            **{f"{kind}_{axis}": number(1e-3 * q[f"in_{kind}_{axis}"])
               for kind in ("mu", "sigma") for axis in ("x", "px", "y", "py")}, dtype=torch.float64)
        self.elements = {}
        for place in LATTICE_M:
            if isinstance(place, float):
                self.elements[f"drift{len(self.elements)}"] = cheetah.Drift(number(place), dtype=torch.float64)
                continue
            name, length = place
            kinds = {"Q": cheetah.Quadrupole, "CV": cheetah.VerticalCorrector, "CH": cheetah.HorizontalCorrector}
            kind = kinds[name.rstrip("123")]
            self.elements[name] = kind(number(length), dtype=torch.float64)
            if name.startswith("Q"):
                self.elements[name].misalignment = number([1e-3 * q[f"{name}_x"], 1e-3 * q[f"{name}_y"]])
        self.segment = cheetah.Segment(list(self.elements.values()))

    def beam_um(self, true_pose):
        """mu_x, sigma_x, mu_y and sigma_y on the screen, in its coordinates."""
        for p, (name, unit, lower, upper) in zip(true_pose, AXES):
            value = self.number(lower + p * (upper - lower))
            if unit == "mrad":
                self.elements[name].angle = 1e-3 * value
            else:
                self.elements[name].k1 = value
        out = self.segment.track(self.incoming)
        found = [1e6 * float(getattr(out, name)) for name in BEAM]
        for place, axis in ((0, "x"), (2, "y")):
            found[place] -= 1000 * self.quantities[f"screen_{axis}"]
        return found

    def differences_um(self, beam_um):
        """Of this beam from what is wanted."""
        return [value - 1000 * self.quantities[f"goal_{name}"] for value, name in zip(beam_um, BEAM)]

    def seen(self, beam_um):
        """The readings: what a screen of its size can tell of the beam."""
        limits = [limit for half in HALF_SCREEN_UM for limit in (half, half)]
        told = self.differences_um([min(max(value, -limit), limit) for value, limit in zip(beam_um, limits)])
        return [*told, sum(map(abs, told)) / len(told)]

    def capture(self, true_pose, frame_seed):
        rng = random.Random(frame_seed)
        return self.seen([value + self.noise_um * rng.gauss(0, 1) for value in self.beam_um(true_pose)])

    def render_noise_free(self, true_pose):
        return self.seen(self.beam_um(true_pose))

    def score(self, true_pose, seed):
        return sum(map(abs, self.differences_um(self.beam_um(true_pose)))) / len(BEAM), 0.0

    def own_optimum(self, seed):
        """The best pose that a search from several starts finds: least squares, then the score itself by Nelder and Mead."""
        from scipy.optimize import least_squares, minimize
        rng, count = random.Random(seed), len(AXES)
        starts = [NOMINAL_POSE] + [[rng.random() for _ in range(count)] for _ in range(STARTS - 1)]
        found = [least_squares(lambda pose: self.differences_um(self.beam_um(pose)), start, bounds=(0, 1), x_scale=0.1,
                               max_nfev=40).x for start in starts]
        best = min(found, key=lambda pose: self.score(pose, seed)[0])
        polished = minimize(lambda pose: self.score(pose, seed)[0], best, method="Nelder-Mead", bounds=[(0, 1)] * count,
                            options={"maxfev": 200, "initial_simplex": simplex_around(best)}).x
        best = min((best, polished), key=lambda pose: self.score(pose, seed)[0])
        return list(map(float, best)), *self.score(best, seed)


def simplex_around(pose, size=0.01):
    """The pose, and for each axis one beside it within the travel."""
    return [list(pose), *([p + (0 if k != axis else size if p < 0.5 else -size) for k, p in enumerate(pose)]
                          for axis in range(len(pose)))]


class Beam(Scene):
    id = "beam"
    reproducible = "this_cpu"

    noise_um = parameter(3.0, minimum=0.0, maximum=1000.0, unit="um", description="Standard deviation of each beam parameter")

    def describe(self):
        return {
            "name": "beam",
            "summary": "The experimental area of ARES: a beam on a screen by three quadrupoles and two steerers",
            # Magnets ramp within seconds.
            "axes": [{"name": name, "unit": unit, "lower": lower, "upper": upper, "speed_per_s": (upper - lower) / 7.2}
                     for name, unit, lower, upper in AXES],
            "nominal_pose": NOMINAL_POSE,
            "readings": [*({"name": f"{name} off the goal", "unit": "um"} for name in BEAM),
                         {"name": "difference", "unit": "um"}],
            "score": {"name": "beam difference", "unit": "um", "scale": "log", "resolution": 1.0, "reading": "difference"},
            "elements": [],
            "uncertain": [{"name": name, "unit": unit, "meaning": meaning,
                           "law": {"law": "uniform", "lower": low, "upper": high}}
                          for name, (low, high, unit, meaning) in UNCERTAIN.items()],
            "machine_time": {"settle_ms": 1000, "exposure_ms": 100, "readout_ms": 100},
            "spec": {"score": 40.0},
        }

    def reference(self):
        """Of the design, which has the beam that is wanted in its middle."""
        return Area({}, 0.0).render_noise_free(NOMINAL_POSE)

    def mount(self, offsets):
        return Area(uncertain_values(offsets, UNCERTAIN), self.noise_um)


if __name__ == "__main__":
    serve(Beam)
