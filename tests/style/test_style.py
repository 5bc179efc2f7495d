"""Plain English in documents, approved outputs and comments: banned phrases, links that lead nowhere, and spelling.

A failure names file, line and what to write instead. Add a file or glob to CLEAN as soon as it passes."""

import pathlib
import re
import shutil
import subprocess
import unittest

import phrases
import prose

ROOT = pathlib.Path(__file__).resolve().parents[2]

CLEAN = [
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
    "reports/README.md",
    "reports/paper/*.py",
    "results/README.md",
    "templates/**/*",
    "tests/**/*.cpp",
    "tests/**/*.h",
    "tests/**/*.py",
    "tests/**/CMakeLists.txt",
    "tests/peers/README.md",
]
NOT_YET = {"docs/commands.md", "tests/style/phrases.py"}

# Lines whose words are another file's: (file, regular expression of the line).
QUOTED = [
    ("docs/plugin_check.md", r"^\| `[\w-]+` \| [\w ]+ \| "),  # promises of core/harness/conformance
    ("CONTRIBUTING.md", r"unknown key 'spce'"),  # a misspelt key, as the example of an error
    # Titles of papers.
    ("core/analysis/statistics/normalised_error.h", r"Optimization Methods and Software"),
    ("plugins/optimizers/bo_forest/README.md", r"Sequential model-based optimization"),
    ("plugins/optimizers/bo_turbo/README.md", r"Scalable Global Optimization"),
    ("plugins/optimizers/transfer_gp/README.md", r"Transfer Learning with Gaussian Processes"),
]

# Words that codespell takes for misspelt ones: keywords of lens files, names, notation.
SPELLING = ["nd", "parm", "thi", "thr", "zar", "kown"]
MISSPELT = ["recomended", "fo", "algoritm", "algoritms", "strat", "scrpt", "sqares", "wieght"]  # on purpose, in tests of suggestions


def clean_files():
    files = {file for pattern in CLEAN for file in ROOT.glob(pattern)}
    return sorted(file for file in files if file.is_file() and str(file.relative_to(ROOT)) not in NOT_YET)


def quoted(file, line):
    if file.endswith("relign-plugin.json") and '"citation":' in line:
        return True
    return any(name == file and re.search(pattern, line) for name, pattern in QUOTED)


def complaints(file, text):
    """'file:line: ...' for each banned phrase in the prose of `text`. `file` is a path relative to the root."""
    found = []
    whole = text.splitlines()
    for number, line in prose.lines_of(file, text):
        if quoted(str(file), whole[number - 1]):
            continue
        for pattern, instead in phrases.BANNED:
            if match := re.search(pattern, line, re.I):
                found.append(f"{file}:{number}: '{match[0]}': write {instead}")
    return found


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

    def test_documents_use_no_banned_phrase(self):
        files = clean_files()
        self.assertGreater(len(files), 30)
        self.check([one for file in files for one in complaints(file.relative_to(ROOT), file.read_text())])

    def test_links_and_anchors_resolve(self):
        documents = [file for file in clean_files() if file.suffix == ".md"]
        self.check([one for file in documents for one in broken_links(file.relative_to(ROOT), file.read_text())])

    def test_spelling(self):
        if shutil.which("codespell") is None:
            self.skipTest("codespell is not installed")
        files = [str(file.relative_to(ROOT)) for file in clean_files()]
        done = subprocess.run(["codespell", "--builtin", "clear,rare", "--ignore-words-list", ",".join(SPELLING + MISSPELT), *files], cwd=ROOT,
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class TheCheckItself(unittest.TestCase):
    def numbers(self, name, text):
        return [int(one.split(":")[1]) for one in complaints(pathlib.Path(name), text)]

    def test_finds_a_phrase_and_names_line_and_replacement(self):
        self.assertEqual(complaints(pathlib.Path("a.md"), "# A\n\nThe agent is told the merit.\n"),
                         ["a.md:3: 'is told': write 'observes', 'receives', 'is given'"])
        self.assertEqual(self.numbers("a.md", "Nobody\nknows. Beware!\n"), [1, 2])

    def test_every_pattern_compiles_and_matches_something(self):
        samples = """is told; knows of; says which; finds out; goes on; comes of; what came of; lies in; stands in; nobody; is no truth;
        makes of nothing; how surely; with a word; whole number; held against; one row a trial; once a trial; conversation;
        learnt beforehand; glue at; without truth; hopeless lens; beware; rubbish; clear radius; hollow face; dice; veil;
        part of a plan; optimization; color"""
        for pattern, instead in phrases.BANNED:
            self.assertRegex(samples, re.compile(pattern, re.I), instead)

    def test_ignores_code(self):
        self.assertEqual(self.numbers("a.md", "```\nnobody\n```\nThe key `infeasible` and [x](nobody.md).\n"), [])
        self.assertEqual(self.numbers("a.cpp", 'const char* kText = "nobody // nobody";\n'), [])
        self.assertEqual(self.numbers("a.py", 'nobody = "is told"\nprint("nobody")\n'), [])

    def test_finds_comments_and_docstrings(self):
        self.assertEqual(self.numbers("a.cpp", "int a;  // nobody\n/* fine\n   rubbish */\n"), [1, 3])
        self.assertEqual(self.numbers("a.py", '"""A module.\n\nNobody."""\nx = 1  # rubbish\n'), [3, 4])
        self.assertEqual(self.numbers("CMakeLists.txt", "add_test(nobody)  # nobody\n"), [1])
        self.assertEqual(self.numbers("help.txt", "Usage\n  is told\n"), [2])

    def test_finds_broken_links(self):
        text = "# One two\n\n[a](#one-two) [b](#three) [c](missing.md) [d](https://example.org/#x)\n"
        self.assertEqual(broken_links(pathlib.Path("a.md"), text),
                         ["a.md:3: no heading '#three' in 'a.md'", "a.md:3: no file 'missing.md'"])
        self.assertEqual(anchors("## The `x` of [y](z.md), v1.0\n## A\n## A\n"), {"the-x-of-y-v10", "a", "a-1"})


if __name__ == "__main__":
    unittest.main()
