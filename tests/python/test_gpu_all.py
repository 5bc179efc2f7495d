"""benchmarks/gpu_all.py: order, ledger, time limit, what is skipped, resuming; every part at small size on the emulated driver.

Parts that need torch run where it and Stable-Baselines3 are installed; of these all trainings only with RELIGN_TRAINING, as
`./quickstart test --training` sets it.
"""

import contextlib
import dataclasses
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

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

import gpu_all  # noqa: E402
import gpu_packs  # noqa: E402
import gpu_trainings  # noqa: E402
from gpu_parts import PARTS, TINY, Part, Place  # noqa: E402

BUILD = pathlib.Path(os.environ.get("RELIGN_BUILD", "/none"))
EMULATED = os.environ.get("RELIGN_EMULATED_DRIVER", "")
LEARNS = all(importlib.util.find_spec(name) for name in ("torch", "stable_baselines3", "sb3_contrib", "matplotlib", "onnx"))
SKIPPED = 70  # seconds: more than what is kept for packing


def says(text, status=0, needs=(), **arguments):
    """A part that prints a text."""
    code = f"import sys; print({text!r}); sys.exit({status})"
    return Part(**{"name": "one", "about": "a test", "seconds": 1, "needs": needs,
                   "command": lambda *_: [sys.executable, "-c", code], **arguments})


class Folder(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)
        (self.folder / "out").mkdir()
        patience = mock.patch.object(gpu_all, "GRACE", 1)
        patience.start()
        self.addCleanup(patience.stop)

    def session(self, *parts, seconds=SKIPPED, commit="abc", **arguments):
        """Runs parts; returns whether nothing failed, the ledger's parts, and what was printed."""
        place = Place(self.folder, self.folder / "work", self.folder / "state", self.folder / "out",
                      self.folder / "out/gpu_ledger.json")
        here = arguments.pop("here", {"gpu": "A card", "driver": "1.2"})
        session = gpu_all.Session(place, gpu_all.Ledger(place.ledger), seconds, time.monotonic(), here,
                                  {"torch": "no such module"}, commit, parts, **arguments)
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            fine = session.run()
        return fine, json.loads(place.ledger.read_text())["parts"], printed.getvalue()


class Ledger(Folder):
    def test_keeps_results_with_commit_and_card(self):
        fine, parts, printed = self.session(says("| images | 5 ms |\n| head | |\n|---|---|\nmore"))
        entry = parts["one"]
        self.assertTrue(fine)
        self.assertEqual(entry["results"], {"images": "5 ms"})
        self.assertEqual([entry[key] for key in ("status", "commit", "card", "driver", "last_line")],
                         ["done", "abc", "A card", "1.2", "more"])
        self.assertIn("| images | 5 ms |", printed)
        self.assertEqual((self.folder / "out/gpu_all.log").read_text(), printed)

    def test_what_is_done_is_not_run_again_unless_it_is_named(self):
        self.session(says("first"))
        _, parts, printed = self.session(says("second"), commit="def")
        self.assertIn("skipped: done by abc on A card", printed)
        self.assertEqual(parts["one"]["last_line"], "first")
        self.assertEqual(self.session(says("second"), again=("one",))[1]["one"]["last_line"], "second")

    def test_what_failed_is_run_again_by_another_commit(self):
        fine, parts, printed = self.session(says("wrong bits", status=1), says("next", name="two"))
        self.assertFalse(fine)
        self.assertEqual([parts[name]["status"] for name in ("one", "two")], ["failed", "done"])
        self.assertIn("-- failed: one", printed)
        self.assertIn("failed with this commit already", self.session(says("right"))[2])
        self.assertEqual(self.session(says("right"), commit="def")[1]["one"]["status"], "done")

    def test_what_cannot_begin_is_failed(self):
        parts = self.session(says("", command=lambda *_: ["/none/program"]))[1]
        self.assertIn("No such file", parts["one"]["last_line"])

    def test_results_of_stretches_add_up(self):
        stretch = says("| a | 1 |\n| b | 1 |", gpu_trainings.UNFINISHED, resumes=True)
        self.assertEqual(self.session(stretch)[1]["one"]["status"], "unfinished")
        parts = self.session(says("| b | 2 |", resumes=True))[1]
        self.assertEqual((parts["one"]["status"], parts["one"]["results"]), ("done", {"a": "1", "b": "2"}))

    def test_of_several_ledgers_the_furthest_entry_counts(self):
        def write(name, **entries):
            parts = {part: {"status": status, "seconds": seconds} for part, (status, seconds) in entries.items()}
            (self.folder / name).write_text(json.dumps({"format": 1, "parts": parts}))
            return self.folder / name

        files = (self.folder / "new", write("a", x=("unfinished", 300), y=("done", 1), z=("failed", 2)),
                 write("b", x=("unfinished", 200), y=("failed", 9), w=("done", 1)), self.folder / "none")
        known = gpu_all.Ledger(*files).parts
        self.assertEqual({name: (entry["status"], entry["seconds"]) for name, entry in known.items()},
                         {"x": ("unfinished", 300), "y": ("done", 1), "z": ("failed", 2), "w": ("done", 1)})

    def test_second_call_on_a_machine_knows_the_first(self):
        self.session(says("x"))
        self.assertEqual((self.folder / "work/gpu_ledger.json").read_text(), (self.folder / "out/gpu_ledger.json").read_text())

    def test_parts_are_written_in_their_order(self):
        self.session(*(dataclasses.replace(says("x"), name=name) for name in ("latency", "bits", "other")))
        parts = json.loads((self.folder / "out/gpu_ledger.json").read_text())["parts"]
        self.assertEqual(list(parts), ["bits", "latency", "other"])


class Limits(Folder):
    def hanging(self, **arguments):
        # It ignores SIGTERM, and so does its child, which keeps the pipe open.
        code = ("import os, signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); "
                "print(os.fork(), flush=True); time.sleep(600)")
        return says("", command=lambda *_: [sys.executable, "-c", code], **arguments)

    def test_part_that_hangs_is_ended_with_its_children(self):
        begun = time.monotonic()
        fine, parts, printed = self.session(self.hanging(), says("next", name="two"))
        self.assertFalse(fine)
        self.assertEqual((parts["one"]["status"], parts["two"]["status"]), ("failed", "done"))
        self.assertIn("without an end of its own", parts["one"]["last_line"])
        self.assertLess(time.monotonic() - begun, gpu_all.LONGEST + 4 * gpu_all.GRACE)
        child = max(int(line) for line in printed.splitlines() if line.isdigit())
        with self.assertRaises(ProcessLookupError):
            for _ in range(50):
                os.kill(child, 0)
                time.sleep(0.1)

    def test_part_is_ended_when_the_time_is_over_and_is_not_failed(self):
        _, parts, printed = self.session(self.hanging(seconds=2), says("next", name="two"), seconds=gpu_all.KEPT + 3)
        self.assertEqual(parts["one"]["status"], "unfinished")
        self.assertNotIn("two", parts)
        self.assertRegex(printed, "-- two: skipped: needs about 1 s, 0 s are left")

    HANGING_TRAINING = """
import pathlib, signal, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
run = pathlib.Path(sys.argv[1], "x/seed-0")
run.mkdir(parents=True)
(run / "recipe.json").write_text('{"total": 30, "algorithm": "ppo"}')
(run / "curve.csv").write_text("steps" + chr(10) + "10" + chr(10))
(run / "checkpoint.pt").write_text("weights")
time.sleep(600)
"""

    def test_training_that_hangs_is_packed_before_the_time_is_over(self):
        begun, seconds = time.monotonic(), gpu_all.KEPT + 3
        command = [sys.executable, "-c", self.HANGING_TRAINING, str(self.folder / "work")]
        parts = self.session(says("", resumes=True, command=lambda *_: command), seconds=seconds)[1]
        self.assertLess(time.monotonic() - begun, seconds)
        self.assertEqual(parts["one"]["status"], "unfinished")
        (run, found), = gpu_packs.latest(self.folder / "out").items()
        self.assertEqual((run, *found[:2]), ("x/seed-0", 10, False))

    def test_part_without_enough_time_is_left_out_for_a_shorter_one(self):
        _, parts, printed = self.session(says("long", seconds=100), says("short", name="two"))
        self.assertEqual(list(parts), ["two"])
        self.assertRegex(printed, r"-- one: skipped: needs about 100 s, [34]\d s are left")

    def test_part_that_needs_what_is_missing_is_left_out_with_the_reason(self):
        _, parts, printed = self.session(says("x", needs=("gpu", "torch")), says("x", name="two", needs=("gpu", "cc")))
        self.assertEqual(parts, {})
        self.assertIn("-- one: skipped: needs torch: no such module\n-- two: skipped: needs cc: not found", printed)


class Variables(Folder):
    def test_driver_of_a_container_and_packages_of_the_kit_are_found(self):
        with mock.patch.dict(os.environ, {"PATH": "/bin", "LD_LIBRARY_PATH": "", "PYTHONPATH": "/mine"}):
            found = gpu_all.variables(self.folder)
        self.assertEqual([found[name] for name in ("PATH", "LD_LIBRARY_PATH", "PYTHONPATH")],
                         ["/bin:/usr/local/cuda/bin:/usr/local/nvidia/bin", "/usr/local/nvidia/lib64",
                          f"{(self.folder / 'python').resolve()}:/mine"])

    def test_probe_that_does_not_answer_is_no_gpu(self):
        with mock.patch.object(gpu_all, "HERE", self.folder):
            here, missing = gpu_all.probe(self.folder)
        self.assertEqual(here, {})
        self.assertIn("gpu_probe.py did not answer", missing["gpu"])


class TheList(Folder):
    def test_begins_with_what_needs_no_torch_and_names_are_different(self):
        names = [part.name for part in PARTS]
        self.assertEqual(len(names), len(set(names)))
        resuming = [part.resumes for part in PARTS]
        self.assertEqual(resuming, sorted(resuming))
        without = [part.name for part in PARTS if "torch" not in part.needs]
        self.assertEqual(without, ["bits", "ghosts", "camera_2mp", "memcheck", "racecheck", "camera_2mp-times", "latency",
                                   "ghost-times", "batch", "images"])
        text = gpu_all.list_of_parts(PARTS)
        self.assertIn("all need gpu and nvrtc:\n", text)
        self.assertIn("  latency              5 s  one image; goal under 0.2 ms\n", text)
        self.assertRegex(text, "  a2c +120 s\\+ .*; needs torch, torch-gpu, gymnasium, module, stable_baselines3, ")

    def test_wrong_arguments_are_named(self):
        for arguments, message in ((["--only", "image"], "unknown part 'image'; parts: bits, "),
                                   (["--ledger", "/none"], "--ledger '/none' is not there"),
                                   (["--kit", str(self.folder)], "is not a kit: it has no relign-bench-gpu; make one with")):
            command = [str(ROOT / "benchmarks/gpu_all.sh"), "--seconds", "1", "--out", str(self.folder / "out"), *arguments]
            done = subprocess.run(command, capture_output=True, text=True, check=False,
                                  env={**os.environ, "PYTHON": sys.executable})
            self.assertEqual(done.returncode, 2)
            self.assertIn(message, done.stderr)


class Packs(Folder):
    def begin(self, run, steps, total=40, work="work", **files):
        folder = self.folder / work / run
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "recipe.json").write_text(json.dumps({"algorithm": "ppo", "total": total}))
        (folder / "curve.csv").write_text("steps,score\n" + "".join(f"{k},0.1\n" for k in range(10, steps + 1, 10)))
        for name, content in {"checkpoint.pt": f"weights {steps}", **files}.items():
            (folder / name).write_text(content)
        return folder

    def pack(self, work="work", out="state"):
        return gpu_packs.pack(self.folder / work, self.folder / out)

    def test_content_of_any_length_comes_back(self):
        for length in (0, 1, 2, 3, 4, 5, 1001):
            content = os.urandom(length)
            self.assertEqual(gpu_packs.expanded(gpu_packs.squeezed(content)), content)

    def test_run_comes_back_as_it_was(self):
        before = self.begin("ppo/seed-1", 20, **{"best.pt": "best", "log.txt": "long"})
        (pack,) = self.pack()
        gpu_packs.unpack(self.folder / "state", self.folder / "new")
        after = self.folder / "new/ppo/seed-1"
        for name in ("recipe.json", "curve.csv", "checkpoint.pt", "best.pt"):
            self.assertEqual((before / name).read_bytes(), (after / name).read_bytes())
        self.assertFalse((after / "log.txt").exists())
        self.assertEqual(self.pack("new", "other"), [], "nothing was trained since")
        self.assertTrue(pack.is_file())

    def test_pack_with_the_most_steps_counts_and_later_work_stays(self):
        self.begin("ppo/seed-1", 30)
        self.pack()
        self.begin("ppo/seed-1", 20, work="older")
        self.pack("older", "older_state")
        for file in (self.folder / "older_state").iterdir():
            file.rename(self.folder / "state" / file.name)
        gpu_packs.unpack(self.folder / "state", self.folder / "new")
        self.assertEqual((self.folder / "new/ppo/seed-1/checkpoint.pt").read_text(), "weights 30")
        self.begin("ppo/seed-1", 40, total=50, work="new")
        gpu_packs.unpack(self.folder / "state", self.folder / "new")
        self.assertEqual((self.folder / "new/ppo/seed-1/checkpoint.pt").read_text(), "weights 40")

    def test_complete_run_is_packed_without_its_checkpoint(self):
        self.begin("ppo/seed-1", 40, **{"ppo.onnx": "network", "ppo.json": "{}"})
        self.pack()
        self.assertEqual(gpu_trainings.main(["unpack", str(self.folder / "state"), "--work", str(self.folder / "new")]), 0)
        after = self.folder / "new/ppo/seed-1"
        self.assertTrue(gpu_packs.complete(after))
        self.assertEqual({file.name for file in after.iterdir()}, {"recipe.json", "curve.csv", "ppo.onnx", "ppo.json"})

    def test_files_have_a_limited_size_and_replace_earlier_ones(self):
        with mock.patch.object(gpu_packs, "LARGEST_PACK", 15_000):
            for seed in range(3):
                (self.begin(f"ppo/seed-{seed}", 20) / "checkpoint.pt").write_bytes(os.urandom(6_000))
            self.assertEqual(len(self.pack()), 2)
            self.begin("ppo/seed-0", 30)
            second = self.pack()
        self.assertEqual(set((self.folder / "state").iterdir()), set(second))

    def test_tidy_keeps_the_latest_of_each_run(self):
        for work, run, steps in (("a", "ppo/seed-1", 10), ("b", "ppo/seed-1", 20), ("b", "ppo/seed-2", 10)):
            self.begin(run, steps, work=work)
        for work in ("a", "b"):
            self.pack(work, f"of_{work}")
            for file in (self.folder / f"of_{work}").iterdir():
                (self.folder / "state").mkdir(exist_ok=True)
                file.rename(self.folder / "state" / file.name)
        (kept,) = gpu_packs.tidy(self.folder / "state")
        self.assertEqual(list((self.folder / "state").iterdir()), [kept])
        gpu_packs.unpack(self.folder / "state", self.folder / "new")
        self.assertEqual((self.folder / "new/ppo/seed-1/checkpoint.pt").read_text(), "weights 20")
        self.assertEqual((self.folder / "new/ppo/seed-2/checkpoint.pt").read_text(), "weights 10")

    def test_foreign_members_are_refused(self):
        self.begin("ppo/seed-1", 20)
        (file,) = self.pack()
        with tarfile.open(file, "a") as archive:
            archive.add(__file__, "ppo/seed-1/../../evil.xz")
        with self.assertRaisesRegex(ValueError, "unexpected member"):
            gpu_packs.unpack(self.folder / "state", self.folder / "new")


@unittest.skipUnless(EMULATED and (BUILD / "benchmarks/relign-bench-gpu").is_file(),
                     "needs the emulated driver and relign-bench-gpu (RELIGN_BUILD_BENCHMARKS)")
class EveryPart(Folder):
    """All parts at small size, to their last line."""

    def setUp(self):
        super().setUp()
        for name, target in (("relign-bench-gpu", BUILD / "benchmarks/relign-bench-gpu"), ("python", BUILD / "python"),
                             ("plugins", BUILD / "lib/relign-bench/plugins"), ("tests", ROOT / "tests"),
                             ("randomisation.json", ROOT / "python/relign_bench/training/randomisation.json")):
            (self.folder / name).symlink_to(target)
        stand_in = self.folder / "bin/compute-sanitizer"
        stand_in.parent.mkdir()
        stand_in.write_text('#!/bin/sh\nwhile [ "$1" != "${1#--}" ]; do shift 2; done\n"$@"\n')
        stand_in.chmod(0o755)

    def run_small(self, *parts):
        environment = {**os.environ, "RELIGN_LIBCUDA": EMULATED, "RELIGN_LIBNVRTC": EMULATED, "PYTHON": sys.executable,
                       "PATH": f"{self.folder / 'bin'}:{os.environ['PATH']}"}
        command = [str(ROOT / "benchmarks/gpu_all.sh"), "--small", "--seconds", "800", "--kit", str(self.folder)]
        command += ["--only", *parts]
        for folder in ("out", "work", "state"):
            command += [f"--{folder}", str(self.folder / folder)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        entries = json.loads((self.folder / "out/gpu_ledger.json").read_text())["parts"]
        self.assertEqual({name: entry["status"] for name, entry in entries.items()}, dict.fromkeys(parts, "done"), done.stdout)
        return {name: entry["results"] for name, entry in entries.items()}

    def test_parts_without_torch(self):
        found = self.run_small(*(part.name for part in PARTS if "torch" not in part.needs))
        self.assertTrue(all(found.values()), found)
        self.assertEqual(found["bits"]["captures with the CPU's bits"], "2 of 2 (0 pixels differ, by 0 at most)")
        self.assertIn("one image, copied to the host", found["latency"])
        self.assertTrue(any("noise-free RMSE" in what for what in found["batch"]))

    @unittest.skipUnless(LEARNS, "needs torch and Stable-Baselines3")
    def test_environment_and_tests(self):
        found = self.run_small("tests", "environment")
        self.assertTrue(any("resets and noise-free RMSE" in what for what in found["environment"]))

    @unittest.skipUnless(LEARNS and os.environ.get("RELIGN_TRAINING"), "three minutes; ./quickstart test --training runs it")
    def test_trainings(self):
        found = self.run_small(*(part.name for part in PARTS if part.resumes))
        self.assertEqual(len(found), 8)
        self.assertRegex(found["ppo-200"]["ppo-rho0/seed-1"], "^20 of 20 steps")
        self.assertIn("imitation-100: median noise-free RMSE after twelve images, N = 0.5", found["imitation-100"])
        self.assertLessEqual(len(list((self.folder / "out").glob("runs-*.tar"))), 2)


@unittest.skipUnless(LEARNS and os.environ.get("RELIGN_TRAINING"), "half a minute; ./quickstart test --training runs it")
class Resuming(Folder):
    SWEEP = {"trainings": [{"name": "x", "settings": {**TINY, "total": 30}, "seeds": [0]}]}

    def command(self, work, *further):
        (self.folder / "study.json").write_text(json.dumps(self.SWEEP))
        return [sys.executable, str(ROOT / "benchmarks/gpu_trainings.py"), "sweep", str(self.folder / "study.json"), "--work",
                str(self.folder / work), "--state", str(self.folder / "state"), "--seconds", "300", *further]

    def weights(self, work):
        import torch

        return torch.load(self.folder / work / "x/seed-0/checkpoint.pt", weights_only=True)

    def test_training_ended_packed_and_resumed_elsewhere_has_the_bits_of_one_without_interruption(self):
        subprocess.run(self.command("whole"), check=True, capture_output=True)
        # In a session of its own, as gpu_all.py does it, so that all of it can be killed.
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        running = subprocess.Popen(self.command("first"), **quiet, start_new_session=True)
        checkpoint = self.folder / "first/x/seed-0/checkpoint.pt"
        while running.poll() is None and not checkpoint.is_file():
            time.sleep(0.02)
        os.killpg(running.pid, signal.SIGKILL)
        running.wait()
        self.assertLess(self.weights("first")["steps"], 30, "it was killed too late")
        gpu_packs.pack(self.folder / "first", self.folder / "state")
        done = subprocess.run(self.command("second"), check=True, capture_output=True, text=True)
        self.assertIn("| x/seed-0 | 30 of 30 steps", done.stdout)
        whole, resumed = self.weights("whole"), self.weights("second")
        for name, value in whole["policy"].items():
            self.assertTrue(value.equal(resumed["policy"][name]), name)
        for state, other in zip(whole["optimizer"]["state"].values(), resumed["optimizer"]["state"].values()):
            self.assertTrue(all(value.equal(other[name]) for name, value in state.items()))

    def test_training_that_was_begun_elsewhere_is_not_begun_anew(self):
        ledger = self.folder / "ledger.json"
        ledger.write_text(json.dumps({"parts": {"x": {"results": {"x/seed-0": "20 of 30 steps, 0.1 hours"}}}}))
        done = subprocess.run(self.command("work", "--ledger", str(ledger)), check=False, capture_output=True, text=True)
        self.assertEqual(done.returncode, gpu_trainings.UNFINISHED, done.stderr)
        self.assertIn("x/seed-0: left out: the ledger has it after 20 steps, and no pack in", done.stdout)
        self.assertFalse((self.folder / "work/x").exists())

    def test_stretch_that_is_too_short_trains_nothing_and_is_unfinished(self):
        command = self.command("work")
        command[command.index("300")] = "20"
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        self.assertEqual(done.returncode, gpu_trainings.UNFINISHED, done.stderr)
        self.assertIn("x/seed-0: not started, the time is over", done.stdout)


if __name__ == "__main__":
    unittest.main()
