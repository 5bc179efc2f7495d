"""docs/site/check.py finds what is wrong with a built site: version, social card, links, anchors."""

import importlib.util
import pathlib
import shutil
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPEC = importlib.util.spec_from_file_location("check", ROOT / "docs" / "site" / "check.py")
CHECK = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(CHECK)
META = "".join(f'<meta property="{tag}" content="docs/images/card.png">' for tag in CHECK.TAGS)
FOOTER = '<div class="md-copyright__highlight">relign-bench 1.2.3 </div>'


class SiteCheck(unittest.TestCase):
    def found(self, text, versions='[{"version": "1.2.3"}]', card=True):
        """What the check reports for a site of one page."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name, "1.2.3")
            (folder / "docs" / "images").mkdir(parents=True)
            if card:
                shutil.copy(ROOT / "docs" / "images" / "card.png", folder / "docs" / "images")
            (folder / "index.html").write_text(text)
            (folder.parent / "versions.json").write_text(versions)
            return list(CHECK.mistakes(folder, "1.2.3"))

    def test_accepts_a_complete_page(self):
        self.assertEqual(self.found(META + '<p id="a"><a href="#a">x</a>' + FOOTER), [])

    def test_finds_each_mistake(self):
        good = META + FOOTER
        for text, expected in ((META, "version 1.2.3 is missing"),
                               (good.replace("1.2.3", "1.2.30"), "version 1.2.3 is missing"),
                               (FOOTER, "og:image is missing"), (good + '<a href="none/">', "none, which does not exist"),
                               (good + '<a href="#none">', "#none, which does not exist")):
            found = self.found(text)
            self.assertTrue(any(expected in line for line in found), (expected, found))
        self.assertEqual(len(self.found(good, versions="[]")), 1)
        self.assertIn("not a PNG of 1200 x 630", self.found(good, card=False)[-1])


if __name__ == "__main__":
    unittest.main()
