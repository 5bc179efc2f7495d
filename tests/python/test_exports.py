"""relign-export: results of a plan in 16 shards, read by other projects' own packages."""

import contextlib
import io
import json
import math
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import unittest
import warnings
from unittest import mock

from support import package

from relign_bench.export import cli
from relign_bench.export.archive import write_archive
from relign_bench.export.runs import file_names
from relign_bench.results import Results, read_trials

SMALL = pathlib.Path(__file__).parents[1] / "golden" / "report" / "small"
DIM = {"use": "gaussian_spot", "name": "dim spot", "parameters": {"photons": 1e5}}
SUITE = {"name": "spots", "scenes": ["gaussian_spot", DIM], "noise_levels": ["rho0"],
         "algorithms": ["nlopt-sbplx", "random"], "instances": 15, "steps": 12}


def setUpModule():
    """Runs a plan in 16 shards and merges them; the tests read the folder `merged`."""
    global PLACE  # noqa: PLW0603
    program = os.environ.get("RELIGN_PROGRAM")
    if not program:
        raise unittest.SkipTest("RELIGN_PROGRAM does not name the program")
    place = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(place.cleanup)
    PLACE = pathlib.Path(place.name)
    (PLACE / "suite.json").write_text(json.dumps(SUITE))

    def relign(*arguments):
        subprocess.run([program, *arguments], check=True, cwd=PLACE, capture_output=True)

    relign("plan", "suite.json", "--shards", "16", "-o", "plan.json")
    for shard in range(16):
        relign("run", "--plan", "plan.json", "--shard", f"{shard}/16", "-o", "shards", "--workers", "1")
    relign("merge", "shards", "-o", "merged")


class Exports(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory(dir=PLACE)
        self.addCleanup(place.cleanup)
        self.place = pathlib.Path(place.name)

    def export(self, *arguments, results="merged", status=0):
        """Runs relign-export; its output, or its error where the status is not 0."""
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as errors:
            self.assertEqual(cli.main([str(PLACE / results), *map(str, arguments)]), status)
        return (errors if status else out).getvalue()


class Ioh(Exports):
    def test_iohinspector_reads_every_evaluation(self):
        self.assertIn("90 runs of 3 methods on 2 functions", self.export("--ioh", self.place / "ioh"))
        iohinspector = package("iohinspector")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            manager = iohinspector.DataManager()
            manager.add_folder(str(self.place / "ioh"))
            rows = manager.load(monotonic=False, include_meta_data=True).to_dicts()
        self.assertEqual({row["function_name"] for row in rows}, {"gaussian_spot@rho0", "dim spot@rho0"})
        self.assertEqual(manager.dimensions, (5,))
        self.assertEqual({row["relign_error"] for row in rows}, {"recommended"})
        read = {(row["function_name"], row["algorithm_name"], row["instance"], row["evaluations"]): row for row in rows}
        recorded = 0
        for closing, steps in read_trials(PLACE / "merged"):
            for step in steps:
                recorded += 1
                row = read[f"{closing['scene']}@rho0", closing["algorithm"], closing["instance"], step["step"] + 1]
                self.assertAlmostEqual(row["raw_y"], max(0, step["recommended_mse"]) ** 0.5, delta=1e-15)
                self.assertEqual(row["machine_seconds"], step["machine_seconds"])
                self.assertEqual([row[f"x{axis}"] for axis in range(5)], step["recommended_pose"])
        self.assertEqual((recorded, len(rows)), (len(read), len(read)))

    def test_error_of_choice_with_its_pose(self):
        self.export("--ioh", self.place / "ioh", "--error", "commanded", "--only", "algorithm=random", "--only", "instance=3")
        (data,) = self.place.glob("ioh/*/data_f1_*/*.dat")
        lines = data.read_text().splitlines()
        steps = next(steps for closing, steps in read_trials(PLACE / "merged")
                     if (closing["scene"], closing["algorithm"], closing["instance"]) == ("gaussian_spot", "random", 3))
        self.assertEqual(len(lines), 1 + len(steps))
        for line, step in zip(lines[1:], steps):
            number, value, seconds, *pose = map(float, line.split())
            self.assertEqual((number, seconds, pose), (step["step"] + 1, step["machine_seconds"], step["commanded_pose"]))
            self.assertEqual(value, math.sqrt(step["commanded_mse"]))
        self.assertIn("commanded", (self.place / "ioh" / "README.txt").read_text())


class Texts(Exports):
    def test_no_text_has_an_unfilled_placeholder(self):
        for error in ("recommended", "commanded", "measured"):
            folder = self.place / error
            printed = self.export("--ioh", folder / "ioh", "--coco", folder / "coco", "--error", error)
            self.assertIn("RMSE", printed)
            texts = {path.name: path.read_text() for path in folder.rglob("*") if path.is_file()}
            self.assertGreater(len(texts), 10)
            for name, text in {**texts, "printed": printed, "help": cli.make_parser().format_help()}.items():
                self.assertNotRegex(text, r"\{[a-z_]*\}", name)


class Coco(Exports):
    def test_cocopp_processes_the_archive(self):
        cocopp = package("cocopp")
        self.export("--coco", self.place / "coco")
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.place)
        # Recorded, because cocopp sets filters of its own.
        with warnings.catch_warnings(record=True) as warned, contextlib.redirect_stdout(io.StringIO()):
            cocopp.main(["-o", "pages", "coco/nlopt-sbplx/", "coco/random/"])
            sets = cocopp.load("coco/random/")
        messages = [str(one.message) for one in warned]
        network = ("failed to connect", "official archives")
        self.assertEqual([message for message in messages if not any(part in message for part in network)], [])
        self.assertTrue(list(self.place.glob("pages/*/pprldmany_05D_noiselessall.svg")))
        self.assertEqual([(one.funcId, one.dim, sorted(one.instancenumbers)) for one in sets],
                         [(1, 5, list(range(1, 16))), (2, 5, list(range(1, 16)))])
        target = 10**-0.8  # cocopp keeps five targets per decade
        expected = []
        for closing, steps in read_trials(PLACE / "merged"):
            if (closing["scene"], closing["algorithm"]) == ("gaussian_spot", "random"):
                reached = [step["step"] + 1 for step in steps if step["recommended_mse"] ** 0.5 <= target]
                expected.append(reached[0] if reached else math.nan)
        found = sets[0].detEvals([target])[0].tolist()
        self.assertGreater(sum(math.isfinite(evaluations) for evaluations in expected), 0)
        self.assertEqual(str(found), str([float(evaluations) for evaluations in expected]))

    def test_refuses_what_the_format_cannot_hold(self):
        shutil.copytree(SMALL, self.place / "small")
        problem = self.export("--coco", self.place / "coco", results=self.place / "small", status=2)
        self.assertIn("scene 'relign_od' has 1 axes", problem)
        self.assertFalse((self.place / "coco").exists())


class Figures(Exports):
    def setUp(self):
        super().setUp()
        self.axes = package("matplotlib.axes").Axes
        path = f"{pathlib.Path(os.environ['RELIGN_PROGRAM']).parent}{os.pathsep}{os.environ['PATH']}"
        patch = mock.patch.dict(os.environ, PATH=path)
        patch.start()
        self.addCleanup(patch.stop)

    def test_lines_are_medians_over_the_instances(self):
        with mock.patch.object(self.axes, "plot", autospec=True, side_effect=self.axes.plot) as plot:
            self.export("--figures", self.place / "figures", "--only", "scene=gaussian_spot", "--only", "algorithm=random")
        (call,) = plot.call_args_list
        _, captures, values, _ = call.args
        trials = [steps for closing, steps in read_trials(PLACE / "merged")
                  if (closing["scene"], closing["algorithm"]) == ("gaussian_spot", "random")]
        self.assertEqual(list(captures), list(range(1, len(trials[0]) + 1)))
        for step, value in enumerate(values):
            expected = statistics.median(math.sqrt(steps[step]["recommended_mse"]) for steps in trials)
            self.assertAlmostEqual(value, expected, delta=1e-8)

    def test_every_group_is_a_pdf_and_an_svg_with_its_methods(self):
        self.assertNotIn("{", self.export("--figures", self.place / "figures"))
        names = sorted(path.name for path in (self.place / "figures").iterdir())
        scenes = ("dim_spot", "gaussian_spot")
        self.assertEqual(names, [f"{scene}_rho0_paper.{kind}" for scene in scenes for kind in ("pdf", "svg")])
        self.assertTrue((self.place / "figures" / names[0]).read_bytes().startswith(b"%PDF"))
        for text in ("nlopt-sbplx", "random", "home", "captures"):
            self.assertIn(text, (self.place / "figures" / names[1]).read_text())
        self.export("--figures", self.place / "again")
        for name in names:
            self.assertEqual((self.place / "again" / name).read_bytes(), (self.place / "figures" / name).read_bytes(), name)

    def test_errors_state_what_is_missing(self):
        with mock.patch.dict(os.environ, PATH="/nowhere"):
            self.assertIn("is not on PATH", self.export("--figures", self.place / "figures", status=2))
        with mock.patch.dict(sys.modules, {"matplotlib": None}):
            self.assertIn("pip install matplotlib", self.export("--figures", self.place / "figures", status=2))
        problem = self.export("--figures", self.place / "figures", "--only", "scene=x", status=2)
        self.assertIn("no recommended error of a chosen", problem)


class Problems(Exports):
    def test_failed_trials_are_left_out_and_counted(self):
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as errors:
            self.assertEqual(cli.main([str(SMALL), "--ioh", str(self.place / "ioh")]), 0)
        failed = sum(closing["end"] not in ("budget_spent", "finished") for closing, _ in read_trials(SMALL))
        self.assertEqual(errors.getvalue().splitlines()[0], f"left out: {failed} failed trials")
        self.assertGreater(failed, 0)

    def test_errors_state_what_to_do(self):
        target = self.place / "out"
        self.assertIn("relign-bench merge", self.export("--ioh", target, results="shards", status=2))
        self.assertIn("did you mean 'random'? algorithms: nlopt-sbplx, random, home",
                      self.export("--ioh", target, "--only", "algorithm=randon", status=2))
        target.mkdir()
        (target / "mine").touch()
        self.assertIn("exists; remove it, or choose another folder", self.export("--ioh", target, status=2))
        self.assertEqual([path.name for path in self.place.iterdir()], ["out"])

    def test_damaged_and_foreign_records_are_refused(self):
        damaged = self.place / "damaged"
        shutil.copytree(SMALL, damaged)
        records = damaged / "trials" / "0000.jsonl"
        text = records.read_text()
        records.write_text(text.replace('"commanded_mse":0.0064', '"commanded_mse":0.0065', 1))
        self.assertIn("0000.jsonl:4: the lines of trial '00000000000000a0' do not have their checksum",
                      self.export("--ioh", self.place / "out", results=damaged, status=2))

    def test_a_station_has_measured_errors_only(self):
        station = self.place / "station"
        shutil.copytree(SMALL, station)
        lines = [json.loads(line) for line in (station / "trials" / "0000.jsonl").read_text().splitlines()]
        import hashlib

        text, block = "", ""
        for line in lines:
            line.pop("sha256", None)
            line.update({key: None for key in ("commanded_mse", "recommended_mse") if key in line})
            block += json.dumps(line) + "\n"
            if "end" in line:
                line["sha256"] = hashlib.sha256(block.encode()).hexdigest()
                text += block[:-2] + ',"sha256":"' + line["sha256"] + '"}\n'
                block = ""
        (station / "trials" / "0000.jsonl").write_text(text)
        self.assertIn("export --error measured", self.export("--ioh", self.place / "out", results=station, status=2))
        self.export("--ioh", self.place / "out", "--error", "measured", results=station)

    def test_odd_names_and_one_instance_are_read_by_the_other_packages(self):
        odd = ["it's {0} % \"q\", $x", "日本", "CON"]
        suite = {**SUITE, "name": "sp \"ots\" {x} ' %", "scenes": [{"use": "gaussian_spot", "name": "a, b {c} 'd'"}],
                 "algorithms": [{"use": "random", "name": name} for name in odd], "instances": 1, "steps": 2}
        (self.place / "suite.json").write_text(json.dumps(suite))
        subprocess.run([os.environ["RELIGN_PROGRAM"], "run", "suite.json", "-o", "my results"], check=True, cwd=self.place,
                       capture_output=True)
        link = self.place / "linked"
        link.symlink_to("i o h")
        (self.place / "i o h").mkdir()
        self.export("--ioh", link, "--coco", self.place / "c o", results=self.place / "my results")
        self.assertTrue(link.is_symlink())
        iohinspector, cocopp = package("iohinspector"), package("cocopp")
        manager = iohinspector.DataManager()
        manager.add_folder(str(self.place / "i o h"))
        rows = manager.load(monotonic=False, include_meta_data=True).to_dicts()
        self.assertEqual({row["algorithm_name"] for row in rows}, {*odd, "home"})
        self.assertEqual({(row["suite"], row["function_name"]) for row in rows}, {(suite["name"], "a, b {c} 'd'@rho0")})
        infos = sorted(self.place.glob("c o/*/*.info"))
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            found = [one for info in infos for one in cocopp.pproc.DataSetList(str(info))]
        self.assertEqual({one.algId for one in found}, {odd[0].replace("'", "’"), "日本", "CON", "home"})
        package("matplotlib")
        with mock.patch.dict(os.environ, PATH=str(pathlib.Path(os.environ["RELIGN_PROGRAM"]).parent)):
            self.export("--figures", self.place / "f g", results=self.place / "my results")
        self.assertIn("CON", (self.place / "f g" / "a_b_c_d_rho0_paper.svg").read_text())

    def test_damaged_folders_are_named(self):
        kept = self.place / "kept"
        shutil.copytree(PLACE / "merged", kept)
        records = next(iter(sorted((kept / "trials").glob("*.jsonl"))))
        whole, manifest = records.read_bytes(), (kept / "manifest.json").read_bytes()
        trial = json.loads(whole.partition(b"\n")[0])["trial"]
        for added, why in ((b"\xff", "is damaged: 'utf-8' codec can't decode"),
                           (b"[1]\n", "expected a step or the end of a trial, found '[1]'"),
                           (b'{"x":1}\n', "expected a step or the end of a trial"),
                           (whole, f"trial '{trial}' is recorded twice")):
            records.write_bytes(whole + added)
            problem = self.export("--ioh", self.place / "out", results=kept, status=2)
            self.assertIn(why, problem)
            self.assertIn(str(records), problem)
        records.write_bytes(whole)
        for text, why in (("", "is damaged: Expecting value"), ("[]", "it must be an object"), ("{}", "no list 'order'"),
                          (json.dumps({**json.loads(manifest), "scenes": []}), "manifest.json' does not have")):
            (kept / "manifest.json").write_text(text)
            self.assertIn(why, self.export("--coco", self.place / "out", results=kept, status=2))
        self.assertEqual([path.name for path in self.place.iterdir()], ["kept"])

    def test_interrupted_runs_state_what_is_missing(self):
        cut = self.place / "cut"
        shutil.copytree(PLACE / "merged", cut)
        records = sorted((cut / "trials").glob("*.jsonl"))
        records[-1].write_bytes(records[-1].read_bytes()[:-30])
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as errors:
            self.assertEqual(cli.main([str(cut), "--ioh", str(self.place / "ioh")]), 0)
        self.assertIn("89 runs of 3 methods", out.getvalue())
        self.assertIn("not complete: 1 trials of the suite have no complete record", errors.getvalue())
        for file in records:
            file.unlink()
        self.assertIn("has no complete trial; relign-bench run resumes",
                      self.export("--ioh", self.place / "out", results=cut, status=2))
        for library in ("pandas", "polars"):
            package(library)
            table = Results(cut).table("steps", library)
            self.assertEqual((len(table), list(table.columns)[:2]), (0, ["scene", "noise_level"]))

    def test_places_that_cannot_be_written_are_named_and_others_are_kept(self):
        (self.place / "file").touch()
        (self.place / "out.new").mkdir()
        (self.place / "out.new" / "mine").touch()
        for target in ("file/x", "x" * 300):
            problem = self.export("--ioh", self.place / target, status=2)
            self.assertRegex(problem, r"^error: cannot use '.*x': .*; choose another folder\n$")
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()) as errors:
            cli.main([str(PLACE / "merged"), "--ioh", str(self.place / "out"), "--coco", str(self.place / "." / "out")])
        self.assertIn("every format needs a folder of its own", errors.getvalue())
        with mock.patch("relign_bench.export.ioh._write_function", side_effect=OSError(28, "No space left on device", "full")):
            self.assertIn("cannot use 'full': no space left", self.export("--ioh", self.place / "out", status=2))
        self.export("--ioh", self.place / "out")
        self.assertEqual(sorted(path.name for path in self.place.iterdir()), ["file", "out", "out.new"])
        self.assertTrue((self.place / "out.new" / "mine").exists())

    def test_archives_hold_results_plugins_and_wheels(self):
        suite = self.place / "suite"
        suite.mkdir()
        method, wheel = suite / "method.py", suite / "relign_bench-0-py3-none-any.whl"
        for file in (method, wheel):
            file.write_text(file.name)
        count, left_out = write_archive(PLACE / "merged", self.place / "archive", [method], [wheel])
        self.assertEqual(left_out, [])
        lines = (self.place / "archive" / "SHA256SUMS").read_text().splitlines()
        self.assertEqual(len(lines), count)
        self.assertLessEqual({"plugins/method.py", "wheels/relign_bench-0-py3-none-any.whl", "results/manifest.json",
                              "verify"}, {line.split("  ")[1] for line in lines})
        self.assertIn('--plugin "$here"/plugins/method.py', (self.place / "archive" / "verify").read_text())
        for plugins, wheels, problem in (([method, method], [wheel], "the same name"), ([], [method], "needs the wheel")):
            with self.assertRaisesRegex(ValueError, problem):
                write_archive(PLACE / "merged", self.place / "other", plugins, wheels)
        with self.assertRaisesRegex(ValueError, "cannot be inside"):
            write_archive(PLACE / "merged", suite / "other", [], [wheel], suite)

    def test_an_archive_of_the_current_folder_can_be_verified(self):
        """The suite names a plugin that is given as --plugin, too; results and wheels lie beside it."""
        suite = {**SUITE, "scenes": ["gaussian_spot"], "algorithms": ["./my guess.py"], "instances": 1, "steps": 2}
        (self.place / "suite.json").write_text(json.dumps(suite))
        (self.place / "my guess.py").write_text(
            "from relign_bench.plugin import Optimizer, serve\n\n\nclass Guess(Optimizer):\n"
            "    'Guesses.'\n\n    def run(self, trial):\n        trial.step([0.5] * len(trial.axes))\n\n\n"
            "if __name__ == '__main__':\n    serve(Guess)\n")
        wheel = self.place / "relign_bench-0-py3-none-any.whl"
        wheel.touch()
        environment = {**os.environ, "RELIGN_PYTHON": sys.executable}
        program = os.environ["RELIGN_PROGRAM"]
        subprocess.run([program, "run", "suite.json", "-o", "results"], check=True, cwd=self.place, capture_output=True,
                       env=environment)
        with tempfile.TemporaryDirectory() as other:
            archive = pathlib.Path(other) / "archive"
            _, left_out = write_archive(self.place / "results", archive, [self.place / "my guess.py"], [wheel], self.place)
            self.assertEqual(sorted(left_out), [str(wheel), str(self.place / "results")])
            self.assertEqual(sorted(path.name for path in (archive / "suite").iterdir()), ["my guess.py", "suite.json"])
            self.assertEqual(list((archive / "plugins").iterdir()), [])
            # The script as it is, with programs in place of those that install the wheel.
            tools = pathlib.Path(other) / "tools"
            tools.mkdir()
            for name, text in {
                "python3": "mkdir -p \"$3/bin\"; cp \"$0\" \"$3/bin/python\"; cp \"${0%/*}/relign-bench\" \"$3/bin\"",
                "relign-bench": f"env > '{other}/seen'; export RELIGN_PYTHON='{sys.executable}' "
                                f"PYTHONPATH='{environment['PYTHONPATH']}'; exec '{program}' \"$@\"",
            }.items():
                (tools / name).write_text(f"#!/bin/sh\n[ \"$2\" = pip ] && exit 0\n{text}\n")
                (tools / name).chmod(0o755)
            done = subprocess.run([archive / "verify"], capture_output=True, text=True, check=False, env={
                **environment, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "PYTHONHOME": "/mine",
                "RELIGN_PLUGIN_PATH": "/mine"})
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            seen = pathlib.Path(other, "seen").read_text().splitlines()
            for name in ("PYTHONPATH", "PYTHONHOME", "RELIGN_PYTHON", "RELIGN_PLUGIN_PATH"):
                self.assertEqual([line for line in seen if line.startswith(name + "=")], [])

    def test_file_names_differ_and_stay_in_their_folder(self):
        names = file_names(["../up", "a b", "a_b", "A_B", "..", "métrique"])
        self.assertEqual(list(names.values()), ["up", "a_b", "a_b_2", "A_B_3", "_", "m_trique"])


if __name__ == "__main__":
    unittest.main()
