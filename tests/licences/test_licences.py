"""docs/licences.md lists every dependency: of CMake, of quickstart's build, and of the Python package."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOUND = re.compile(r"^\s*(relign_require|find_package|find_path|find_library|find_file)\(([^)]*)\)", re.M)


def found_by_cmake(text):
    """Names of packages, headers, libraries and files that a CMake file searches for."""
    names = set()
    for call, arguments in FOUND.findall(text):
        words = [word for word in arguments.split() if word != "NAMES"]
        name = words[0] if call in ("relign_require", "find_package") else words[1]
        module = re.search(r"foreach\(module ([\w ]+)\)", text)
        if name.startswith("${"):
            continue  # the body of relign_require
        names |= {name.replace("${module}", one) for one in module[1].split()} if "${module}" in name else {name}
    return names


def shell_array(text, name):
    """Words of an array of a shell script."""
    return re.search(rf"^{name}=\((.*?)\)", text, re.M | re.S)[1].split()


def required_by_python(text):
    """Names of the packages that pyproject.toml asks for."""
    lists = re.findall(r"^(?:requires|dependencies|tables|train|window) = \[(.*?)\]", text, re.M | re.S)
    return {re.match(r"[\w-]+", one)[0] for part in lists for one in re.findall(r'"([^"]+)"', part)}


class Licences(unittest.TestCase):
    def setUp(self):
        self.listed = set(re.findall(r"`([^`]+)`", (ROOT / "docs" / "licences.md").read_text()))

    def check(self, names, source):
        self.assertEqual(sorted(set(names) - self.listed), [], f"{source} uses what docs/licences.md does not list")

    def test_lists_what_cmake_finds(self):
        for file in ("cmake/RelignDependencies.cmake", "python/CMakeLists.txt"):
            names = found_by_cmake((ROOT / file).read_text())
            self.assertGreater(len(names), 1)
            self.check(names, file)

    def test_lists_what_quickstart_installs_for_the_build(self):
        text = (ROOT / "quickstart").read_text()
        self.check(shell_array(text, "build_packages") + shell_array(text, "python_packages"), "quickstart")

    def test_lists_what_the_python_package_requires(self):
        self.check(required_by_python((ROOT / "python" / "pyproject.toml").read_text()), "python/pyproject.toml")


class TheCheckItself(unittest.TestCase):
    def test_finds_every_form(self):
        text = """
        relign_require(One one-dev)
        find_package(${package} ${ARGN} QUIET)
        find_path(VAR two/two.h PATH_SUFFIXES x)
        foreach(module core imgproc)
          find_library(VAR_${module} cv_${module})
        find_file(VAR NAMES three.js
                  PATHS /usr)
        """
        self.assertEqual(found_by_cmake(text), {"One", "two/two.h", "cv_core", "cv_imgproc", "three.js"})

    def test_reads_arrays_and_requirements(self):
        self.assertEqual(shell_array("a=(b c\n  d)\n", "a"), ["b", "c", "d"])
        self.assertEqual(required_by_python('dependencies = ["numpy>=1.24", "x-y"]\n'), {"numpy", "x-y"})


if __name__ == "__main__":
    unittest.main()
