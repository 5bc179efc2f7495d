"""Python sources: lint by ruff, types of the package by mypy, and syntax of the oldest Python that is supported.

The rules are in python/pyproject.toml, the versions of both tools in requirements.txt. Tests of a tool that is not installed in
this version are skipped; `./quickstart test` installs both into .python/.
"""

import ast
import functools
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SETTINGS = ROOT / "python" / "pyproject.toml"
PACKAGE = ROOT / "python" / "relign_bench"
SCRIPTS = (".ci/tidy", "core/plugin_api", "docs/site", "examples", "python/build_wheel.py", "reports/paper",
           "templates", "tests/format", "tests/licences", "tests/peers", "tests/python", "tests/python_style",
           "tests/release", "tests/workflows")
OLDEST = (3, 9)
PYTHONS = (ROOT / ".python" / "bin" / "python", pathlib.Path(sys.executable))


def output_of(*command, **keywords):
    """Exit status and output, of both streams."""
    done = subprocess.run([str(word) for word in command], text=True, check=False, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, **keywords)
    return done.returncode, done.stdout


@functools.cache
def tool(name, *packages):
    """The command that runs the pinned version of a tool, with an interpreter that has these packages.

    Raises:
        unittest.SkipTest: No interpreter has them.
    """
    version = re.search(rf"^{name}==(\S+)$", (pathlib.Path(__file__).parent / "requirements.txt").read_text(), re.M)[1]
    for python in PYTHONS:
        if not python.is_file():
            continue
        status, output = output_of(python, "-m", name, "--version")
        if status != 0 or version not in output.split():
            continue
        if output_of(python, "-c", f"import {', '.join(('sys', *packages))}")[0] == 0:
            return python, "-m", name
    needed = ", ".join([f"{name} {version}", *packages])
    raise unittest.SkipTest(f"not installed: {needed} (./quickstart test installs them into .python/)")


def ruff(*arguments):
    return output_of(*tool("ruff"), "check", "--no-cache", "--output-format", "concise", "--config", SETTINGS, *arguments,
                     cwd=ROOT)


def mypy(*arguments):
    with tempfile.TemporaryDirectory() as scratch:
        cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME", scratch)) / "mypy"
        return output_of(*tool("mypy", "numpy", "gymnasium"), "--config-file", SETTINGS, "--cache-dir", cache, *arguments,
                         cwd=ROOT / "python")


class Style(unittest.TestCase):
    def test_package_passes_ruff(self):
        status, output = ruff(PACKAGE)
        self.assertEqual(status, 0, output)

    def test_scripts_and_tests_pass_ruff(self):
        status, output = ruff("--extend-ignore", "D", *SCRIPTS)
        self.assertEqual(status, 0, output)

    def test_package_passes_mypy(self):
        status, output = mypy()
        self.assertEqual(status, 0, output)

    def test_package_templates_and_examples_parse_as_the_oldest_python(self):
        files = [file for folder in ("python/relign_bench", "templates", "examples") for file in (ROOT / folder).rglob("*.py")]
        self.assertGreater(len(files), 40)
        for file in files:
            with self.subTest(str(file.relative_to(ROOT))):
                ast.parse(file.read_text(), feature_version=OLDEST)

    def test_settings_in_documents_exist(self):
        def settings_of(name):
            parsed = ast.parse((PACKAGE / "training" / f"{name}.py").read_text())
            recipe = next(node for node in parsed.body if isinstance(node, ast.ClassDef) and node.name == "Recipe")
            return {field.target.id for field in recipe.body if isinstance(field, ast.AnnAssign)}

        # Scenes with a score of their own have recipes of their own.
        known = {"imitate": settings_of("imitate") | settings_of("remember"),
                 "ppo": settings_of("recipe") | settings_of("rewarded"), "adapt": settings_of("adapt")}
        found = 0
        for file in (path for path in ROOT.rglob("*.md") if not {"build", ".python"} & set(path.relative_to(ROOT).parts)):
            commands = re.findall(r"relign-train (imitate|ppo|adapt)\b((?:\\\n|[^`\n])*)", file.read_text())
            for verb, rest in commands:
                for name in re.findall(r"--set ([a-z_]+)=", rest):
                    self.assertIn(name, known[verb], f"{file.relative_to(ROOT)}: relign-train {verb}{rest}")
                    found += 1
        self.assertGreater(found, 10)

    def test_oldest_python_is_the_same_everywhere(self):
        oldest = "3.9"
        settings = SETTINGS.read_text()
        self.assertIn(f'requires-python = ">={oldest}"', settings)
        self.assertIn(f'target-version = "py{oldest.replace(".", "")}"', settings)
        self.assertEqual(".".join(map(str, OLDEST)), oldest)


class TheChecksThemselves(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "sample.py"

    def test_ruff_reports_an_unused_import_and_a_missing_docstring(self):
        self.file.write_text("import os\n\n\ndef public():\n    pass\n")
        status, output = ruff(self.file)
        self.assertEqual(status, 1, output)
        for code in ("F401", "D100", "D103"):
            self.assertIn(code, output)

    def test_mypy_reports_a_wrong_type_and_a_missing_hint(self):
        self.file.write_text('from relign_bench.plugin import Box\n\nBox(1, 2)\n\n\ndef public(x):\n    return x\n')
        status, output = mypy(self.file)
        self.assertEqual(status, 1, output)
        for code in ("arg-type", "no-untyped-def"):
            self.assertIn(code, output)


if __name__ == "__main__":
    unittest.main()
