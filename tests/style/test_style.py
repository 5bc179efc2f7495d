"""Documents, approved outputs and comments: links that lead nowhere, and spelling. A failure names file and line."""

import pathlib
import re
import shutil
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]

CHECKED = [
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "README.md",
    "SECURITY.md",
    "benchmarks/**/*.cpp",
    "benchmarks/**/*.py",
    "cmake/*",
    "core/**/*.cpp",
    "core/**/*.h",
    "core/**/*.hpp",
    "core/**/CMakeLists.txt",
    "core/README.md",
    "docs/**/*.md",
    "docs/schemas/*.json",
    "docs/site/*.py",
    "examples/**/*.md",
    "examples/**/*.py",
    "examples/compass/*",
    "plugins/**/*.[ch]pp",
    "plugins/**/*.h",
    "plugins/**/*.md",
    "plugins/**/CMakeLists.txt",
    "plugins/**/relign-plugin.json",
    "python/**/*.md",
    "python/**/*.py",
    "reports/**/*.md",
    "reports/paper/*.py",
    "results/README.md",
    "templates/**/*",
    "tests/**/*.cpp",
    "tests/**/*.h",
    "tests/**/*.py",
    "tests/**/CMakeLists.txt",
    "tests/peers/README.md",
]

# Words that codespell takes for misspelt ones: keywords of lens files, names, notation.
SPELLING = ["nd", "parm", "thi", "thr", "zar", "kown"]
MISSPELT = ["recomended", "fo", "algoritm", "algoritms", "strat", "scrpt", "sqares", "wieght"]  # on purpose, in tests of suggestions


def checked_files():
    return sorted(file for file in {file for pattern in CHECKED for file in ROOT.glob(pattern)} if file.is_file())


def anchors(text):
    """Anchors of a Markdown document's headings, as forges make them."""
    made = {}
    for line in without_fences(text):
        if heading := re.match(r"#+ +(.*?)\s*$", line):
            words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading[1]).replace("&lt;", "<").replace("&gt;", ">")
            anchor = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
            made[anchor] = made.get(anchor, -1) + 1
    return {name + (f"-{again}" if again else "") for name, times in made.items() for again in range(times + 1)}


def without_fences(text):
    fenced = False
    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            fenced = not fenced
        yield "" if fenced else line


def broken_links(file, text, read=lambda path: path.read_text()):
    found = []
    for number, line in enumerate(without_fences(text), 1):
        for path, anchor in re.findall(r"\]\(([^)#:\s]*)(?:#([^)\s]+))?\)", line):
            target = (ROOT / file).parent / path if path else ROOT / file
            if path and not target.exists():
                found.append(f"{file}:{number}: no file '{path}'")
            elif anchor and target.suffix == ".md" and anchor not in anchors(text if not path else read(target)):
                found.append(f"{file}:{number}: no heading '#{anchor}' in '{path or file}'")
    return found


class Style(unittest.TestCase):
    def check(self, found):
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_links_and_anchors_resolve(self):
        documents = [file for file in checked_files() if file.suffix == ".md"]
        self.assertGreater(len(documents), 30)
        self.check([one for file in documents for one in broken_links(file.relative_to(ROOT), file.read_text())])

    def test_spelling(self):
        if shutil.which("codespell") is None:
            self.skipTest("codespell is not installed")
        files = [str(file.relative_to(ROOT)) for file in checked_files()]
        done = subprocess.run(["codespell", "--builtin", "clear,rare", "--ignore-words-list", ",".join(SPELLING + MISSPELT), *files], cwd=ROOT,
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class TheCheckItself(unittest.TestCase):
    def test_finds_broken_links(self):
        text = "# One two\n\n[a](#one-two) [b](#three) [c](missing.md) [d](https://example.org/#x)\n"
        self.assertEqual(broken_links(pathlib.Path("a.md"), text),
                         ["a.md:3: no heading '#three' in 'a.md'", "a.md:3: no file 'missing.md'"])
        self.assertEqual(anchors("## The `x` of [y](z.md), v1.0\n## A\n## A\n"), {"the-x-of-y-v10", "a", "a-1"})


if __name__ == "__main__":
    unittest.main()
