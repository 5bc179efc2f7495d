"""Every number of a small report, computed again by pandas and SciPy from the raw records (tests/peers/compare_report.py).

The run has what statistics stumble over: trials that failed, that gave up early, that never came into specification, a method
without a result, and lenses that some methods lack.
"""

import copy
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PEERS = pathlib.Path(__file__).resolve().parents[2] / "peers"
sys.path.insert(0, str(PEERS))

try:
    import compare_report
    import pandas as pd
    import program
    import recompute
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: this test needs python3-pandas and python3-scipy")
if program.path() is None:
    raise unittest.SkipTest("relign-bench was not built")

STUMBLER = '''"""Walks by chance."""
import random

from relign_bench.plugin import Optimizer, serve


class Stumbler(Optimizer):
    """Where a lens starts decides whether this fails, or gives up early."""

    def run(self, trial):
        dice, start = random.Random(trial.first.pose[0]), trial.first.pose
        seen = trial.step(trial.box.clamp([0.5 + 0.02 * dice.gauss(0, 1) for _ in start]))
        if start[0] < 0.35:
            raise RuntimeError("the gripper let go")
        if start[1] < 0.45:
            return
        while seen is not None:
            seen = trial.step(trial.box.clamp([share + 0.03 * dice.gauss(0, 1) for share in seen.pose]))


serve(Stumbler)
'''
LOSER = '''"""Never works."""
from relign_bench.plugin import Optimizer, serve


class Loser(Optimizer):
    """Never works."""

    def run(self, trial):
        raise RuntimeError("never works")


serve(Loser)
'''
TRAINED = '''"""Walks as its model has it."""
import json
import random

from relign_bench.plugin import Optimizer, parameter, serve


class Trained(Optimizer):
    """The model is the length of a step."""

    training = "model"
    model = parameter(type="file", description="JSON: a number")

    def run(self, trial):
        dice, start = random.Random(trial.first.pose[0]), trial.first.pose
        with open(self.model) as file:
            length = json.load(file)
        if start[0] > 0.65:
            raise RuntimeError("out of its depth")
        seen = trial.first
        while seen is not None:
            seen = trial.step(trial.box.clamp([0.5 + length * dice.gauss(0, 1) for _ in seen.pose]))


serve(Trained)
'''
TOLERANCES = {"use": "tolerances", "elements": {"*": {"shift_um": [20, 20, 20], "tilt_arcmin": [6, 6]}},
              "start": {"shift_um": [300, 300, 300], "tilt_arcmin": [60, 60]},
              "cure_shift": {"shift_um": [20, 20, 20], "tilt_arcmin": [3, 3]}}
SUITE = {"scenes": [{"use": "relign_od", "name": "small", "parameters": {"pixels": 40}}], "noise_levels": ["rho0", "glued.json"],
         "instances": 7, "steps": 8, "spec": {"rmse": 0.03}, "algorithms": ["nlopt-sbplx", "./stumbler.py", "./loser.py"]}


class Recompute(unittest.TestCase):
    suite = SUITE

    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        place = pathlib.Path(cls.place.name)
        (place / "stumbler.py").write_text(STUMBLER)
        (place / "loser.py").write_text(LOSER)
        (place / "trained.py").write_text(TRAINED)
        for name, length in (("one", 0.01), ("two", 0.03), ("three", 0.1)):
            (place / f"{name}.json").write_text(str(length))
        (place / "glued.json").write_text(json.dumps(TOLERANCES))
        (place / "suite.json").write_text(json.dumps(cls.suite))
        cls.folder = place / "results"
        try:
            program.call("run", place / "suite.json", "-o", cls.folder)
        except RuntimeError as problem:
            if not (cls.folder / "report.html").exists():  # else trials failed, as they were meant to
                raise problem
        cls.document = json.loads(program.call("report", cls.folder, "--format", "json"))
        cls.ranking = program.call("report", cls.folder, "--format", "csv")
        cls.groups = recompute.groups(cls.folder)
        cls.aggregates = recompute.aggregates(cls.folder)

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    def found_in(self, compare, *arguments):
        differences = compare_report.Differences()
        compare(differences, *arguments)
        return differences

    def written(self, name, text):
        file = pathlib.Path(self.place.name) / name
        file.write_text(text)
        return file

    def test_the_run_has_what_it_is_made_for(self):
        trials = recompute.read(self.folder)[1]
        ends = trials.groupby("algorithm").end.value_counts()
        for end in ("failed", "finished", "budget_spent"):
            self.assertGreater(ends["stumbler"].get(end, 0), 0, ends)
        self.assertEqual([any("uncured" in row["yield"] for row in group["rows"]) for group in self.groups], [False, True])
        to_spec = [row["to_spec"] for group in self.groups for row in group["rows"]]
        self.assertTrue(any(math.isinf(one["steps"]) for one in to_spec if one["steps"] is not None))
        self.assertTrue(any(one["steps"] is not None and one["steps"] < math.inf for one in to_spec))
        self.assertTrue(any(any(pair["n"] < group["instances"] for pair in group["pairs"]) for group in self.groups))

    def test_all_tables_and_the_page_agree(self):
        for compare, argument in ((compare_report.report_json, (self.document, self.folder)),
                                  (compare_report.ranking_csv, (self.ranking,)),
                                  (compare_report.curves_csv, (self.folder / "curves.csv",)),
                                  (compare_report.curves_json, (self.folder / "curves.json",)),
                                  (compare_report.matrix_csv, (self.folder / "matrix.csv",)),
                                  (compare_report.page, (self.folder / "report.html",))):
            with self.subTest(compare.__name__):
                differences = self.found_in(compare, self.groups, *argument)
                self.assertEqual(differences.found, [])
                self.assertGreater(differences.compared, 100)
        differences = self.found_in(compare_report.instances_csv, self.folder, self.folder / "instances.csv")
        self.assertEqual(differences.found, [])
        self.assertGreater(len(self.aggregates), 0)
        for compare, argument in ((compare_report.aggregate_json, (self.document, self.folder)),
                                  (compare_report.aggregate_csv, (self.folder / "aggregate.csv",))):
            with self.subTest(compare.__name__):
                differences = self.found_in(compare, self.aggregates, *argument)
                self.assertEqual(differences.found, [])
                self.assertGreater(differences.compared, 30)

    def numbers_of(self, value, place=()):
        if isinstance(value, dict):
            for key, member in value.items():
                if key not in compare_report.WORDS:
                    yield from self.numbers_of(member, (*place, key))
        elif isinstance(value, list):
            for index, member in enumerate(value):
                yield from self.numbers_of(member, (*place, index))
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield place

    def test_any_changed_number_of_the_json_is_noticed(self):
        groups, changed = copy.deepcopy(self.document["results"][0]["groups"][:1]), 0
        document = {"results": [{"folder": "", "groups": groups}]}
        for place in self.numbers_of(groups):
            if place[1] == "curves" and place[2] > 0:
                continue  # treated as the first curve is
            at = groups
            for key in place[:-1]:
                at = at[key]
            kept = at[place[-1]]
            at[place[-1]] = kept * (1 + 1e-8) or 1e-8
            self.assertEqual(len(self.found_in(compare_report.report_json, self.groups[:1], document, "").found), 1, place)
            at[place[-1]] = kept
            changed += 1
        self.assertGreater(changed, 300)

    def test_any_changed_number_of_the_aggregates_is_noticed(self):
        aggregate, changed = copy.deepcopy(self.document["results"][0]["aggregate"]), 0
        document = {"results": [{"folder": "", "aggregate": aggregate}]}
        for place in self.numbers_of(aggregate):
            at = aggregate
            for key in place[:-1]:
                at = at[key]
            kept = at[place[-1]]
            at[place[-1]] = kept * (1 + 1e-8) or 1e-8
            self.assertEqual(len(self.found_in(compare_report.aggregate_json, self.aggregates, document, "").found), 1, place)
            at[place[-1]] = kept
            changed += 1
        self.assertGreater(changed, 300)

    def test_a_changed_field_of_the_tables_is_noticed(self):
        table = pd.read_csv(self.folder / "curves.csv", float_precision="round_trip")
        for column in table.columns[6:]:
            changed = table.copy()
            changed.loc[changed[column].last_valid_index(), column] *= 1 + 1e-8
            file = self.written("curves.csv", changed.to_csv(index=False))
            self.assertEqual(len(self.found_in(compare_report.curves_csv, self.groups, file).found), 1, column)
        table = pd.read_csv(self.folder / "aggregate.csv", float_precision="round_trip")
        for column in table.columns[table.columns.get_loc("n"):]:
            changed = table.astype({column: float})
            if changed[column].notna().any():
                place = changed[column].last_valid_index()
                changed.loc[place, column] = changed.loc[place, column] * (1 + 1e-8) or 1e-8
                file = self.written("aggregate.csv", changed.to_csv(index=False))
                self.assertEqual(len(self.found_in(compare_report.aggregate_csv, self.aggregates, file).found), 1, column)
        table = pd.read_csv(self.folder / "matrix.csv", float_precision="round_trip")
        self.assertEqual(set(table.images), {6, 8})
        for column in table.columns[table.columns.get_loc("trials"):]:
            changed = table.astype({column: float})
            changed.loc[changed[column].last_valid_index(), column] += 1e-8
            file = self.written("matrix.csv", changed.to_csv(index=False))
            self.assertEqual(len(self.found_in(compare_report.matrix_csv, self.groups, file).found), 1, column)
        for column in ("recommended_iqm", "yield_lo95", "expected_steps_to_spec"):
            changed = pd.read_csv(pathlib.Path(self.written("ranking.csv", self.ranking)), float_precision="round_trip")
            changed.loc[0, column] = changed.loc[0, column] * (1 + 1e-8)
            found = self.found_in(compare_report.ranking_csv, self.groups, changed.to_csv(index=False)).found
            self.assertEqual(len(found), 1, column)

    def test_a_changed_point_of_the_page_is_noticed(self):
        text = (self.folder / "report.html").read_text()
        digits = f"{self.groups[0]['curves'][0]['tracks']['recommended']['median'][0]:.3g}"
        self.assertIn(digits, text)
        changed = text.replace(digits, digits[:-1] + str((int(digits[-1]) + 5) % 10))
        self.assertTrue(self.found_in(compare_report.page, self.groups, self.written("page.html", changed)).found)

    def test_other_rules_agree(self):
        page = pathlib.Path(self.place.name) / "by_rule.html"
        for rule in ("best", "current"):
            by = ("--rule", rule)
            groups = recompute.groups(self.folder, rule)
            program.call("report", self.folder, "-o", page, *by)
            document = json.loads(program.call("report", self.folder, "--format", "json", *by))
            differences = self.found_in(compare_report.report_json, groups, document, self.folder)
            self.assertEqual(differences.found, [], rule)
            self.assertGreater(differences.compared, 1000)
            aggregates = recompute.aggregates(self.folder, rule)
            self.assertNotEqual(aggregates, self.aggregates)
            self.assertEqual(self.found_in(compare_report.aggregate_json, aggregates, document, self.folder).found, [], rule)
            for compare, argument in ((compare_report.ranking_csv, program.call("report", self.folder, "--format", "csv", *by)),
                                      (compare_report.page, page)):
                self.assertEqual(self.found_in(compare, groups, argument).found, [], rule)
        own, best = ([row["recommended"]["median"] for group in recompute.groups(self.folder, rule) for row in group["rows"]
                      if row["recommended"]["n"]] for rule in ("own", "best"))
        self.assertNotEqual(own, best)

    def test_a_changed_record_is_noticed(self):
        with tempfile.TemporaryDirectory() as place:
            subprocess.run(["cp", "-r", str(self.folder), place], check=True)
            file = pathlib.Path(place) / "results/trials/0000.jsonl"
            lines = [json.loads(line) for line in file.read_text().splitlines()]
            step = max((line for line in lines if "end" not in line), key=lambda line: line["recommended_mse"])
            step["recommended_mse"] *= 1.5
            file.write_text("".join(json.dumps(line) + "\n" for line in lines))
            groups = recompute.groups(pathlib.Path(place) / "results")
        self.assertTrue(self.found_in(compare_report.report_json, groups, self.document, self.folder).found)


class RecomputeMtf(unittest.TestCase):
    """A specification of error and MTF: numbers agree, and the MTF decides for some of the lenses."""

    suite = {**SUITE, "spec": {"rmse": 0.03, "mtf": {"lp_per_mm": 5, "centre": 0.9, "corner": 0.9}},
             "analysis": {"primary": "yield", "rule": "best", "contrasts": [["random", "nlopt-sbplx"], ["home", "loser"]],
                          "smallest_relevant_ratio": 1.3, "yield": 0.5}}
    setUpClass = classmethod(Recompute.setUpClass.__func__)
    tearDownClass = classmethod(Recompute.tearDownClass.__func__)
    found_in = Recompute.found_in
    test_all_tables_and_the_page_agree = Recompute.test_all_tables_and_the_page_agree

    def test_the_plan_decides(self):
        entry = self.document["results"][0]
        self.assertEqual((entry["rule"], entry["smallest_relevant_ratio"]), ("best", 1.3))
        planned = [pair for group in entry["groups"] for pair in group["pairs"] if pair.get("planned")]
        self.assertEqual([{pair["a"], pair["b"]} for pair in planned], [{"random", "nlopt-sbplx"}] * 2, "the loser has no result")
        self.assertTrue(all(pair["yields"]["n"] == 7 for pair in planned))

    def test_the_mtf_decides(self):
        trials = recompute.read(self.folder)[1]
        trials = trials[trials.end.isin(["budget_spent", "finished"])]
        sharp = (trials.mtf_centre >= 0.9) & (trials.mtf_corner >= 0.9)
        near = recompute.ends_of(trials) <= 0.03
        self.assertTrue((near & ~sharp).any(), "the error is in spec, the MTF is not")
        self.assertTrue((near & sharp).any(), "both are in spec")
        glued = trials[trials.noise_level == "glued"]
        self.assertTrue((glued.uncured_mtf_corner != glued.mtf_corner).all())
        self.assertTrue(trials.own_optimum_mtf_centre.notna().all())
        groups = [group for group in self.groups for _ in group["rows"]]
        rows = [row for group in self.groups for row in group["rows"]]
        self.assertTrue(all(group["spec_mtf"]["lp_per_mm"] == 5 for group in groups))
        self.assertTrue(any(0 < row["yield"]["share"] for row in rows))
        self.assertIn("MTF at 5.00 lp/mm 0.900 in the centre and 0.900 in the corners", (self.folder / "report.html").read_text())


class RecomputeTrainings(unittest.TestCase):
    """A method that is a list of trainings, beside one that was trained once, and a search."""

    suite = {**SUITE, "algorithms": [{"use": "./trained.py", "name": "net", "trainings": ["one.json", "two.json", "three.json"]},
                                     {"use": "./trained.py", "name": "lone", "parameters": {"model": "two.json"}}, "nlopt-sbplx"]}
    setUpClass = classmethod(Recompute.setUpClass.__func__)
    tearDownClass = classmethod(Recompute.tearDownClass.__func__)
    found_in = Recompute.found_in
    written = Recompute.written
    numbers_of = Recompute.numbers_of
    test_all_tables_and_the_page_agree = Recompute.test_all_tables_and_the_page_agree
    test_any_changed_number_of_the_aggregates_is_noticed = Recompute.test_any_changed_number_of_the_aggregates_is_noticed
    test_a_changed_field_of_the_tables_is_noticed = Recompute.test_a_changed_field_of_the_tables_is_noticed

    def test_the_list_is_one_method_with_its_spread(self):
        methods = {one["method"]: one for one in self.document["results"][0]["aggregate"][0]["methods"]}
        self.assertEqual([one["training"] for one in methods["net"]["trainings"]], ["one", "two", "three"])
        self.assertEqual(methods["net"]["n"], 3 * methods["nlopt-sbplx"]["n"])
        self.assertGreater(methods["net"]["failed"], 0)
        self.assertGreater(methods["net"]["spread"]["sd"], 0)
        self.assertEqual(methods["net"]["training_tag"], "3 training runs")
        self.assertEqual(methods["lone"]["training_tag"], "one training run")
        self.assertNotIn("training_tag", methods["nlopt-sbplx"])
        page = (self.folder / "report.html").read_text()
        self.assertIn("IQM of 3 training runs", page)
        self.assertIn("one training run", page)
        records = recompute.read(self.folder)[1]
        self.assertEqual(set(records[records.method == "net"].training), {"one", "two", "three"})
        for table in ("md", "csv"):
            self.assertIn("one training run", program.call("report", self.folder, "--format", table))


if __name__ == "__main__":
    unittest.main()
