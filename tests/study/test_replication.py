"""The replication study, reports/paper/replication.md: seed and verdicts follow from networks and results as planned."""

import csv
import hashlib
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = TREE / "reports" / "paper" / "frozen_seed.py"
VERDICTS = SCRIPT.with_name("verdicts.py")
STUDY = TREE / "reports" / "paper" / "trainings" / "replication"


def output_of(*command):
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)


class FrozenSeed(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)
        for name, content in (("a", b"first"), ("b", b"second"), ("c", b"second")):
            (self.folder / f"{name}.onnx").write_bytes(content)
        (self.folder / "study.template.json").write_text(
            '{"algorithms": ["random", {"use": "x", "trainings": ["b.onnx", "c.onnx"]},\n'
            ' {"use": "y", "trainings": ["a.onnx", "b.onnx"]}],\n "seed": "later", "steps": 2}\n')

    def run_script(self, template="study.template.json"):
        return output_of(sys.executable, SCRIPT, self.folder / template)

    def seed(self):
        return json.loads((self.folder / "study.json").read_text())["seed"]

    def test_is_what_the_plan_says(self):
        done = self.run_script()
        self.assertEqual(done.returncode, 0, done.stderr)
        digests = sorted(hashlib.sha256(content).hexdigest() for content in (b"first", b"second"))
        whole = hashlib.sha256((digests[0] + "\n" + digests[1] + "\n").encode()).digest()
        self.assertEqual(self.seed(), int.from_bytes(whole[:8], "big") // 2)
        self.assertEqual((self.folder / "study.json").read_text(),
                         (self.folder / "study.template.json").read_text().replace('"later"', str(self.seed())))

    def test_depends_on_the_bytes_of_every_network(self):
        seeds = set()
        for name in ("a", "b", "c"):
            (self.folder / "study.json").unlink(missing_ok=True)
            (self.folder / f"{name}.onnx").write_bytes(b"another " + name.encode())
            self.assertEqual(self.run_script().returncode, 0)
            seeds.add(self.seed())
        self.assertEqual(len(seeds), 3)

    def test_refuses_what_is_not_frozen(self):
        (self.folder / "b.onnx").unlink()
        done = self.run_script()
        self.assertEqual(done.returncode, 2)
        self.assertIn("1 of 3 networks are not trained yet", done.stderr)
        self.assertFalse((self.folder / "study.json").exists())

    def test_does_not_draw_twice(self):
        self.assertEqual(self.run_script().returncode, 0)
        self.assertEqual(self.run_script().returncode, 0)
        before = self.seed()
        (self.folder / "a.onnx").write_bytes(b"trained again")
        done = self.run_script()
        self.assertEqual((done.returncode, self.seed()), (2, before))
        self.assertIn("has been written from other networks", done.stderr)


class Templates(unittest.TestCase):
    def test_cannot_be_run_before_they_have_a_seed(self):
        for template in sorted(STUDY.glob("*.template.json")):
            done = output_of(os.environ["RELIGN_BENCH"], "validate", template)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("seed", done.stderr + done.stdout)

    def test_are_valid_with_one(self):
        imitation = TREE / "plugins/agents/imitation/imitation"
        networks = {"ppo-paper": TREE / "reports/paper/trainings/seed-0", "imitation": imitation, "imitation-ppo": imitation}
        for template in sorted(STUDY.glob("*.template.json")):
            with self.subTest(template.name), tempfile.TemporaryDirectory() as kept:
                folder = pathlib.Path(shutil.copy(template, kept)).parent
                for entry in json.loads(template.read_text())["algorithms"]:
                    for name in entry.get("trainings", []) if isinstance(entry, dict) else []:
                        stand_in(networks[entry["use"]], folder / name)
                done = output_of(sys.executable, SCRIPT, folder / template.name)
                self.assertEqual(done.returncode, 0, done.stderr)
                done = output_of(os.environ["RELIGN_BENCH"], "validate", folder / template.name.replace(".template", ""))
                self.assertEqual(done.returncode, 0, done.stderr)


class Verdicts(unittest.TestCase):
    LOWER, HIGHER, UNDECIDED = (0.9, 0.51, 0.99), (0.2, 0.1, 0.49), (0.6, 0.5, 0.8)

    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.table = pathlib.Path(kept.name) / "improvement.csv"

    def found(self, own, best, trainings=5, suite="core"):
        """What the script makes of one interval for each claim and rule."""
        with open(self.table, "w", newline="") as file:
            table = csv.writer(file)
            table.writerow(("method", "trainings", "opponent", "rule", "improvement", "lo95", "hi95"))
            for rule, intervals in (("own", own), ("best", best)):
                for (method, opponent), interval in zip(self.claims()[suite], intervals):
                    table.writerow((method, trainings, opponent, rule, *interval))
        done = output_of(sys.executable, VERDICTS, suite, self.table)
        return [row["verdict"] for row in csv.DictReader(io.StringIO(done.stdout))], done.stderr

    @staticmethod
    def claims():
        sys.path.insert(0, str(VERDICTS.parent))
        try:
            import verdicts
        finally:
            sys.path.pop(0)
        return verdicts.CLAIMS

    def test_need_both_rules_in_one_direction(self):
        own = [self.LOWER, self.HIGHER] + 5 * [self.LOWER]
        self.assertEqual(self.found(own, own)[0], ["lower", "higher"] + 5 * ["lower"])
        self.assertEqual(self.found(own, own[1:] + own[:1])[0], 7 * ["not shown"])
        self.assertEqual(self.found(own[:2], own[:2], suite="randomised")[0], ["lower", "higher"])

    def test_end_with_the_first_that_is_not_shown(self):
        own = 4 * [self.LOWER] + [self.UNDECIDED] + 2 * [self.LOWER]
        self.assertEqual(self.found(own, 7 * [self.LOWER])[0], 4 * ["lower"] + 3 * ["not shown"])

    def test_refuse_fewer_trainings_and_missing_claims(self):
        rows, message = self.found(7 * [self.LOWER], 7 * [self.LOWER], trainings=4)
        self.assertEqual(rows, [])
        self.assertIn("rule own: expected one row of 5 trainings, found ['4']", message)
        rows, message = self.found(7 * [self.LOWER], 6 * [self.LOWER])
        self.assertEqual(rows, [])
        self.assertIn("linear-last : nlopt-bobyqa, rule best: expected one row of 5 trainings, found []", message)

    def test_claims_are_of_methods_of_the_suite(self):
        for suite, claims in self.claims().items():
            entries = json.loads((STUDY / f"{suite}.template.json").read_text())["algorithms"]
            names = {entry if isinstance(entry, str) else entry["name"] for entry in entries}
            self.assertLessEqual({name for claim in claims for name in claim}, names)
            # With more than twelve methods, home and random included, the report has not every pair.
            self.assertLessEqual(len(names) + 2, 12)


def stand_in(network, path):
    """Copies a network with other bytes: its name, as the text that documents the ONNX model (field 6)."""
    path.parent.mkdir(exist_ok=True)
    text = str(path.name).encode() + path.parent.name.encode()
    content = network.with_suffix(".onnx").read_bytes() + bytes((6 << 3 | 2, len(text))) + text
    about = json.loads(network.with_suffix(".json").read_text())
    about["weights_sha256"] = hashlib.sha256(content).hexdigest()
    path.write_bytes(content)
    path.with_suffix(".json").write_text(json.dumps(about))


if __name__ == "__main__":
    unittest.main()
