"""What notebooks show of scenes, instances, trials and results."""

import base64
import io
import pathlib
import re
import shutil
import tempfile
import unittest
from xml.etree import ElementTree

from support import SMALL, np

from relign_bench import Bench, Results, _html

GOLDEN = pathlib.Path(__file__).parents[1] / "golden" / "report" / "small"


class Shown(unittest.TestCase):
    def parsed(self, text):
        """The page's element; fails where it is not well formed, or prints a value that is not a number."""
        self.assertNotIn("nan", re.sub(r'src="[^"]*"', "", text).lower().replace("dominant", ""))
        return ElementTree.fromstring(f"<body>{text}</body>".replace('xmlns="http://www.w3.org/2000/svg"', ""))

    def test_scene_and_instance_show_their_images(self):
        bench = Bench(**SMALL)
        instance = bench.instance(2)
        before = instance.true_pose
        self.assertEqual(len(self.parsed(bench._repr_html_()).findall(".//img")), 1)
        page = self.parsed(instance._repr_html_())
        self.assertEqual([caption.text for caption in page.iter("figcaption")], ["capture at the present pose", "reference"])
        self.assertIn("L4", "".join(page.itertext()))
        np.testing.assert_array_equal(instance.true_pose, before)

    def test_trial_shows_a_curve_per_error(self):
        trial = Bench("gaussian_spot", "rho0").run("random", steps=4, keep_frames=True)
        page = self.parsed(trial._repr_html_())
        lines = page.findall(".//polyline")
        self.assertEqual([len(line.get("points").split()) for line in lines], [5, 5, 5])
        heights = [float(point.split(",")[1]) for point in lines[0].get("points").split()]
        order, errors = np.argsort(heights, kind="stable"), trial.errors()
        self.assertTrue((np.diff(errors[order]) <= 0).all(), "lower on the page is a lower error")
        self.assertEqual(len(page.findall(".//img")), 2)

    def test_failed_trial_shows_its_message_escaped(self):
        trial = Bench("gaussian_spot", "rho0").run("random", steps=1)
        trial.summary.update(end="failed", message='<script>alert("x")</script>', algorithm="<b>&")
        for step in trial.steps:  # as of a station
            step.update(commanded_mse=None, recommended_mse=None)
        page = self.parsed(trial._repr_html_())
        self.assertEqual(page.findall(".//script") + page.findall(".//b"), [])
        self.assertIn('<script>alert("x")</script>', "".join(page.itertext()))
        self.assertEqual(len(page.findall(".//polyline")), 1)

    def test_results_show_a_curve_per_method_or_how_to_get_it(self):
        with tempfile.TemporaryDirectory() as place:
            folder = pathlib.Path(place) / "results"
            shutil.copytree(GOLDEN, folder)
            self.assertIn("relign-bench report", "".join(self.parsed(Results(folder)._repr_html_()).itertext()))
            head = ("scene,noise_level,protocol,algorithm,step,n,"
                    "recommended_median,recommended_q25,recommended_q75,best_median\n")
            rows = "s,l,paper,<i>worse,0,3,0.2,0.1,0.3,1\ns,l,paper,<i>worse,1,3,0.1,,,1\ns,l,paper,better,0,3,0.2,0.1,0.3,1\n"
            (folder / "curves.csv").write_text(head + rows + "s,l,paper,better,1,3,0.01,0.005,0.02,1\n")
            page = self.parsed(Results(folder)._repr_html_())
            self.assertEqual([[cell.text for cell in row] for row in page.iter("tr")][1:],
                             [["better", "3", "0.01", "0.005", "0.02"], ["<i>worse", "3", "0.1", "–", "–"]])
            self.assertEqual((len(page.findall(".//polyline")), len(page.findall(".//polygon"))), (2, 2))

    def test_damaged_results_are_refused(self):
        with tempfile.TemporaryDirectory() as place:
            (pathlib.Path(place) / "manifest.json").write_text('{"suite_name": "s", "instances": 3}')
            with self.assertRaisesRegex(ValueError, "manifest.json' is damaged: it has no 'scenes'; restore it from a copy"):
                Results(place)._repr_html_()

    def test_images_are_png(self):
        try:
            import pygame
        except ImportError:
            self.skipTest("pygame is not installed")
        image = np.linspace(0, 2, 6, dtype=np.float32).reshape(2, 3)
        data = base64.b64decode(re.search("base64,([^\"]+)", _html.images([("one", image)], white=2))[1])
        read = pygame.surfarray.array3d(pygame.image.load(io.BytesIO(data), "image.png"))
        np.testing.assert_array_equal(read[:, :, 0].T, [[0, 51, 102], [153, 204, 255]])

    def test_large_images_become_small(self):
        text = _html.images([("large", np.ones((1280, 1920), np.float32))])
        self.assertLess(len(text), 2000)
        self.assertIn('width="240"', text)


if __name__ == "__main__":
    unittest.main()
