"""What reports/camera_module/focus.py computes from the MTF of fields."""

import csv
import json
import pathlib
import sys
import unittest
from unittest import mock

from support import np

REPORT = pathlib.Path(__file__).resolve().parents[2] / "reports" / "camera_module"
sys.path.insert(0, str(REPORT))

import focus  # noqa: E402

SUITE = json.loads(focus.SUITE.read_text(encoding="utf-8"))


def slot(level, number=0):
    batch = focus.batch_of(SUITE, level)
    batch.reset([0], [number], "benchmark")
    return batch


class Plane(unittest.TestCase):
    def test_of_a_published_module_is_found_again(self):
        with (REPORT / "focus_modules.csv").open(encoding="utf-8", newline="") as file:
            wanted = next(row for row in csv.DictReader(file) if (row["class"], row["instance"]) == ("precision", "0"))
        design_px, response = focus.design_response(SUITE)
        lens = focus.Lens(slot("precision_piezo"), SUITE, design_px)
        found, foci = focus.plane_of_best_focus(lens, response)
        for value, column in zip(found, ("z_um", "rx_arcmin", "ry_arcmin")):
            self.assertAlmostEqual(value, float(wanted["plane_" + column]), delta=0.02)
        # No move of the lens brings the foci nearer to the sensor.
        self.assertLess(np.abs(np.linalg.lstsq(response, foci, rcond=None)[0]).max(), 0.1)
        # The image is centred there, and the published optimum is not below it.
        centred = lens.fields(found)[:, :2] - design_px
        self.assertLess(np.abs(np.nanmean(centred, axis=0)).max(), 0.05)
        self.assertLess(lens.margin_of(lens.pose(found)), float(wanted["best_margin"]) + 1e-4)


class Criterion(unittest.TestCase):
    def test_tilts_that_cost_are_those_of_a_known_criterion(self):
        # One field of MTF exp(-(u / 8)^2 / 2 - (v / 4)^2 / 2 - (z / 20)^2 / 2), with u and v in minutes of arc.
        rows = focus.powers(focus.REACH[None] * np.random.default_rng(1).uniform(-1, 1, (200, 3)))
        points = focus.REACH * np.random.default_rng(1).uniform(-1, 1, (200, 3))
        curve = -0.5 * (points[:, 1] ** 2 / 64 + points[:, 2] ** 2 / 16 + points[:, 0] ** 2 / 400)
        criterion = focus.Criterion.__new__(focus.Criterion)
        criterion.middle, criterion.limits = np.array([1.0, 2.0, 3.0]), np.array([0.45])
        criterion.coefficients = np.linalg.lstsq(rows, curve, rcond=None)[0][:, None]
        best = criterion.optimum()
        np.testing.assert_allclose(best, [1, 2, 3], atol=0.1)
        costs = criterion.tilts_that_cost(np.array([1.0, 2.0, 3.0]))
        radius = np.sqrt(-2 * np.log(1 - focus.LOSS))
        self.assertAlmostEqual(costs[0], 8 * radius, delta=0.05)
        self.assertAlmostEqual(costs[list(focus.DIRECTIONS).index(90)], 4 * radius, delta=0.05)


class FakeLens:
    """Gaussian curves of 13 fields with known foci, whose MTF can have noise."""

    def __init__(self, response, foci):
        self.response, self.foci, self.noise = response, foci, None

    def fields(self, at):
        mtf = 0.8 * np.exp(-0.5 * ((self.foci + self.response @ at) / 36) ** 2)
        if self.noise is not None:
            mtf = mtf + focus.NOISE * self.noise.normal(size=mtf.shape)
        return np.concatenate([np.zeros((len(mtf) // 2, 2)), mtf.reshape(-1, 2)], axis=1)


class Bounds(unittest.TestCase):
    def test_radius_of_two_equal_errors(self):
        self.assertAlmostEqual(focus.radius_95(np.eye(2)), np.sqrt(-2 * np.log(0.05)), delta=0.02)

    def test_bound_is_the_spread_of_the_most_probable_curves(self):
        rng = np.random.default_rng(2)
        places = np.repeat(rng.uniform(-0.6, 0.6, (13, 2)), 2, axis=0)
        response = np.column_stack([-np.ones(26), places])
        lens = FakeLens(response, rng.normal(0, 8, 26))
        near = (-15, -5, 5, 15, -12, -8, -4)
        bound = focus.mtf_bound(lens, response, np.zeros(3), lens.foci, np.array([20.0, 8, -6]), near)
        # The method's own fit, many times: coefficients of the highest posterior density, then the vertex.
        spread = np.array([0.6, 1.5, 0.15, 0.08, 0.035])
        prior = np.array([-0.5, 0, -0.33, 0, 0])
        start = np.array([20.0, 8, -6])
        images = [start] + [start + [z, 0, 0] for z in (-120, -60, 0, 60, 120)] + [np.array([z, 0, 0]) for z in near]
        lens.noise, fit, planes = rng, np.linalg.pinv(response), []
        for _ in range(300):
            mtf = np.array([lens.fields(image)[:, 2:].ravel() for image in images])
            s = np.array([-(lens.foci + response @ image) / focus.CURVE_REACH for image in images])
            vertices = []
            for i in range(26):
                used = (mtf[:, i] > focus.DIMMEST) & (np.abs(s[:, i]) < 2)
                rows, weights = s[used, i, None] ** np.arange(5), (mtf[used, i] / focus.NOISE) ** 2
                left = np.diag(spread**-2) + (rows.T * weights) @ rows
                c = np.linalg.solve(left, prior / spread**2 + (rows.T * weights) @ np.log(mtf[used, i]))
                vertices.append(-0.5 * c[1] / c[2] * focus.CURVE_REACH)
            planes.append(fit @ vertices)
        np.testing.assert_allclose(np.std(planes, axis=0), np.sqrt(np.diag(bound)), rtol=0.25)

    def test_more_images_and_less_noise_narrow_it(self):
        response = np.column_stack([-np.ones(26), np.random.default_rng(3).uniform(-0.6, 0.6, (26, 2))])
        lens, still = FakeLens(response, np.zeros(26)), np.zeros(3)
        few = focus.mtf_bound(lens, response, still, lens.foci, still, (-15, 15))
        many = focus.mtf_bound(lens, response, still, lens.foci, still, np.linspace(-30, 30, 40))
        self.assertLess(np.trace(many), 0.5 * np.trace(few))
        with mock.patch.object(focus, "NOISE", 0.5 * focus.NOISE):
            quiet = focus.mtf_bound(lens, response, still, lens.foci, still, np.linspace(-30, 30, 40))
        self.assertLess(np.trace(quiet), 0.5 * np.trace(many))


if __name__ == "__main__":
    unittest.main()
