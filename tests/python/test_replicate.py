"""The driver of the replication study, reports/paper/replicate.py: order, packs, and runs that are killed, which need torch."""

import importlib.util
import io
import json
import os
import pathlib
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
import unittest
from unittest import mock

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "reports" / "paper" / "replicate.py"
specification = importlib.util.spec_from_file_location("replicate", SCRIPT)
replicate = importlib.util.module_from_spec(specification)
sys.modules["replicate"] = replicate  # for its dataclass
specification.loader.exec_module(replicate)

IMITATE = ("imitate", *(part for setting in ("size=40", "levels=0,0.5", "lenses=40", "pictures=4", "passes=3", "moves=3",
                                             "optimum_samples=32", "batch=32") for part in ("--set", setting)))
TUNED = ("ppo", "--preset", "tuned", *(part for setting in ("size=40", "environments=10", "batch=60", "epochs=1", "total=360",
                                                            "stretch=120", "optimum_samples=32")
                                       for part in ("--set", setting)))
TINY = {"rounds": [{"seeds": [3], "trainings": [
    {"name": "first", "arguments": IMITATE, "networks": ["last"]},
    {"name": "then", "arguments": TUNED, "networks": ["last", "best"], "from": "first", "first_seed": 100}]}]}
TWICE = {"rounds": [{"seeds": [3], "trainings": [
    {"name": name, "arguments": ["ppo"], "networks": [], "from": start}
    for name, start in (("first", ""), ("then", "first"), ("paper", ""), ("paper-then", "paper"))]}]}


class Folder(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)

    def jobs(self, plan):
        (self.folder / "plan.json").write_text(json.dumps(plan))
        return replicate.read_plan(self.folder / "plan.json")

    def study(self, plan, work="work"):
        return replicate.Study(self.jobs(plan), self.folder / work, self.folder / "results")

    @staticmethod
    def begin(study, job, content=b"weights"):
        folder = study.work / job.place
        folder.mkdir(parents=True)
        (folder / replicate.CHECKPOINT).write_bytes(content)
        (folder / "recipe.json").write_text("{}")

    @staticmethod
    def complete(study, job):
        study.record(job).parent.mkdir(parents=True)
        study.record(job).write_text("{}")


class Plans(Folder):
    def test_orders_by_round_then_seed(self):
        names = [[{"name": name, "arguments": [], "networks": []} for name in pair] for pair in ("ab", "cd")]
        jobs = self.jobs({"rounds": [{"seeds": [1, 2], "trainings": names[0]}, {"seeds": [7], "trainings": names[1]}]})
        self.assertEqual([str(job.place) for job in jobs],
                         ["a/seed-1", "b/seed-1", "a/seed-2", "b/seed-2", "c/seed-7", "d/seed-7"])

    def test_gives_a_continued_training_another_seed(self):
        jobs = self.jobs(TINY)
        self.assertEqual([job.arguments[-4:] for job in jobs],
                         [("--seed", "3", "--threads", "1"), ("--seed", "103", "--threads", "1")])

    def test_refuses_a_training_that_starts_from_a_later_one(self):
        trainings = TINY["rounds"][0]["trainings"]
        with self.assertRaisesRegex(ValueError, "then/seed-3 starts from 'first', of which no training .* is before it"):
            self.jobs({"rounds": [{"seeds": [3], "trainings": trainings[1::-1]}]})

    def test_refuses_a_training_that_is_there_twice(self):
        with self.assertRaisesRegex(ValueError, "first/seed-3 is there twice, again in round 2"):
            self.jobs({"rounds": TINY["rounds"] * 2})

    def test_published_plan_names_the_networks_of_both_suites(self):
        jobs = replicate.read_plan(SCRIPT.with_name("replication.json"))
        published = {f"{job.name}/seed-{job.seed}-{kind}.onnx" for job in jobs for kind in job.networks}
        named = set()
        for template in (SCRIPT.parent / "trainings" / "replication").glob("*.template.json"):
            for entry in json.loads(template.read_text())["algorithms"]:
                named.update(entry["trainings"] if isinstance(entry, dict) else ())
        self.assertEqual(published, named)


class Packs(Folder):
    def test_have_what_is_under_way_and_what_another_starts_from(self):
        study = self.study(TWICE)
        first, then, paper, paper_then = study.jobs
        for job in (first, paper, paper_then):
            self.begin(study, job)
        for job in (first, paper):
            self.complete(study, job)
        self.assertEqual(study.pack(), [study.pack_of(first), study.pack_of(paper_then)])
        self.begin(study, then)
        self.assertEqual(study.pack(), [study.pack_of(then), study.pack_of(paper_then)])
        self.assertFalse(study.pack_of(first).exists())
        for job in (then, paper_then):
            self.complete(study, job)
        self.assertEqual(study.pack(), [])
        self.assertFalse((study.results / "in-flight").exists())

    def test_keep_their_bytes_and_files(self):
        study = self.study(TINY)
        self.begin(study, study.jobs[0])
        before = study.pack()[0].read_bytes()
        os.utime(study.work / study.jobs[0].place / "recipe.json", (1, 1))
        self.assertEqual(study.pack()[0].read_bytes(), before)
        elsewhere = self.study(TINY, "elsewhere")
        folder = elsewhere.unpack(study.jobs[0])
        self.assertEqual({file.name: file.read_bytes() for file in folder.iterdir()},
                         {replicate.CHECKPOINT: b"weights", "recipe.json": b"{}"})
        self.assertEqual(elsewhere.pack()[0].read_bytes(), before)

    def test_that_are_not_unpacked_stay(self):
        study = self.study(TINY)
        self.begin(study, study.jobs[0])
        files = study.pack()
        self.assertEqual(self.study(TINY, "elsewhere").pack(), files)

    def test_refuse_other_files(self):
        study = self.study(TINY)
        study.pack_of(study.jobs[0]).parent.mkdir(parents=True)
        with tarfile.open(study.pack_of(study.jobs[0]), "w:xz") as pack:
            member = tarfile.TarInfo("../plan.json")
            pack.addfile(member, io.BytesIO())
        with self.assertRaisesRegex(ValueError, r"unexpected member '\.\./plan\.json'"):
            study.unpack(study.jobs[0])

    def test_refuse_what_is_too_large(self):
        study = self.study(TINY)
        self.begin(study, study.jobs[0], os.urandom(2000))
        with mock.patch.object(replicate, "LARGEST_PACK", 1500), self.assertRaisesRegex(
                ValueError, "first/seed-3 has 2[0-9]{3} bytes packed; more than 1500 are not kept"):
            study.pack()

    def test_lost_source_is_named(self):
        study = self.study(TINY)
        self.complete(study, study.jobs[0])
        with self.assertRaisesRegex(ValueError, "then/seed-3 starts from first/seed-3, whose checkpoint is not in"):
            study.train(study.jobs[1])


@unittest.skipUnless(importlib.util.find_spec("torch") and importlib.util.find_spec("stable_baselines3"),
                     "training needs torch and stable-baselines3, from the Python index")
class Killed(Folder):
    def command(self, name, *options):
        return [sys.executable, str(SCRIPT), "--plan", str(self.folder / "plan.json"),
                "--work", str(self.folder / name / "work"), "--results", str(self.folder / name / "results"), *options]

    def results(self, name):
        """Contents of all results, without what is measured in hours."""
        found = {}
        for file in sorted((self.folder / name / "results").rglob("*.*")):
            content = file.read_bytes()
            if file.name.endswith("curve.csv") and b"hours" in content:
                rows = [line.split(",") for line in content.decode().splitlines()]
                hours = rows[0].index("hours")
                content = [row[:hours] + row[hours + 1:] for row in rows]
            elif file.suffix == ".json" and "trained" in (about := json.loads(content)):
                recipe = {**about["trained"]["recipe"], "warm_start": ""}  # the hash of a file that has hours in it
                content = {**about, "trained": {**about["trained"], "recipe": recipe, "hours": 0, "warm_start": {}}}
            found[str(file.relative_to(self.folder / name / "results"))] = content
        return found

    def kill_once_there_is(self, name, file):
        process = subprocess.Popen(self.command(name), stderr=subprocess.DEVNULL, start_new_session=True)
        until = time.monotonic() + 240
        while not (self.folder / name / "work" / file).is_file() and process.poll() is None and time.monotonic() < until:
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        self.assertTrue((self.folder / name / "work" / file).is_file())

    def test_study_ends_with_the_same_bytes(self):
        self.jobs(TINY)
        subprocess.run(self.command("whole"), check=True, capture_output=True)
        for job in ("first", "then"):
            self.kill_once_there_is("killed", f"{job}/seed-3/checkpoint.pt")
            # The next session has what was packed only.
            subprocess.run(self.command("killed", "--pack"), check=True, capture_output=True)
            (self.folder / "killed/work").rename(self.folder / f"left-{job}")
        subprocess.run(self.command("killed"), check=True, capture_output=True)
        subprocess.run(self.command("killed", "--pack"), check=True, capture_output=True)
        whole, killed = self.results("whole"), self.results("killed")
        self.assertEqual(sorted(whole), sorted(killed))
        for name, content in whole.items():
            self.assertEqual(content, killed[name], name)
        for network in ("first/seed-3-last", "then/seed-3-best", "then/seed-3-last"):
            self.assertIn(f"{network}.onnx", whole)
        record = json.loads(whole["then/seed-3.json"])
        self.assertTrue(record["command"].endswith("--seed 103 --threads 1 --warm-start first/seed-3 -o then/seed-3"))

    def test_ended_driver_ends_its_training(self):
        self.jobs(TINY)
        process = subprocess.Popen(self.command("ended"), stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        while not (self.folder / "ended" / "work" / "first/seed-3/recipe.json").is_file():
            self.assertIsNone(process.poll())
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(timeout=60), 130)
        found = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=False).stdout
        self.assertNotIn(str(self.folder / "ended"), found)


if __name__ == "__main__":
    unittest.main()
