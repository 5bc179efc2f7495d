"""The technical report in docs/paper: its numbers are those of the documentation, none is written by hand, and it compiles."""

import importlib.util
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
REPORT, SCRIPT = TREE / "docs" / "paper", TREE / "reports" / "paper" / "report.py"
sys.path.insert(0, str(SCRIPT.parent))

import report  # noqa: E402

PAGES = ("docs/study.md", "docs/reproduction.md", "docs/training.md", "docs/appendix_study.md")
PAGES_OF_REPORT = range(7, 11)
MAX_BYTES = 1_000_000
NUMBER = r"\d+(?:,\d{3})*(?:\.\d+)?"
# Not results: what a key may have that no page states in these digits.
SETTINGS = ("cost.", "validation.", "scene.", "noise.", "cite.", "mitsuba.", "speed.", "recipe.")

# Comments, code, strings, references, names of networks and products; arguments of layout.
NOT_PROSE = (r"//.*", r"`[^`]*`", r'"[^"]*"', r"@[a-z-]+", r"PPO-\d+", "Stable-Baselines3", "H200", r"columns: [^\n]*",
             r"update\(0\)", r"data-table\([^\n]*", r"plain-table\(\n[^\n]*",
             r"(?:width|above|size|row-gutter|column-gutter): [\d.]+(?:%|mm|em|pt)")
NEEDED = "needs the Python package typst; install it with 'pip install typst'"


def data():
    return json.loads((REPORT / "data.json").read_text())


def numbers(text):
    return re.findall(NUMBER, text)


def page_tables(page):
    """By name: rows of numbers of every generated table of a page, row by row."""
    found = re.findall(r"<!-- table ([^>]+?) -->(.*?)<!-- end -->", (TREE / page).read_text(), re.DOTALL)
    return {name: [re.sub(r"\]\([^)]*\)", "]", line) for line in text.splitlines() if line.startswith("|")][2:]
            for name, text in found}


class Report(unittest.TestCase):
    def test_data_are_those_of_the_results_files(self):
        done = subprocess.run([sys.executable, "-B", SCRIPT, "--check"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_tables_have_the_numbers_of_the_pages(self):
        tables = {name: rows for page in PAGES for name, rows in page_tables(page).items()}
        own = {"final": "final paper"}
        checked = 0
        for name, table in data()["tables"].items():
            if name == "domains":  # some columns and rows of the page's table
                continue
            of_page = [line for line in tables[own.get(name, name)] if name != "authors" or report.LEFT_OUT not in line]
            rows = [row for row in table["rows"] if any(row[1:])]  # without headings of classes
            self.assertEqual(len(rows), len(of_page), name)
            for row, line in zip(rows, of_page):
                wanted = numbers(line.rsplit("|", 2)[0] if name == "final" else line)  # the report has no times
                self.assertEqual(numbers(" ".join(row)), wanted, (name, row[0]))
                checked += len(wanted)
        self.assertGreater(checked, 500)

    def test_domains_have_numbers_of_the_page(self):
        for row, line in zip(data()["tables"]["domains"]["rows"], page_tables("docs/reproduction.md")["domains"]):
            self.assertEqual([number for number in numbers(" ".join(row[1:])) if number not in numbers(line)], [])

    def test_values_are_in_the_pages(self):
        stated = set(numbers(" ".join((TREE / page).read_text() for page in PAGES)))
        for key, value in data()["values"].items():
            if not key.startswith(SETTINGS):
                for number in numbers(value):
                    variants = {number, f"{float(number.replace(',', '')):g}", f"{float(number.replace(',', '')):.3f}"}
                    with self.subTest(key, value=value):
                        self.assertTrue(variants & stated, f"{number} is not in {', '.join(PAGES)}")

    def test_no_number_is_written_by_hand(self):
        text = (REPORT / "report.typ").read_text()
        prose = re.sub("|".join(NOT_PROSE), "", text)
        found = [line.strip() for line in prose.splitlines() if re.search(r"\d", line)]
        self.assertEqual(found, [])

    def test_no_semicolon_is_lost(self):
        self.assertNotRegex((REPORT / "report.typ").read_text(), r'#v\("[^"]*"\);')  # Typst takes it as the end of the code

    def test_cells_become_markup(self):
        for cell, wanted in (("**same** at rho0", "*same* at rho0"), ("[bo-gp](../x_y.md)", "bo-gp"), ("-", "–"),
                             ("1. A policy", r"1\. A policy"), ("0.42 (0.33 to 0.52) better", "0.42 (0.33–0.52) better"),
                             ("`relign_od` <0.0001", r"`relign_od` \<0.0001")):
            self.assertEqual(report.markup(cell), wanted)

    @unittest.skipUnless(importlib.util.find_spec("typst"), NEEDED)
    def test_it_compiles(self):
        with tempfile.TemporaryDirectory() as folder:
            output = pathlib.Path(folder) / "report.pdf"
            report.typeset(str(output))
            content = output.read_bytes()
        self.assertTrue(content.startswith(b"%PDF"))
        self.assertLess(len(content), MAX_BYTES)

    @unittest.skipUnless(importlib.util.find_spec("typst"), NEEDED)
    def test_it_keeps_its_length(self):
        with tempfile.TemporaryDirectory() as folder:
            report.typeset(str(pathlib.Path(folder) / "page-{p}.png"))
            self.assertIn(len(list(pathlib.Path(folder).iterdir())), PAGES_OF_REPORT)


if __name__ == "__main__":
    unittest.main()
