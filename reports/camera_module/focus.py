"""The plane of best focus of every module, what a tilt costs, and how far from both the methods end: see README.md.

    python3 reports/camera_module/focus.py modules [COUNT]    adds missing modules to focus_modules.csv
    python3 reports/camera_module/focus.py bounds [COUNT]     adds missing modules to focus_bounds.csv
    python3 reports/camera_module/focus.py trials FOLDER...   writes focus_trials.csv, from results of suites/camera_focus.json

They compute without noise, from rays (`Batch.fields_at`), a module in about 10 s, and need the package relign_bench and NumPy.

A focus is z in micrometres and the tilts about x and y in minutes of arc, from the nominal pose. x and y follow from centring.
"""

import csv
import json
import pathlib
import sys

import numpy as np

from relign_bench import Batch
from relign_bench.results import read_trials

HERE = pathlib.Path(__file__).resolve().parent
TREE = HERE.parents[1]
SUITE = TREE / "suites" / "camera_focus.json"
CLASSES = {"commercial": "commercial_piezo", "precision": "precision_piezo"}  # the same lenses on both stages
COLUMNS = ("x_um", "y_um", "z_um", "rx_arcmin", "ry_arcmin")
LOSS = 0.01  # of MTF
DEGREE, REACH = 4, np.array([18.0, 13.0, 13.0])  # of the polynomials of log MTF: um, arcmin, arcmin
FARTHEST = 13.0  # arcmin
DIRECTIONS = np.arange(0, 360, 10)
# Of bounds by MTF (plugins/agents/field_focus): noise of the mean of two edges, the dimmest MTF used, um of a unit of curves.
NOISE, DIMMEST, CURVE_REACH = 0.0135, 0.2, 30.0
NEAR = {  # images about the plane after six of the start and the sweep: z in um
    "8": (-15, 15), "13": (-15, -5, 5, 15, -12, -8, -4), "13-spread": tuple(np.linspace(-30, 30, 7)),
    "26-spread": tuple(np.linspace(-30, 30, 20)), "52-spread": tuple(np.linspace(-30, 30, 46)),
}  # fmt: skip
PIXEL_Z, PIXEL_MODULES = (-15, 0, 15), 1


class Lens:
    """The lens in a slot of a batch: MTF of its fields by focus."""

    def __init__(self, batch, suite, design_px=None):
        self.batch, self.spec = batch, suite["spec"]["field_mtf"]
        travel = np.array([axis["upper"] - axis["lower"] for axis in batch.description["axes"]])
        self.travel = travel * np.where([axis["unit"] == "mm" for axis in batch.description["axes"]], 1000, 60)
        self.xy = np.zeros(2)
        self.design_px = self.fields(np.zeros(3))[:, :2] if design_px is None else design_px

    def pose(self, focus):
        return self.batch.nominal_pose + np.concatenate([self.xy, focus]) / self.travel

    def focus(self, pose):
        """x and y, then the focus, of a pose: five numbers in micrometres and minutes of arc."""
        return (np.asarray(pose) - self.batch.nominal_pose) * self.travel

    def fields_of(self, pose, frequency=None):
        return self.batch.fields_at([0], [pose], frequency or self.spec["lp_per_mm"])[0]

    def fields(self, focus, frequency=None):
        return self.fields_of(self.pose(focus), frequency)

    def centre(self, focus):
        """Sets x and y so that the image is where the design's is, on average over the fields."""

        def shift():
            return np.nanmean(self.fields(focus)[:, :2] - self.design_px, axis=0)

        for _ in range(2):
            here, response = shift(), []
            for axis in range(2):
                self.xy[axis] += 20
                response.append((shift() - here) / 20)
                self.xy[axis] -= 20
            self.xy = self.xy - np.linalg.solve(np.transpose(response), here)

    def foci(self, focus, half_um, step_um, frequency=None):
        """How far above `focus` every field and direction is sharpest, in micrometres of z: shape (2 * fields,).

        The vertex of the parabola through the logarithms of the highest MTF of a sweep and its neighbours.
        """
        sweep = np.arange(-half_um, half_um + step_um / 2, step_um)
        curves = np.array([self.fields(focus + [z, 0, 0], frequency)[:, 2:].ravel() for z in sweep])
        top = curves.argmax(axis=0)
        if ((top == 0) | (top == len(sweep) - 1)).any():
            raise ValueError(f"a field is sharpest more than {half_um} um from {focus}; sweep farther")
        low, mid, high = (np.log(curves[top + k, np.arange(curves.shape[1])]) for k in (-1, 0, 1))
        return sweep[top] + 0.5 * step_um * (low - high) / (low - 2 * mid + high)

    def limits(self):
        """Index of every field and direction that the specification limits, in the order of `foci`, and its limit."""
        names = [field["name"] for field in self.batch.description["fields"]]
        which, limits = [], []
        for given in self.spec["fields"]:
            field = {**self.spec, **(given if isinstance(given, dict) else {"name": given})}
            for k, direction in enumerate(("tangential", "sagittal")):
                which.append(2 * names.index(field["name"]) + k)
                limits.append(field[direction])
        return np.array(which), np.array(limits)

    def margin_of(self, pose):
        """MTF of the worst field above its limit: the criterion."""
        which, limits = self.limits()
        return float((self.fields_of(pose)[:, 2:].ravel()[which] - limits).min())


def batch_of(suite, level):
    scene = suite["scenes"][0]
    name = level if level == "rho0" else str(TREE / "suites" / "camera_module" / f"{level}.json")
    return Batch(1, scene["use"], name, suite_seed=suite["seed"], scene_parameters=scene["parameters"], threads=1)


def design_response(suite):
    """Places of the fields in the design's image, and the change of `foci` with the focus, shape (2 * fields, 3)."""
    batch = batch_of(suite, "rho0")
    batch.reset([0], [0], "benchmark")
    lens = Lens(batch, suite)
    columns = [-np.ones(2 * len(lens.design_px))]
    for tilt in np.array([[0.0, 10, 0], [0, 0, 10]]):
        columns.append((lens.foci(tilt, 90, 3) - lens.foci(-tilt, 90, 3)) / 20)
    return lens.design_px, np.transpose(columns)


def plane_of_best_focus(lens, response):
    """The focus whose plane is nearest to the best foci of all fields and directions, by least squares; these foci.

    Sets the lens's x and y there.
    """
    focus = np.zeros(3)
    for half_um, step_um, share in ((480, 20, 0.25), (240, 12, 0.5), (150, 6, 1), (150, 3, 1), (150, 3, 1)):
        lens.centre(focus)
        foci = lens.foci(focus, half_um, step_um, share * lens.spec["lp_per_mm"])
        focus = focus - np.linalg.lstsq(response, foci, rcond=None)[0]
    lens.centre(focus)
    return focus, lens.foci(focus, 150, 3)


def powers(points):
    """Monomials up to DEGREE of points, shape (n, 3), scaled by REACH: shape (n, terms)."""
    exponents = [(i, j, k) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i) for k in range(DEGREE + 1 - i - j)]
    s = np.asarray(points) / REACH
    table = [np.ones_like(s)]
    for _ in range(DEGREE):
        table.append(table[-1] * s)
    return np.stack([table[i][:, 0] * table[j][:, 1] * table[k][:, 2] for i, j, k in exponents], axis=1)


class Criterion:
    """The criterion near a focus: polynomials of log MTF of all limited fields, fitted to noise-free evaluations."""

    def __init__(self, lens, middle):
        self.middle = middle
        self.which, self.limits = lens.limits()
        ends = np.cos(np.pi * (np.arange(5) + 0.5) / 5)
        grid = np.array([[z, u, v] for z in ends for u in ends for v in ends]) * REACH
        mtf = np.array([lens.fields(middle + point)[:, 2:].ravel()[self.which] for point in grid])
        rows = powers(grid)
        self.coefficients = np.linalg.lstsq(rows, np.log(np.maximum(mtf, 1e-3)), rcond=None)[0]
        # Where the criterion is decided; the polynomials may miss more elsewhere.
        near = np.linalg.norm(grid / REACH, axis=1) < 1
        wrong = (np.exp(rows @ self.coefficients) - self.limits).min(axis=1) - (mtf - self.limits).min(axis=1)
        self.error = float(np.sqrt(np.mean(wrong[near] ** 2)))

    def margin(self, focuses):
        return (np.exp(powers(focuses - self.middle) @ self.coefficients) - self.limits).min(axis=1)

    def optimum(self):
        """The focus of the highest margin: a compass search, as the criterion has kinks."""
        ways = np.array([[i, j, k] for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]) * REACH
        best, stride = self.middle.copy(), 0.2
        rng = np.random.default_rng(1)
        while stride > 2e-4:
            tried = best + stride * np.concatenate([ways, REACH * rng.uniform(-1, 1, (200, 3))])
            tried = np.clip(tried, self.middle - REACH, self.middle + REACH)
            values = self.margin(tried)
            if values.max() > self.margin(best[None])[0]:
                best = tried[values.argmax()]
            else:
                stride *= 0.5
        return best

    def tilts_that_cost(self, best):
        """For each of DIRECTIONS the tilt in minutes of arc from `best` that costs LOSS with z at its best there.

        FARTHEST where none up to it does.
        """
        z = np.arange(-12, 12.1, 0.5)
        radii = np.arange(0.5, FARTHEST + 0.1, 0.5)
        top, found = self.margin(best[None])[0], []
        for angle in np.radians(DIRECTIONS):
            steps = np.array([[dz, r * np.cos(angle), r * np.sin(angle)] for r in radii for dz in z])
            loss = top - self.margin(best + steps).reshape(len(radii), len(z)).max(axis=1)
            over = np.flatnonzero(loss >= LOSS)
            if not len(over):
                found.append(FARTHEST)
                continue
            k = over[0]
            before = (radii[k - 1], loss[k - 1]) if k else (0.0, 0.0)
            share = (LOSS - before[1]) / (loss[k] - before[1])
            found.append(before[0] + share * (radii[k] - before[0]))
        return np.array(found)


def write(name, rows):
    with (HERE / name).open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def read(name):
    with (HERE / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def read_known(name):
    """The rows of a file, if it is there, and which modules they are."""
    rows = read(name) if (HERE / name).exists() else []
    return rows, {(row["class"], int(row["instance"])) for row in rows}


def numbers(prefix, values):
    return {f"{prefix}{name}": f"{value:.3f}" for name, value in zip(COLUMNS, values)}


def module_row(lens, response, name, number):
    focus, foci = plane_of_best_focus(lens, response)
    plane = np.concatenate([lens.xy, focus])
    which, _ = lens.limits()
    by_spec = -np.linalg.lstsq(response[which], foci[which], rcond=None)[0]
    criterion = Criterion(lens, focus)
    best = criterion.optimum()
    criterion = Criterion(lens, best)
    best = criterion.optimum()
    costs = criterion.tilts_that_cost(best)
    lens.centre(best)
    return {
        "class": name, "instance": number, **numbers("plane_", plane), "foci_rms_um": f"{np.std(foci):.2f}",
        "spec_fields_tilt_arcmin": f"{np.hypot(*by_spec[1:]):.3f}", **numbers("best_", np.concatenate([lens.xy, best])),
        "best_margin": f"{lens.margin_of(lens.pose(best)):.4f}", "polynomial_error": f"{criterion.error:.4f}",
        **{f"cost_{angle}": f"{cost:.2f}" for angle, cost in zip(DIRECTIONS, costs)},
    }  # fmt: skip


def modules(count):
    suite = json.loads(SUITE.read_text(encoding="utf-8"))
    design_px, response = design_response(suite)
    rows, known = read_known("focus_modules.csv")
    for name, level in CLASSES.items():
        batch = batch_of(suite, level)
        for number in range(count):
            if (name, number) in known:
                continue
            batch.reset([0], [number], "benchmark")
            rows.append(module_row(Lens(batch, suite, design_px), response, name, number))
            print(name, number, file=sys.stderr)
            write("focus_modules.csv", rows)


def trial_row(lens, closing, steps, module, cure_shift):
    """Where a trial ended, before and after curing, against the module's plane and its criterion's optimum."""
    glued = np.array(steps[-1]["recommended_true_pose"])
    row = {name: closing[name] for name in ("trial", "noise_level", "algorithm", "instance")} | {"images": len(steps)}
    for when, pose in (("before", glued - cure_shift), ("after", glued)):
        for target in ("plane", "best"):
            away = lens.focus(pose) - [float(module[f"{target}_{column}"]) for column in COLUMNS]
            row[f"{when}_{target}_um"] = f"{np.linalg.norm(away[:3]):.3f}"
            row[f"{when}_{target}_z_um"] = f"{away[2]:.3f}"
            row[f"{when}_{target}_arcmin"] = f"{np.linalg.norm(away[3:]):.3f}"
        angle = np.degrees(np.arctan2(away[4], away[3]))
        cost = [float(module[f"cost_{direction}"]) for direction in DIRECTIONS]
        row[f"{when}_cost_arcmin"] = f"{np.interp(angle, DIRECTIONS, cost, period=360):.3f}"
        row[f"{when}_loss"] = f"{float(module['best_margin']) - lens.margin_of(pose):.4f}"
    return row


def trials(folders):
    suite = json.loads(SUITE.read_text(encoding="utf-8"))
    table = {(row["class"], row["instance"]): row for row in read("focus_modules.csv")}
    methods = [method["name"] for method in suite["algorithms"]]  # not the references that every run has
    found = {closing["trial"]: (closing, steps) for folder in folders for closing, steps in read_trials(folder)
             if closing["algorithm"] in methods}  # fmt: skip
    rows, batches = [], {}
    for closing, steps in sorted(found.values(), key=lambda trial: (trial[0]["noise_level"], trial[0]["instance"])):
        level, number = closing["noise_level"], closing["instance"]
        if level not in batches:
            batches[level] = batch_of(suite, level.replace(", ", "_"))
        batch = batches[level]
        batch.reset([0], [number], "benchmark")
        lens = Lens(batch, suite, np.zeros((len(batch.description["fields"]), 2)))
        module = table[level.split(",")[0], str(number)]
        rows.append(trial_row(lens, closing, steps, module, batch.instance(0)["cure_shift"]))
    rows.sort(key=lambda row: (row["noise_level"], methods.index(row["algorithm"])))
    write("focus_trials.csv", rows)


def mtf_bound(lens, response, focus, foci, start, near):
    """Covariance of z and tilts of the plane of best focus from the MTF of the images that field-focus takes.

    Log MTF of every field and direction is a polynomial about its own best focus, with the spread of coefficients over
    lenses as prior (focus_curves.cpp); nothing is assumed between fields. Noise of MTF as measured. `near`: z of the images
    about the plane.
    """
    sweep = [np.zeros(3)] + [np.array([z, 0, 0]) for z in (-120, -60, 0, 60, 120)]
    images = [start - focus + step for step in sweep] + [np.array([z, 0, 0]) for z in near]
    spread = np.array([0.6, 1.5, 0.15, 0.08, 0.035])
    information = np.repeat(np.diag(spread**-2)[None], len(foci), axis=0)
    for away in images:
        s = -(foci + response @ away) / CURVE_REACH
        mtf = lens.fields(focus + away)[:, 2:].ravel()
        weights = np.where((mtf > DIMMEST) & (np.abs(s) < 2), mtf / NOISE, 0) ** 2
        rows = s[:, None] ** np.arange(5)
        information += weights[:, None, None] * rows[:, :, None] * rows[:, None, :]
    # The curvature at the peaks, from noise-free MTF around them.
    offsets = np.arange(-30, 31, 10.0)
    curves = np.array([[lens.fields(focus + [own + z, 0, 0])[:, 2:].ravel()[i] for i, own in enumerate(foci)] for z in offsets])
    curvature = 2 * np.polyfit(offsets / CURVE_REACH, np.log(curves), 4)[2]
    variances = np.linalg.inv(information)[:, 1, 1] * (CURVE_REACH / curvature) ** 2
    fit = np.linalg.pinv(response)
    return fit * variances @ fit.T


def radius_95(covariance):
    """Radius that 95 % of the errors of two tilts with this covariance stay within."""
    draws = np.random.default_rng(1).multivariate_normal(np.zeros(2), covariance, 100_000)
    return float(np.quantile(np.hypot(*draws.T), 0.95))


def pixel_bound(lens, focus, response, samples=16):
    """Covariance of the plane's z and tilts from the pixels of one image at `focus`, with blur known but for its defocus.

    In the window of each field the defocus and both shifts are unknown: the Fisher information of these three.
    """
    batch, pose = lens.batch, lens.pose(focus)
    first, second = batch.capture_at([0], [pose], [1])[0], batch.capture_at([0], [pose], [2])[0]
    slopes = [batch.derivatives_at([0], [pose], [seed], samples)[1][0] for seed in (3, 4)]
    mean, half = 0.5 * (first + second), 0.5 * (first - second) ** 2
    lit = mean > 0
    slope, dark = np.polyfit(mean[lit], half[lit], 1)
    weights = np.where(lit, 1 / np.maximum(dark + slope * mean, 0.1 * half[lit].mean()), 0)
    variances = []
    for field in batch.description["fields"]:
        x, y = int(field["mark"]["x_px"]), int(field["mark"]["y_px"])
        part = np.s_[max(0, y - 128) : y + 128, max(0, x - 128) : x + 128]
        one, other = (np.array([s[axis][part].ravel() / lens.travel[axis] for axis in range(3)]) for s in slopes)
        # Two independent estimates of the derivatives: their noise averages out of the product.
        information = (one * weights[part].ravel()) @ other.T
        variances.append(np.linalg.inv(0.5 * (information + information.T))[2, 2])
    # One defocus a field: the mean of both directions.
    fit = np.linalg.pinv(0.5 * (response[0::2] + response[1::2]))
    return fit * variances @ fit.T


def bounds(count):
    suite = json.loads(SUITE.read_text(encoding="utf-8"))
    design_px, response = design_response(suite)
    rows, known = read_known("focus_bounds.csv")
    batches = {name: batch_of(suite, level) for name, level in CLASSES.items()}
    for number in range(count):
        for name, batch in batches.items():
            if (name, number) in known:
                continue
            batch.reset([0], [number], "benchmark")
            lens = Lens(batch, suite, design_px)
            focus, foci = plane_of_best_focus(lens, response)
            start = lens.focus(batch.instance(0)["start"])[2:]
            row = {"class": name, "instance": number}
            for images, near in NEAR.items():
                covariance = mtf_bound(lens, response, focus, foci, start, near)
                row |= {f"mtf_{images}_z_um": f"{covariance[0, 0] ** 0.5:.3f}",
                        f"mtf_{images}_r95_arcmin": f"{radius_95(covariance[1:, 1:]):.3f}"}  # fmt: skip
            for z in PIXEL_Z if number < PIXEL_MODULES else ():
                covariance = pixel_bound(lens, focus + [z, 0, 0], response)
                row |= {f"pixels_{z}_z_um": f"{covariance[0, 0] ** 0.5:.4f}",
                        f"pixels_{z}_r95_arcmin": f"{radius_95(covariance[1:, 1:]):.4f}"}  # fmt: skip
            rows.append({**dict.fromkeys(rows[0] if rows else row, ""), **row})
            print(name, number, file=sys.stderr)
            write("focus_bounds.csv", rows)


if __name__ == "__main__":
    command, *given = sys.argv[1:]
    if command == "modules":
        modules(int(given[0]) if given else 25)
    elif command == "bounds":
        bounds(int(given[0]) if given else 25)
    elif command == "trials":
        trials(given)
    else:
        sys.exit(f"unknown command '{command}'; commands: modules, bounds, trials")
