"""Places and MTF of fields from Python."""

import unittest

from support import np, relign_bench


class Fields(unittest.TestCase):
    def test_of_the_design_are_on_their_marks_and_blur_out_of_focus(self):
        batch = relign_bench.Batch(1, "camera_2mp", "rho0", scene_parameters={"windows": 256}, threads=1)
        batch.reset([0], [0])
        marks = [[field["mark"]["x_px"], field["mark"]["y_px"]] for field in batch.description["fields"]]
        sharp = batch.fields_at([0], [batch.nominal_pose], 41.7)[0]
        self.assertEqual(sharp.shape, (13, 4))
        self.assertLess(np.abs(sharp[:, :2] - marks).max(), 1)
        self.assertGreater(sharp[:, 2:].min(), 0.4)
        blurred = batch.fields_at([0], [batch.nominal_pose + [0, 0, 0.1, 0, 0]], 41.7)[0]
        self.assertLess(blurred[:, 2:].max(), 0.4)
        self.assertGreater(batch.fields_at([0], [batch.nominal_pose], 5)[0][:, 2:].min(), 0.98)

    def test_mistakes(self):
        batch = relign_bench.Batch(1, "relign_od", "rho0", size=40)
        with self.assertRaisesRegex(ValueError, "no lens yet"):
            batch.fields_at([0], [batch.nominal_pose], 20)
        batch.reset([0], [0])
        for arguments, message in (
            (([0], [batch.nominal_pose], 20), "scene 'relign_od' has no fields"),
            (([0], [batch.nominal_pose], 0), "expected a positive number"),
            (([0], [batch.nominal_pose], float("nan")), "expected a positive number"),
            (([0], [batch.nominal_pose + 1], 20), "outside"),
            (([0], [batch.nominal_pose[:2]], 20), "poses"),
        ):
            with self.subTest(message=message), self.assertRaisesRegex(ValueError, message):
                batch.fields_at(*arguments)


if __name__ == "__main__":
    unittest.main()
