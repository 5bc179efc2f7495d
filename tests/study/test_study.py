"""What reports/ publishes: the tables of the study's pages come from it, its raw sample replays, and the
quick suite still has the numbers that are published."""

import csv
import json
import math
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
PAPER = TREE / "reports" / "paper"
sys.path.insert(0, str(PAPER))

import tables  # noqa: E402
from cells import FLOOR, named  # noqa: E402
from claims import Evidence, verdict  # noqa: E402

QUICK = TREE / "reports" / "quick" / "instances.csv"
PAGE_WORDS = 800  # of docs/study.md, without its tables
REPLAYED = 5  # trials of the sample; all of them: relign-bench verify reports/paper/sample
QUICK_LENS = "3"
OTHER_CPU = 1e-6  # what verify allows there


def rows(file, **wanted):
    with open(file, newline="") as table:
        return [row for row in csv.DictReader(table) if all(row[key] == value for key, value in wanted.items())]


def equal_anywhere(folder):
    """Methods that promise equal numbers on every processor; the others do on one kind, which this machine need not have."""
    manifest = json.loads((folder / "manifest.json").read_text())
    return {entry["name"] for entry in manifest["algorithms"] if entry["reproducible"] == "anywhere"}


def relign_bench(*arguments):
    done = subprocess.run([os.environ["RELIGN_BENCH"], "--progress", "none", *map(str, arguments)], capture_output=True,
                          text=True, cwd=TREE)
    if done.returncode != 0:
        raise AssertionError(f"relign-bench {' '.join(map(str, arguments))}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


class Published(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_tables_of_the_document_are_those_of_the_files(self):
        done = subprocess.run([sys.executable, "-B", PAPER / "tables.py", "--check"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_the_first_page_stays_one_page(self):
        prose = re.sub(r"<!-- table.*?<!-- end -->", "", (TREE / "docs" / "study.md").read_text(), flags=re.DOTALL)
        self.assertLessEqual(len(prose.split()), PAGE_WORDS)

    def test_the_first_page_lists_every_method_once(self):
        listed = [name for row in rows(PAPER / "methods.csv") for name in row["methods"].split(";")]
        studied = {named(row["algorithm"]) for row in rows(PAPER / "instances.csv")}
        self.assertEqual(sorted(listed), sorted(studied | {"PPO-100", "PPO-200"}))

    def test_names_of_networks(self):
        for file, page in (("ppo-exact-200-shrinking (rho0.25-seed-0)", "PPO-200 (trained at rho0.25), shrinking moves"),
                           ("ppo-exact (seed-1)", "PPO-100 (seed 1)"), ("ppo-paper", "PPO-small"), ("bo-gp", "bo-gp")):
            self.assertEqual(named(file), page)

    def test_a_claim_is_the_same_or_different_if_both_rules_decide(self):
        for own, best, wanted in (("better", "better", "same"), ("worse", "worse", "different"), ("better", "worse", "not shown"),
                                  ("better", "undecided", "not shown"), ("undecided", "undecided", "not shown"),
                                  ("practically equal", "undecided", "not shown"),
                                  ("practically equal", "practically equal", "no difference found")):
            self.assertEqual(verdict([own, best]), wanted)

    def test_no_difference_is_stated_with_its_interval(self):
        self.assertEqual(Evidence().summed_up("bo-rf", "random"),
                         "**no difference found** at rho0 (0.92 to 1.07); **not shown** at rho0.25, rho0.5")

    def test_the_tables_of_pages_are_those_of_their_files(self):
        for page in ("leaderboard", "camera_module", "domains"):
            with self.subTest(page):
                script = TREE / "reports" / page / "table.py"
                done = subprocess.run([sys.executable, "-B", script, "--check"], capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_contrasts_at_the_floor_of_reports_are_those_of_the_report(self):
        names = ("protocol", "noise_level", "first", "second", "rule", "n", "ratio", "lo95", "hi95", "verdict")
        reported = {tuple(row[name] for name in names) for row in rows(PAPER / "contrasts.csv")}
        again = {tuple(row[name] for name in names) for row in rows(PAPER / "floors.csv", floor="0.0001", planned="yes")}
        self.assertGreater(len(reported), 100)
        self.assertEqual(again, reported)

    def test_levels_are_those_of_the_instances(self):
        done = subprocess.run([sys.executable, "-B", PAPER / "levels.py"], capture_output=True, text=True)
        self.assertEqual(done.stdout, (PAPER / "levels.csv").read_text(), done.stderr)

    def test_lowest_merits_belong_to_the_study(self):
        published = {row["trial"]: row for row in rows(PAPER / "instances.csv")}
        lowest = rows(PAPER / "merit.csv")
        self.assertEqual(len({row["trial"] for row in lowest}), 150)
        for row in lowest:
            for name in ("noise_level", "protocol", "algorithm", "instance"):
                self.assertEqual(row[name], published[row["trial"]][name])

    def test_contrasts_of_the_authors_rules_are_those_of_the_errors(self):
        errors = {}
        for row in [row for file in ("instances.csv", "trainings/instances.csv") for row in rows(PAPER / file, protocol="paper")]:
            errors.setdefault((row["algorithm"], row["noise_level"]), {})[row["instance"]] = row
        for row in rows(PAPER / "merit.csv", protocol="paper"):
            errors[row["algorithm"], row["noise_level"]][row["instance"]]["merit"] = row["rmse"]
        for row in rows(PAPER / "authors.csv"):
            first, second = ([max(float(of_instance[row[f"{which}_rule"]]), float(FLOOR))
                              for _, of_instance in sorted(errors[row[which], row["noise_level"]].items())]
                             for which in ("first", "second"))
            logarithms = sorted(math.log(one / other) for one, other in zip(first, second, strict=True) for _ in range(4))
            middle = logarithms[len(logarithms) // 4:-len(logarithms) // 4]
            self.assertAlmostEqual(math.exp(statistics.fmean(middle)) / float(row["ratio"]), 1, places=4, msg=str(row))

    def test_networks_of_one_kind_share_a_row(self):
        line = next(line for line in tables.authors().splitlines() if line.startswith("| PPO-200 (own) : nlopt-bobyqa"))
        self.assertIn("| 1.15 to 1.33 (0.98 to 1.50) undecided or worse |", line)

    def test_what_is_published_is_the_suite_of_the_tree(self):
        manifest = json.loads((PAPER / "sample" / "manifest.json").read_text())
        self.assertEqual(json.loads(manifest["suite"]), json.loads((TREE / "suites" / "paper.json").read_text()))

    def test_the_sample_belongs_to_the_study(self):
        published = {row["trial"]: row for row in rows(PAPER / "instances.csv")}
        sample = rows(PAPER / "sample" / "instances.csv")
        self.assertGreater(len(sample), 10)
        for row in sample:
            self.assertEqual(row, published[row["trial"]])

    def test_the_sample_replays_bit_for_bit(self):
        copy = shutil.copytree(PAPER / "sample", self.folder / "sample")  # verify writes what it found
        anywhere = equal_anywhere(copy)
        trials = [row["trial"] for row in rows(copy / "instances.csv") if row["algorithm"] in anywhere]
        self.assertGreaterEqual(len(trials), REPLAYED)
        for trial in trials[:REPLAYED]:
            relign_bench("verify", copy, "--trial", trial, "--suite-folder", TREE / "suites")

    def test_the_quick_suite_has_the_published_numbers(self):
        relign_bench("run", TREE / "suites" / "quick.json", "-o", self.folder / "quick", "--only", f"instance={QUICK_LENS}")
        found, published = rows(self.folder / "quick" / "instances.csv"), rows(QUICK, instance=QUICK_LENS)
        self.assertEqual(len(found), 15)
        self.assertEqual([row["trial"] for row in found], [row["trial"] for row in published])
        anywhere = equal_anywhere(self.folder / "quick")
        for row, wanted in zip(found, published):
            if row["algorithm"] in anywhere:
                self.assertEqual(row, wanted)
            for key in ("commanded", "recommended", "excess"):
                self.assertAlmostEqual(float(row[key]), float(wanted[key]), delta=OTHER_CPU, msg=(row["trial"], key))


if __name__ == "__main__":
    unittest.main()
