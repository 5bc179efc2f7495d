"""C and C++ sources are formatted by clang-format (.clang-format).

The version is that of requirements.txt, because versions differ; `./quickstart test` installs it into .python/. The package
clang-format of Debian 12 has the same version.
"""

import functools
import pathlib
import re
import shutil
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("benchmarks", "core", "examples", "plugins", "python/src", "templates", "tests")
SUFFIXES = {".c", ".cpp", ".h", ".hpp"}


def sources():
    """Every C and C++ file of the tree."""
    return sorted(file for folder in FOLDERS for file in (ROOT / folder).rglob("*") if file.suffix in SUFFIXES)


@functools.cache
def clang_format():
    """Path of clang-format in the pinned version.

    Raises:
        unittest.SkipTest: It is not installed.
    """
    wanted = re.search(r"^clang-format==(\S+)$", (pathlib.Path(__file__).parent / "requirements.txt").read_text(), re.M)[1]
    for name in (str(ROOT / ".python" / "bin" / "clang-format"), "clang-format", f"clang-format-{wanted.split('.')[0]}"):
        if path := shutil.which(name):
            version = subprocess.run([path, "--version"], capture_output=True, text=True, check=False).stdout
            if re.search(rf"version {re.escape(wanted)}\b", version):
                return path
    raise unittest.SkipTest(f"clang-format {wanted} is not installed (./quickstart test installs it into .python/)")


def check(*files, **keywords):
    """Exit status and complaints of clang-format."""
    done = subprocess.run([clang_format(), "--dry-run", "-Werror", *files], cwd=ROOT, text=True, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **keywords)
    return done.returncode, done.stdout


class Format(unittest.TestCase):
    def test_sources_are_formatted(self):
        files = sources()
        self.assertGreater(len(files), 500)
        status, output = check(*files)
        places = sorted({line for line in output.splitlines() if "clang-format-violations" in line})
        self.assertEqual(status, 0, "run clang-format -i on these files:\n" + "\n".join(places or [output]))


class TheCheckItself(unittest.TestCase):
    def test_rejects_another_format(self):
        self.assertEqual(check("--assume-filename=core/a.cpp", input="int f() { return 1; }\n")[0], 0)
        status, output = check("--assume-filename=core/a.cpp", input="int f( ){return 1;}\n")
        self.assertEqual(status, 1)
        self.assertIn("clang-format-violations", output)


if __name__ == "__main__":
    unittest.main()
