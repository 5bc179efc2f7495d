"""The example of fibre coupling: its physics against an independent integral and closed forms, its scene, its procedure."""

import math
import pathlib
import sys
import unittest

from support import relign_bench

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "fibre"
sys.path.insert(0, str(FOLDER))
import coupling  # noqa: E402
import fibre  # noqa: E402

WAIST = coupling.FIBRE_WAIST_UM
PROCEDURE = str(FOLDER / "procedure.py")


def bench(**parameters):
    return relign_bench.Bench(str(FOLDER / "fibre.py"), "declared", scene_parameters=parameters, threads=1)


class Coupling(unittest.TestCase):
    def test_overlaps_equal_propagated_plane_waves(self):
        cases = ((WAIST, WAIST, 0, 0, 0), (WAIST, WAIST, 30, 2, 0.02), (4, WAIST, 50, 3, -0.03), (6, WAIST, 100, -4, -0.05))
        for case in cases:
            self.assertAlmostEqual(coupling.overlap(*case), coupling.by_quadrature(*case), delta=3e-7, msg=case)

    def test_overlaps_have_the_known_closed_forms(self):
        # Marcuse, Loss analysis of single-mode fiber splices, Bell System Technical Journal 56, 703 (1977), for Gaussian modes.
        overlap, length = coupling.overlap, coupling.WAVELENGTH_UM
        self.assertAlmostEqual(overlap(WAIST, WAIST, 0, 2, 0), math.exp(-((2 / WAIST) ** 2)))
        self.assertAlmostEqual(overlap(WAIST, WAIST, 0, 0, 0.03), math.exp(-((math.pi * WAIST * 0.03 / length) ** 2)))
        self.assertAlmostEqual(overlap(4, WAIST, 0, 0, 0), 2 * 4 * WAIST / (16 + WAIST**2))
        rayleigh = math.pi * WAIST**2 / length
        self.assertAlmostEqual(overlap(WAIST, WAIST, 50, 0, 0) ** 2, 1 / (1 + (50 / (2 * rayleigh)) ** 2))

    def test_behind_a_gap_a_fibre_beside_the_axis_points_along_the_light(self):
        beside = {angle: coupling.overlap(WAIST, WAIST, 80, -3, angle / 1000) for angle in range(-60, 61)}
        self.assertLess(max(beside, key=beside.get), -10)  # light diverges from the facet

    def test_two_glass_facets_lose_a_third_of_a_decibel(self):
        self.assertAlmostEqual(-10 * math.log10(coupling.fresnel()), 0.29, delta=0.005)


class Scene(unittest.TestCase):
    def test_no_pose_of_the_procedure_is_better_than_the_optimum(self):
        for instance in range(3):
            trial = bench().run(PROCEDURE, steps=100, protocol="blind", instance=instance)
            self.assertTrue(trial.ended_well, trial.message)
            best = trial.summary["own_optimum_mse"]
            self.assertLess(best, 0.8)  # decibels
            self.assertGreaterEqual(trial.errors("commanded").min() + 1e-9, best)

    def test_the_optimum_is_that_of_a_search(self):
        end = fibre.End(waist=0.4, facet_x=3.0, facet_y=-2.0, exit_x=0.5, exit_y=-0.3)
        best = end.best()
        most = end.share(*best)
        for axis, step in enumerate((1e-4, 1e-4, 1e-3, 0.05, 0.05)):
            for sign in (-1, 1):
                near = list(best)
                near[axis] += sign * step
                if fibre.AXES[axis][2] <= near[axis] <= fibre.AXES[axis][3]:
                    self.assertLess(end.share(*near), most, (axis, sign))

    def test_far_from_the_facet_it_is_dark(self):
        coupler = fibre.Coupler([fibre.End()])
        corner = [1, 1, 0.5, 0.5, 0.5, 0.5]
        self.assertEqual(coupler.render_noise_free(corner), [60.0])
        self.assertGreater(coupler.capture(corner, 1)[0], 54)
        self.assertEqual(coupler.capture(corner, 1), coupler.capture(corner, 1))

    def test_unknown_quantities_are_refused(self):
        scene = fibre.Fibre.__new__(fibre.Fibre)
        scene.ends = 1
        with self.assertRaisesRegex(ValueError, "unknown quantity 'weist'; quantities: waist, facet_x"):
            scene.mount({"weist": {"value": 1}})


class Procedure(unittest.TestCase):
    def test_it_finds_light_from_nothing_and_climbs(self):
        losses = []
        for instance in range(8):
            trial = bench().run(PROCEDURE, steps=150, protocol="blind", instance=instance)
            self.assertTrue(trial.ended_well, trial.message)
            losses.append(trial.errors()[-1] - trial.summary["own_optimum_mse"])
        self.assertLess(sorted(losses)[4], 0.5)  # decibels

    def test_both_ends_have_twelve_axes(self):
        trial = bench(ends=2).run("home", steps=2)
        self.assertEqual(len(trial.steps[0]["true_pose"]), 12)
        self.assertTrue(trial.ended_well, trial.message)


if __name__ == "__main__":
    unittest.main()
