"""Version numbers agree: CMake, Python package, citation, and file names in docs/packages.md. See docs/releasing.md."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def found(file, pattern):
    """The first group of every match in a file of the tree."""
    return re.findall(pattern, (ROOT / file).read_text(), re.M)


class Release(unittest.TestCase):
    def test_versions_agree(self):
        (version,) = found("CMakeLists.txt", r"^project\(relign-bench VERSION (\S+)")
        self.assertRegex(version, r"^\d+\.\d+\.\d+$")
        for file, pattern in (
            ("python/pyproject.toml", r'^version = "(.*)"'),
            ("CITATION.cff", r"^version: (\S+)"),
            ("docs/packages.md", r"relign[-_]bench[-_](\d[\d.]*\d)[-_]"),
        ):
            self.assertEqual(set(found(file, pattern)), {version}, file)

    def test_changelog_begins_with_the_version(self):
        (version,) = found("CMakeLists.txt", r"^project\(relign-bench VERSION (\S+)")
        self.assertRegex(found("CHANGELOG.md", r"^## (.*)")[0], rf"^{re.escape(version)}\b.*$")


if __name__ == "__main__":
    unittest.main()
