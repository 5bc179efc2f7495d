"""The seed of the replication study (reports/paper/frozen_seed.py) follows from all networks that its template names."""

import hashlib
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
STUDY = TREE / "reports" / "paper" / "trainings" / "replication"


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
        return subprocess.run([sys.executable, str(SCRIPT), str(self.folder / template)], capture_output=True, text=True)

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
            done = subprocess.run([os.environ["RELIGN_BENCH"], "validate", str(template)], capture_output=True, text=True)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("seed", done.stderr + done.stdout)

    def test_are_valid_with_one(self):
        published = TREE / "reports" / "paper" / "trainings" / "seed-0"
        imitation = TREE / "plugins" / "agents" / "imitation" / "imitation"
        for template in sorted(STUDY.glob("*.template.json")):
            with tempfile.TemporaryDirectory() as kept:
                folder = pathlib.Path(kept)
                text = template.read_text()
                for entry in json.loads(text)["algorithms"]:
                    for name in entry.get("trainings", []) if isinstance(entry, dict) else []:
                        (folder / name).parent.mkdir(exist_ok=True)
                        stands_for = published if entry["use"] == "ppo-paper" else imitation
                        for suffix in (".onnx", ".json"):
                            shutil.copy(stands_for.with_suffix(suffix), (folder / name).with_suffix(suffix))
                shutil.copy(template, folder)
                subprocess.run([sys.executable, str(SCRIPT), str(folder / template.name)], check=True, capture_output=True)
                suite = folder / template.name.replace(".template", "")
                done = subprocess.run([os.environ["RELIGN_BENCH"], "validate", str(suite)], capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
