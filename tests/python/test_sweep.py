"""relign-train sweep: what a file means, side by side, interrupted and resumed. The last test needs torch."""

import dataclasses
import importlib.util
import json
import signal
import subprocess
import sys
import time
import unittest
from unittest import mock

from support import Folder, failure, np

from relign_bench.training import sweep_report
from relign_bench.training.sweep import Sweep, read_sweep

# Stands for relign-train: writes curve and errors of two segments, each a while apart, and honours existing ones. What else it
# does is in the name of the folder.
TRAINER = """
import pathlib, sys, time
folder = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
curve = folder / "curve.csv"
head = "steps,hours,episodes,reward,episode,success,rmse_6,rmse_12,under_0.01,score"
lines = curve.read_text().splitlines() if curve.is_file() else [head]
(folder / "started").open("a").write(" ".join(sys.argv[1:]) + chr(10))
while len(lines) < 3:
    if "slow" in str(folder):
        time.sleep(20)
    if "broken" in str(folder):
        sys.exit("Traceback" + chr(10) + "error: no GPU here")
    steps = 20 * len(lines)
    lines.append(f"{steps},0.5,1,{-1 / steps},200,0.5,0.04,0.03,0,0.04")
    (folder / "errors.csv").write_text("steps,after,0,1" + chr(10) + "".join(
        f"{20 * k},{after},0.0{after},0.02" + chr(10) for k in range(1, len(lines)) for after in (6, 12)))
    curve.write_text(chr(10).join(lines) + chr(10))
    print(f"{steps} of 40 steps", file=sys.stderr, flush=True)
(folder / "ppo.json").write_text('{"trained": {"steps": 20}}')
(folder / "ppo.onnx").write_text("")
"""
TOTAL = {"total": 40, "stretch": 20, "environments": 1, "steps": 20}


class Files(Folder):
    def read(self, content):
        (self.folder / "study.json").write_text(content if isinstance(content, str) else json.dumps(content))
        return read_sweep(self.folder / "study.json", self.folder / "out")

    def run_stub(self, jobs, side_by_side=2, **arguments):
        lines = []
        failures = Sweep(jobs, side_by_side, log=lines.append, program=(sys.executable, "-c", TRAINER), **arguments).run()
        return failures, lines


class Reading(Files):
    def test_recipes_times_values_times_seeds(self):
        jobs = self.read({"scene": "relign_od", "trainings": [
            {"name": "grid", "settings": {"level": 0.5, "heads": []}, "vary": {"rate": [1e-3, 1e-5], "entropy": [0]},
             "seeds": [0, 3]},
            {"name": "a2c", "algorithm": "a2c", "preset": "package", "seeds": [1]}]})
        self.assertEqual([job.name for job in jobs], ["grid-rate=0.001-entropy=0/seed-0", "grid-rate=0.001-entropy=0/seed-3",
                                                      "grid-rate=1e-05-entropy=0/seed-0", "grid-rate=1e-05-entropy=0/seed-3",
                                                      "a2c/seed-1"])
        first, last = jobs[0].recipe, jobs[-1].recipe
        self.assertEqual((first.level, first.goal, first.rate, first.last_rate, first.heads), (0.5, 0.06, 1e-3, 1e-3, ()))
        self.assertEqual((last.gae_lambda, last.entropy, last.total, last.reward), (1.0, 0.0, 5_000_000, "minus_one"))
        self.assertEqual(self.read([{"name": "x", "seeds": [0]}])[0].arguments[-1], str(self.folder / "out/x/seed-0"))

    def test_wrong_files_are_refused_with_their_place(self):
        good = {"name": "x", "seeds": [0]}
        for content, words in [
            ("{", "study.json: not JSON"), ([], "expected a list of at least one training"),
            ({"trainings": [good], "scenes": 1}, "unknown key 'scenes'; did you mean 'scene'"),
            ([{**good, "sets": {}}], r"trainings\[0\]: unknown key 'sets'; did you mean 'settings'"),
            ([good, {"name": "y"}], r"trainings\[1\]: key 'seeds' is missing"),
            ([{**good, "seeds": [0, 0]}], "seeds: expected a list of different non-negative integers"),
            ([{**good, "seeds": 3}], "seeds: expected a list"), ([{**good, "name": "../x"}], "name: expected letters"),
            ([{**good, "preset": "papper"}], "unknown preset 'papper'; did you mean 'paper'"),
            ([{**good, "settings": {"rat": 1}}], r"trainings\[0\]: --set rat=1: unknown setting 'rat'"),
            ([{**good, "settings": {"rate": "fast"}}], "'fast' must be a number"),
            ([{**good, "settings": {"rate": True}}], "rate: expected a number"),
            ([{**good, "settings": {"scene": "toy"}}], "use the key 'scene' of the file"),
            ([{**good, "vary": {"rate": []}}], "vary: rate: expected a list of values"),
            ([{**good, "settings": {"level": 0.3}}], "add --set goal="), ([good, good], "'x/seed-0' is there twice"),
            ([{**good, "settings": {"warm_start": "w"}}], "use the key 'warm_start' of the file"),
            ([{**good, "settings": {"stretch": 20}}], "stretch=20 must be a multiple of environments \\* steps, here 500"),
            ([{**good, "vary": {"rate": [1, 1.0]}}], r"trainings\[0\]: vary: x-rate=1.0 is the same training as another one"),
            ('{"trainings": [], "trainings": [{"name": "x", "seeds": [0]}]}', "study.json: key 'trainings' is there twice"),
        ]:
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                self.read(content)

    def test_folder_with_another_recipe_is_refused_before_anything_starts(self):
        job = self.read([{"name": "x", "seeds": [0]}])[0]
        job.folder.mkdir(parents=True)
        (job.folder / "recipe.json").write_text(json.dumps({**vars(job.recipe), "scene": "tessar", "heads": [64, 64]}))
        with self.assertRaisesRegex(ValueError, r"x/seed-0: .*another recipe \(scene: 'tessar' in the folder, 'relign_od'"):
            self.read([{"name": "x", "seeds": [0]}])

    def test_folder_of_a_run_that_started_elsewhere_is_refused(self):
        job = self.read([{"name": "x", "seeds": [0]}])[0]
        job.folder.mkdir(parents=True)
        recipe = {**vars(job.recipe), "heads": [64, 64]}
        for begun, warm, words in (("sha256:0", {}, "has a run with initial weights, the file one without"),
                                   ("", {"warm_start": "w"}, "has a run without initial weights, the file one with")):
            (job.folder / "recipe.json").write_text(json.dumps({**recipe, "warm_start": begun}))
            with self.subTest(words), self.assertRaisesRegex(ValueError, f"x/seed-0: .*{words}"):
                self.read([{"name": "x", "seeds": [0], **warm}])


class Running(Files):
    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib is not installed: it draws the figure")
    def test_runs_what_is_missing_and_reports(self):
        content = [{"name": "a", "figure": "row", "settings": TOTAL, "seeds": [0, 1, 2]},
                   {"name": "b", "settings": TOTAL, "seeds": [5]}]
        jobs = self.read(content)
        failures, lines = self.run_stub(jobs, threads=1, minutes=5)
        self.assertEqual((failures, all(job.complete() for job in jobs)), ({}, True))
        self.assertEqual([line for line in lines if line.startswith("b/")],
                         ["b/seed-5: 20 of 40 steps", "b/seed-5: 40 of 40 steps"])
        self.assertIn("--threads 1 --device cpu --render cpu --minutes", (jobs[0].folder / "started").read_text())
        self.run_stub(jobs)
        self.assertEqual((jobs[0].folder / "started").read_text().count("\n"), 1)  # complete ones do not start again
        files = sweep_report.write(jobs, self.folder)
        self.assertEqual(files[0].read_text().count("\n"), 1 + 2 * 4)
        table = files[1].read_text().splitlines()
        self.assertTrue(table[2].startswith("| a | 3 of 3 complete | 40 | 1.5 | -0.04 [-0.04, -0.04] |"), table[2])
        self.assertTrue(table[3].endswith("| 0.0400 | 0.0160 |"), table[3])  # one seed: no interval
        self.assertTrue(files[2].read_bytes().startswith(b"\x89PNG"))

    def test_logs_are_those_of_every_training(self):
        jobs = self.read([{"name": "a", "settings": TOTAL, "seeds": [0, 1]}])
        with mock.patch("relign_bench.training.logs.import_module"):  # as if both packages were installed
            self.run_stub(jobs, loggers=["tensorboard", "mlflow"])
        for job in jobs:
            self.assertIn("--log tensorboard --log mlflow", (job.folder / "started").read_text())
        with self.assertRaisesRegex(ValueError, "unknown log 'tensorbord'; did you mean 'tensorboard'"):
            Sweep(jobs, 1, loggers=["tensorbord"])

    def test_failure_of_one_leaves_the_others(self):
        jobs = self.read([{"name": name, "settings": TOTAL, "seeds": [0]} for name in ("broken", "b")])
        failures, lines = self.run_stub(jobs)
        self.assertEqual(failures, {"broken/seed-0": "no GPU here"})
        self.assertTrue(jobs[1].complete())
        self.assertIn("broken/seed-0: no GPU here", lines)
        self.assertEqual(sweep_report.write(jobs[:1], self.folder), [])

    def test_ended_sweep_ends_its_trainings_and_resumes(self):
        (self.folder / "study.json").write_text(json.dumps([{"name": "slow", "settings": TOTAL, "seeds": [0]}]))
        code = ("import sys; from relign_bench.training.sweep import *\n"
                f"Sweep(read_sweep({str(self.folder / 'study.json')!r}, {str(self.folder / 'out')!r}), 1, log=lambda _: None, "
                f"program=(sys.executable, '-c', {TRAINER!r})).run()")
        process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
        started = self.folder / "out/slow/seed-0/started"
        while not started.is_file():
            self.assertIsNone(process.poll())
            time.sleep(0.1)
        process.send_signal(signal.SIGTERM)
        self.assertNotEqual(process.wait(timeout=60), 0)
        found = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=False).stdout
        self.assertNotIn(str(self.folder / "out/slow"), found)

    def test_time_that_is_over_starts_nothing(self):
        jobs = self.read([{"name": "a", "settings": TOTAL, "seeds": [0]}])
        failures, lines = self.run_stub(jobs, minutes=0.0)
        self.assertEqual((failures, lines), ({}, ["a/seed-0: not started, the time is over"]))

    def test_killed_training_is_named(self):
        jobs = self.read([{"name": "a", "settings": TOTAL, "seeds": [0]}])
        lines = []
        failures = Sweep(jobs, 1, log=lines.append,
                         program=(sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")).run()
        self.assertRegex(failures["a/seed-0"], "^ended by signal SIGKILL, which often means too little memory: .*resumes it$")

    def test_initial_weights_are_required_before_anything_starts(self):
        jobs = self.read([{"name": "a", "settings": TOTAL, "seeds": [0]}, {"name": "b", "preset": "tuned", "seeds": [0]}])
        with self.assertRaisesRegex(ValueError, "^b/seed-0: preset 'tuned' needs --warm-start"):
            self.run_stub(jobs)
        self.assertFalse((self.folder / "out").exists())
        jobs = self.read([{"name": "b", "preset": "tuned", "warm_start": "nowhere", "seeds": [0]}])
        with self.assertRaisesRegex(ValueError, "^b/seed-0: .*nowhere' is not the folder of a run"):
            self.run_stub(jobs)

    def test_network_of_an_earlier_session_is_not_complete(self):
        job = self.read([{"name": "a", "settings": TOTAL, "seeds": [0]}])[0]
        self.run_stub([job])
        self.assertTrue(job.complete())
        curve = job.folder / "curve.csv"
        curve.write_text(curve.read_text().removesuffix("0.04\n") + "0.03\n")
        self.assertFalse(job.complete())  # ppo.json is of step 20, and step 40 is better
        (job.folder / "ppo.json").write_text('{"trained": {"steps": 40}}')
        self.assertTrue(job.complete())
        (job.folder / "ppo.onnx").unlink()
        self.assertFalse(job.complete())

    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib is not installed: it draws the figure")
    def test_report_of_segments_without_episodes_and_of_damaged_files(self):
        job = self.read([{"name": "a", "settings": TOTAL, "seeds": [0]}])[0]
        self.run_stub([job])
        curve, errors = job.folder / "curve.csv", job.folder / "errors.csv"
        good = curve.read_text()
        curve.write_text(good.replace("-0.025,200,0.5", ",,"))
        table = sweep_report.write([job], self.folder)[1].read_text()
        self.assertIn("| a | 1 of 1 complete | 40 | 0.5 | - | - | 0.0400 |", table)
        self.assertNotIn("nan", (self.folder / "sweep.csv").read_text())
        self.assertNotIn("started from", table)
        begun = dataclasses.replace(job, warm_start=self.folder)
        self.assertIn("Steps and hours of a do not include those of the runs that they started from.",
                      sweep_report.write([begun], self.folder)[1].read_text())
        report = ("sweep", self.folder / "study.json", "-o", self.folder / "out", "--report")
        for text, words in ((good.replace(",success", ""), "curve.csv:2: success: expected a number, found None"),
                            (good.replace("-0.025", "fast"), "curve.csv:3: reward: expected a number, found 'fast'"),
                            (good[:-12], "curve.csv:3: under_0.01: expected a number, found None")):
            curve.write_text(text)
            self.assertIn(words, failure(*report))
            self.assertFalse(job.complete())  # the same command writes it anew
        curve.write_text(good)
        self.assertTrue(job.complete())
        errors.unlink()
        self.assertFalse(job.complete())
        self.assertRegex(failure(*report), "errors.csv' has 0 training segments, and curve.csv 2")

    @unittest.skipUnless(importlib.util.find_spec("stable_baselines3"), "stable_baselines3 is not installed")
    def test_damaged_report_does_not_hide_the_reason(self):
        jobs = self.read([{"name": "x", "settings": TOTAL, "seeds": [0]}])
        jobs[0].folder.mkdir(parents=True)
        (jobs[0].folder / "curve.csv").write_text("steps\nx\n")
        with mock.patch("relign_bench.training.sweep.Sweep.run", return_value={"x/seed-0": "no GPU here"}):
            message = failure("sweep", self.folder / "study.json", "-o", self.folder / "out")
        self.assertEqual(message, "error: 1 of 1 runs failed, first x/seed-0: no GPU here\n")


class Intervals(unittest.TestCase):
    def test_two_level_interval_covers_both_spreads(self):
        random = np.random.default_rng(1)
        equal = np.tile(random.normal(1, 0.1, 100), (5, 1))  # trainings do not differ
        low, high = sweep_report.two_level(equal)
        self.assertTrue(0.02 < high - low < 0.1, (low, high))  # 2 * 1.96 * 1.25 * 0.1 / sqrt(100) = 0.049
        wide = equal + np.linspace(-0.5, 0.5, 5)[:, None]
        low, high = sweep_report.two_level(wide)
        self.assertTrue(0.4 < high - low < 0.9, (low, high))  # 2 * 1.96 * 0.354 / sqrt(5) = 0.62
        low, high = sweep_report.over_trainings(wide.mean(axis=1))
        self.assertTrue(0.4 < high - low < 0.9, (low, high))


class Trainings(Files):
    def test_trains_writes_and_refuses_a_full_disk(self):
        try:
            import stable_baselines3  # noqa: F401
            import torch  # noqa: F401
        except ImportError as problem:
            self.skipTest(f"{problem}: training needs torch and stable-baselines3, from the Python index")
        settings = {"size": 100, "environments": 1, "steps": 10, "batch": 10, "epochs": 1, "episode": 5, "total": 10,
                    "stretch": 10}
        (self.folder / "study.json").write_text(json.dumps([{"name": "x", "settings": settings, "seeds": [0]}]))
        command = [sys.executable, "-m", "relign_bench.training", "sweep", str(self.folder / "study.json"), "-o",
                   str(self.folder / "out"), "--threads", "1", "--json"]
        # A limit on the size of files stands for a full disk: the weights do not fit.
        full = subprocess.run(["sh", "-c", 'ulimit -f 64; exec "$@"', "sh", *command], capture_output=True, text=True,
                              check=False)
        self.assertEqual(full.returncode, 2, full.stderr)
        self.assertRegex(full.stderr, "1 of 1 runs failed, first x/seed-0: cannot write .*the same command resumes")
        self.assertEqual(list((self.folder / "out").rglob("*.half")), [])
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["complete"], 1)
        self.assertIn("x/seed-0: 10 of 10 steps", done.stderr)
        self.assertEqual({path.name for path in (self.folder / "out").iterdir()}, {"x", "sweep.csv", "sweep.md", "sweep.png"})
        side = json.loads((self.folder / "out/x/seed-0/ppo.json").read_text())
        self.assertEqual((side["observation"]["values"], side["trained"]["recipe"]["heads"]), ("irradiance", [64, 64]))


if __name__ == "__main__":
    unittest.main()
