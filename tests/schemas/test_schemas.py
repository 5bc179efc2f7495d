"""The schemas of docs/schemas against what they describe: every file of the tree, everything that runs write, and wrong files.

Needs the distribution's python3-jsonschema.
"""

import ast
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/peers"), str(ROOT / "tests/schemas")]

try:
    import program
    import schema_tools as tools
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: these tests need python3-jsonschema and python3-numpy")

USERS = ("suite", "scene", "lens", "tolerances", "imaging_errors", "plugin", "submission", "assembly", "rays", "poses")

# Which files of the tree each schema is for.
TREE = {
    "suite": ["suites/*.json", "examples/*/suite.json"],
    "plugin": ["plugins/*/*/relign-plugin.json", "examples/*/relign-plugin.json", "templates/*/relign-plugin.json",
               "benchmarks/*/relign-plugin.json", "tests/*/*/relign-plugin.json", "tests/*/*/*/relign-plugin.json"],
    "scene": ["plugins/scenes/lens_system/*/scene.json", "suites/*/*/scene.json"],
    "lens": ["plugins/scenes/lens_system/*/lens.json", "suites/*/*/lens.json"],
    "tolerances": ["plugins/scenes/lens_system/*/tolerances.json", "plugins/noise_levels/tolerances/[!r]*.json"],
    "imaging_errors": ["plugins/scenes/lens_system/relign_od/target.json", "plugins/scenes/lens_system/relign_od/sensor.json",
                       "python/relign_bench/training/randomisation.json"],
    "network": ["plugins/agents/*/imitation.json", "plugins/agents/*/*ppo*.json"],
}

# Where anything may stand. A schema that took anything elsewhere would find no mistake there.
FREE = {
    "suite": {"/entry/parameters", "/algorithm/parameters"},
    "submission": {"/algorithm/parameters"},
    "plugin": {"/check", "/model_parameters", "/presets/parameters", "/parameter/default"},
    "rays": {"/*"},
    "description": {"/*", "/spec"},
    "manifest": {"/scenes/parameters", "/scenes/identity", "/scenes/data", "/scenes/spec", "/noise_levels/parameters",
                 "/noise_levels/identity", "/algorithms/parameters"},
    "plan": {"/scenes/identity", "/scenes/data", "/noise_levels/identity", "/algorithms/identity"},
    "prepared": {f"/key/{of}/{what}" for of in ("algorithm", "scene", "noise_level") for what in ("identity", "algorithms")}
                | {"/key/scene_data"},
    "printed": {"/image/elements", "/list/presets/parameters", "/page/presets/parameters", "/verify/differences/is",
                "/verify/differences/was", "/merge/disagreements/difference/kept", "/merge/disagreements/difference/other"},
    "report": {"/results/program", "/results/machine", "/results/merge", "/results/methods/parameters"},
}


class Schemas(unittest.TestCase):
    def test_each_is_a_schema_with_a_title_and_a_description(self):
        for name in tools.names():
            with self.subTest(name):
                schema = tools.load(name)
                tools.Draft7Validator.check_schema(schema)
                self.assertTrue(schema["title"].startswith("relign"))
                self.assertTrue(schema["description"])

    def test_anything_may_stand_only_where_it_is_meant_to(self):
        self.assertEqual({name: tools.free_places(tools.load(name)) for name in tools.names()},
                         {name: FREE.get(name, set()) for name in tools.names()})

    def test_equal_names_mean_equal_things(self):
        seen = {}
        for name in tools.names():
            for word in ("machine_time", "spec", "program", "machine", "offset", "imitation", "ppo"):
                if word in (definitions := tools.load(name).get("definitions", {})):
                    self.assertEqual(definitions[word], seen.setdefault(word, definitions[word]), f"{word} of {name}")

    def test_recipes_have_the_settings_of_trainings(self):
        schema, check = tools.load("recipe"), tools.validator("recipe")
        readme = (ROOT / "python/README.md").read_text().split("### Recipes", 1)[1]
        for name, file, side in (("imitation", "imitate.py", "imitation/randomised"), ("ppo", "recipe.py", "ppo_paper/ppo-paper")):
            module = ast.parse((ROOT / "python/relign_bench/training" / file).read_text())
            recipe = next(one for one in module.body if isinstance(one, ast.ClassDef) and one.name == "Recipe")
            fields = {one.target.id for one in recipe.body if isinstance(one, ast.AnnAssign)}
            self.assertEqual(set(schema["definitions"][name]["properties"]), fields, file)
            table = readme.split(f"\n`{name.replace('imitation', 'imitate')}`", 1)[1].split("\n\n`", 1)[0]
            told = {word for row in re.findall(r"^\| (`[^|]*) \|", table, re.M) for word in re.findall(r"`(\w+)`", row)}
            options = {"scene", "seed", "preset", "algorithm", "warm_start", "randomise"}  # of their own
            self.assertEqual(told | (options & fields), fields, f"python/README.md of {file}")
            document = json.loads((ROOT / f"plugins/agents/{side}.json").read_text())["trained"]["recipe"]
            self.assertEqual(tools.complaints(check, document), [])
            for what, wrong in tools.wrong_versions(schema, document):
                self.assertFalse(check.is_valid(wrong), f"{name}: {what}")

    def test_sweeps_of_the_tree_have_the_keys_that_relign_train_reads(self):
        schema, check = tools.load("sweep"), tools.validator("sweep")
        module = ast.parse((ROOT / "python/relign_bench/training/sweep.py").read_text())
        read = {one.targets[0].id: set(ast.literal_eval(one.value)) for one in module.body
                if isinstance(one, ast.Assign) and one.targets[0].id in ("KEYS", "TRAINING_KEYS")}
        self.assertEqual(set(schema["definitions"]["training"]["properties"]), read["TRAINING_KEYS"])
        self.assertEqual(set(schema["oneOf"][0]["properties"]), read["KEYS"])
        files = sorted((ROOT / "python/recipes").glob("*.json"))
        self.assertTrue(files)
        for file in files:
            document = json.loads(file.read_text())
            self.assertEqual(tools.complaints(check, document), [])
            for change in ({"trainings": []}, {"trainings": [{"name": "x"}]}, {"trainings": [{"name": "x", "seeds": [0], "sed": 1}]}):
                self.assertFalse(check.is_valid({**document, **change}), change)

    def test_the_readme_names_each(self):
        readme = (tools.FOLDER / "README.md").read_text()
        self.assertEqual(sorted(re.findall(r"\[(\w+)\]\(\1\.schema\.json\)", readme)), tools.names())

    def test_files_of_the_tree(self):
        for name, patterns in TREE.items():
            check = tools.validator(name)
            files = [file for pattern in patterns for file in sorted(ROOT.glob(pattern))]
            self.assertGreater(len(files), 1, name)
            for file in files:
                with self.subTest(str(file.relative_to(ROOT))):
                    self.assertEqual(tools.complaints(check, json.loads(file.read_text())), [])

    def test_mistakes_in_what_users_write(self):
        for name in (*USERS, "network"):
            schema, check = tools.load(name), tools.validator(name)
            documents = list(schema.get("examples", []))
            documents += [json.loads(next(ROOT.glob(pattern)).read_text()) for pattern in TREE.get(name, [])[:1]]
            self.assertTrue(documents, name)
            for document in documents:
                self.assertEqual(tools.complaints(check, document), [], name)
                for what, wrong in tools.wrong_versions(schema, document):
                    self.assertFalse(check.is_valid(wrong), f"{name}: {what}")

    def test_mistakes_that_readers_refuse(self):
        example = {name: tools.load(name)["examples"][0] for name in USERS}
        for name, wrong in (
                ("suite", {**example["suite"], "scenes": []}), ("suite", {**example["suite"], "instances": 0}),
                ("suite", {**example["suite"], "name": "a/b"}), ("suite", {**example["suite"], "targets": [0]}),
                ("suite", {**example["suite"], "algorithms": [{"use": "nlopt", "parameters": {"first_stride": 1}}]}),
                ("suite", {**example["suite"], "scenes": [{"use": "relign_od", "steps": 3}]}),
                ("plugin", {**example["plugin"], "command": ["./run"]}), ("plugin", {**example["plugin"], "kind": "scene"}),
                ("plugin", {**example["plugin"], "id": "-x"}),
                ("plugin", {**example["plugin"], "parameters": {"a": {"type": "text", "maximum": 3}}}),
                ("plugin", {**example["plugin"], "parameters": {"a": {"type": "number", "default": "3"}}}),
                ("scene", {**example["scene"], "sensor": {"z_mm": 1, "side_mm": 3, "pitch_um": 3}}),
                ("scene", {**example["scene"], "sensor": {"z_mm": 1, "pixels": [40, 30]}}),
                ("tolerances", {**example["tolerances"], "movement": {"backlash_um": -3}}),
                ("tolerances", {**example["tolerances"], "elements": {"*": {"shift_um": [1, 2]}}}),
                ("imaging_errors", {"gain": [1]}), ("imaging_errors", {"stray_light": {"blobs": 2}}),
                ("imaging_errors", {"bits": 7.5, "full_scale": 3}),
                ("lens", {**example["lens"], "glasses": {"own": {"nd": 1.5}}}),
                ("poses", {"poses": ["start"]})):
            self.assertFalse(tools.validator(name).is_valid(wrong), f"{name}: {wrong}")


@unittest.skipIf(program.path() is None, "relign-bench was not built")
class Readers(unittest.TestCase):
    """Readers list the keys that they accept; the schemas must accept the same."""

    def said_of(self, name, document):
        """What the program says of a user's file with this content."""
        with tempfile.TemporaryDirectory() as place:
            place = pathlib.Path(place)
            example = {one: tools.load(one)["examples"][0] for one in ("scene", "lens")}
            own = {"plugin": "relign-plugin.json", "suite": "own.json"}.get(name, f"{name}.json")
            suite = {"scenes": [own if name == "scene" else "relign_od"], "algorithms": ["random"],
                     "noise_levels": [own if name == "tolerances" else "none"]}
            for file, content in {"scene.json": example["scene"], "lens.json": example["lens"], "suite.json": suite, own: document}.items():
                (place / file).write_text(json.dumps(content))
            command = {"suite": ["validate", place / own], "tolerances": ["validate", place / "suite.json"],
                       "scene": ["validate", place / "suite.json"], "lens": ["lens", "info", "--scene", place / "scene.json"],
                       "plugin": ["list", "--plugin", place / own], "submission": ["submit", "pack", place, "-o", place / "x.tar"], "rays": ["lens", "trace", place / own],
                       "imaging_errors": ["render", "--randomise", place / own, "-o", place / "x.png"],
                       "assembly": ["render", "--assembly", place / own, "-o", place / "x.npy"],
                       "poses": ["render", "--animate", place / own, "-o", place / "x.gif"]}[name]
            done = subprocess.run([str(program.path()), *map(str, command)], capture_output=True, text=True, cwd=place)
            return done.returncode, done.stderr

    def test_schemas_know_the_keys_that_readers_know(self):
        for name in USERS:
            schema = tools.load(name)
            with self.subTest(name):
                document, expected = tools.with_unknown_keys(schema, schema["examples"][0])
                if name == "rays":
                    del document[tools.UNKNOWN], expected[f"/{tools.UNKNOWN}"]  # passed over there
                said = self.said_of(name, document)[1]
                found = re.findall(rf": (/\S*{tools.UNKNOWN}): unknown key '{tools.UNKNOWN}'; allowed: (.*)", said)
                found = {place: set(known.split(", ")) for place, known in found}
                self.assertEqual(found.keys(), expected.keys(), said)
                # Of alternatives a reader observes those that it meets: together the objects of one kind have all.
                for kind in map(frozenset, expected.values()):
                    self.assertEqual(set().union(*(found[place] for place in found if expected[place] == kind)), kind, said)

    def test_examples_are_read(self):
        for name in ("suite", "scene", "lens", "tolerances", "imaging_errors", "assembly", "rays"):
            code, said = self.said_of(name, {"$schema": f"{name}.schema.json", **tools.load(name)["examples"][0]})
            self.assertEqual(code, 0, f"{name}: {said}")


LOSER = '''"""Never works."""
from relign_bench.plugin import Optimizer, serve


class Loser(Optimizer):
    """Never works."""

    def run(self, trial):
        raise RuntimeError("never works")


serve(Loser)
'''
TOLERANCES = {"use": "tolerances", "elements": {"*": {"shift_um": [20, 20, 20], "tilt_arcmin": [6, 6]}},
              "start": {"shift_um": [300, 300, 300], "tilt_arcmin": [60, 60]},
              "cure_shift": {"shift_um": [20, 20, 20], "tilt_arcmin": [3, 3]}}
SUITE = {"scenes": [{"use": "relign_od", "name": "small", "parameters": {"pixels": 20}}], "noise_levels": ["rho0", "glued.json"],
         "algorithms": ["./loser.py", {"use": "transfer-gp", "name": "learns", "parameters": {"sources": 2, "source_steps": 5}}],
         "instances": 4, "steps": 3, "spec": {"rmse": 0.02, "mtf": {"lp_per_mm": 5, "centre": 0.5, "corner": 0.5}}}

PLAIN = {"scenes": [{"use": "relign_od", "name": "small", "parameters": {"pixels": 20}}], "noise_levels": ["rho0"],
         "algorithms": ["random"], "instances": 2, "steps": 3}


def make_evaluation(folder, results, mine):
    """An evaluation folder of `results`, of which the method `mine` was submitted."""
    folder.mkdir()
    shutil.copytree(results, folder / "results")
    manifest = json.loads((results / "manifest.json").read_text())
    training = {"hours": 1.5, "steps": None}
    methods = [{**{key: entry[key] for key in ("name", "observes", "protocol")},
                "training": training if entry["name"] == mine else entry.get("training"),
                "submitted": entry["name"] == mine} for entry in manifest["algorithms"]]
    own = next(one for one in methods if one["submitted"])
    suite = {"name": manifest["suite_name"], "sha256": hashlib.sha256(manifest["suite"].encode()).hexdigest(),
             "instance_set": manifest["instance_set"]}
    (folder / "submission.json").write_text(json.dumps({"name": mine, "version": "1.0", "authors": ["A. Tester"],
                                                         "training": training}))
    (folder / "evaluation.json").write_text(json.dumps({
        "format": "relign-bench/evaluation/1", "name": mine, "version": "1.0", "archive_sha256": "0" * 64, "suite": suite,
        "sealed": False, "sandbox": False, "date": "2026-11-24", "program_version": manifest["program"]["version"],
        "class": sorted(own["observes"]), "budget": {"steps": 3}, "methods": methods, "results": "results"}))


@unittest.skipIf(program.path() is None, "relign-bench was not built")
class WrittenFiles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        place = cls.folder = pathlib.Path(cls.place.name)
        os.environ["XDG_CACHE_HOME"] = str(place / "cache")
        cls.run_program("plan", "suite.json", "-o", "plan.json", "--shards", "2", needs={
            "suite.json": json.dumps(SUITE), "loser.py": LOSER, "glued.json": json.dumps(TOLERANCES)})
        for shard in ("0/2", "1/2"):
            cls.run_program("run", "--plan", "plan.json", "--shard", shard)
        cls.run_program("merge", "results/suite", "-o", "merged")
        cls.run_program("report", "merged")
        cls.run_program("report", "merged", "--format", "json", "-o", "report.json")
        cls.run_program("verify", "merged", "--sample", "3")
        (place / "compare.json").write_text(cls.run_program("compare", "merged:random", "merged:home", "--json",
                                                            "--gate", "recommended<=1x"))
        (place / "rays.json").write_text(json.dumps({"rays": [{"start_mm": [0, y, -1], "direction": [0, 0, 1]} for y in (0, 50)]}))
        (place / "rays_out.json").write_text(cls.run_program("lens", "trace", "rays.json", "--apertures", "mesh"))
        cls.run_program("run", "mine.json", needs={"mine.json": json.dumps(
            {**PLAIN, "algorithms": ["random", {"use": "nlopt-sbplx", "name": "mine"}]})})
        make_evaluation(place / "evaluation", place / "results/mine", "mine")
        cls.run_program("leaderboard", "build", "evaluation", "nowhere", "-o", "site")
        cls.run_program("scene", "new", ROOT / "tests/golden/lenses/cooke_triplet_utf8.zmx", "-o", "new")

    @classmethod
    def run_program(cls, *arguments, needs=None):
        for name, text in (needs or {}).items():
            (cls.folder / name).write_text(text)
        paths = f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
        done = subprocess.run([str(program.path()), *map(str, arguments)], capture_output=True, text=True, cwd=cls.folder,
                              env={**os.environ, "PATH": paths})
        if done.returncode not in (0, 3, 4):  # 3: trials failed, as they were meant to; 4: a gate
            raise RuntimeError(f"relign-bench {arguments}: {done.stderr}")
        return done.stdout

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    WRITTEN = {"manifest": ["merged/manifest.json", "results/*/*/manifest.json"], "curves": ["merged/curves.json"],
               "trials": ["merged/trials/*.jsonl"], "times": ["merged/times/*.jsonl"], "pictures": ["merged/pictures/index.json"],
               "verify": ["merged/verify.json"], "description": ["merged/scenes/*/description.json"],
               "next_image": ["merged/scenes/*/next_image/*.json"], "landscape": ["merged/scenes/*/landscape.json"],
               "plan": ["plan.json"],
               "prepared": ["cache/*/prepared/*/*.json"], "report": ["report.json"], "compare": ["compare.json"],
               "rays": ["rays.json", "rays_out.json"], "suite": ["new/suite.json", "suite.json"], "scene": ["new/scene.json"],
               "lens": ["new/lens.json"], "tolerances": ["new/tolerances.json", "glued.json"], "evaluation": ["evaluation/evaluation.json"],
               "leaderboard": ["site/feed.json"]}

    def documents(self, name):
        for pattern in self.WRITTEN[name]:
            files = sorted(self.folder.glob(pattern))
            self.assertTrue(files, f"{name}: there is no {pattern}")
            for file in files:
                for line in file.read_text().splitlines() if file.suffix == ".jsonl" else [file.read_text()]:
                    yield file.name, json.loads(line)

    def test_nothing_else_is_written(self):
        known = {file for patterns in self.WRITTEN.values() for pattern in patterns for file in self.folder.glob(pattern)}
        for file in (*self.folder.glob("merged/**/*.json*"), *self.folder.glob("new/**/*.json*"), *self.folder.glob("site/**/*.json*")):
            self.assertIn(file, known)

    def test_what_is_written_is_valid(self):
        for name in self.WRITTEN:
            check = tools.validator(name)
            for file, document in self.documents(name):
                self.assertEqual(tools.complaints(check, document), [], f"{name}: {file}")

    def test_what_a_station_leaves_is_valid(self):
        station = program.path().parents[1] / "tests/harness/runner/plugins/toy_station"
        if not station.exists():
            self.skipTest("the tests' station was not built")
        self.run_program("run", "station.json", "-o", "station", needs={"station.json": json.dumps(
            {"scenes": [str(station)], "noise_levels": ["none"], "algorithms": ["random"], "instances": 2, "steps": 2})})
        self.run_program("report", "station", "--format", "json", "-o", "station_report.json")
        for name, pattern in (("manifest", "station/manifest.json"), ("trials", "station/trials/*"), ("curves", "station/curves.json"),
                              ("pictures", "station/pictures/index.json"), ("description", "station/scenes/*/description.json"),
                              ("report", "station_report.json")):
            self.WRITTEN = {name: [pattern]}
            for file, document in self.documents(name):
                self.assertEqual(tools.complaints(tools.validator(name), document), [], f"{name}: {file}")

    def test_what_an_evaluation_leaves_is_valid(self):
        (self.folder / "sub").mkdir()
        (self.folder / "sub/submission.json").write_text(json.dumps(SUBMISSION))
        (self.folder / "board.json").write_text(json.dumps(PLAIN))
        self.run_program("submit", "pack", "sub", "-o", "sub.tar.zst")
        try:
            self.run_program("submit", "evaluate", "sub.tar.zst", "--suite", "board.json", "-o", "ev")
        except RuntimeError as problem:
            if "not possible on this machine" in str(problem):
                self.skipTest(str(problem))
            raise
        schema, check = tools.load("evaluation"), tools.validator("evaluation")
        document = json.loads((self.folder / "ev/evaluation.json").read_text())
        self.assertEqual(tools.complaints(check, document), [])
        for what, wrong in tools.wrong_versions(schema, document):
            self.assertFalse(check.is_valid(wrong), what)
        for name, file in (("submission", "ev/submission.json"), ("suite", "ev/suite.json"), ("manifest", "ev/results/manifest.json")):
            self.assertEqual(tools.complaints(tools.validator(name), json.loads((self.folder / file).read_text())), [], file)

    def test_mistakes_are_found_everywhere(self):
        for name in set(self.WRITTEN) - set(USERS):
            schema, check = tools.load(name), tools.validator(name)
            documents = [document for _, document in self.documents(name)]
            for document in documents[:1] if name != "trials" else [documents[0], next(one for one in documents if "end" in one)]:
                for what, wrong in tools.wrong_versions(schema, document, most=150):
                    self.assertFalse(check.is_valid(wrong), f"{name}: {what}")


SUBMISSION = {"name": "ours", "version": "1.0", "summary": "Compass search.", "authors": ["A. Nonymous"], "licence": "Apache-2.0",
              "algorithm": {"use": "nlopt-sbplx"}, "training": {"hours": 1}}
PLAIN = {"scenes": [{"use": "relign_od", "name": "small", "parameters": {"pixels": 20}}], "noise_levels": ["rho0"],
         "algorithms": ["random"], "instances": 2, "steps": 3}


@unittest.skipIf(program.path() is None, "relign-bench was not built")
class PrintedResults(unittest.TestCase):
    """What the verbs print with --json."""

    # In this order: later ones need what earlier ones have made. A name may stand for several calls.
    CALLS = (
        ("run", "run suite.json"), ("plan", "plan suite.json -o plan.json --shards 2"), ("run", "run --plan plan.json --shard 0/2"),
        ("slurm_status", "slurm status --plan plan.json"), ("slurm_script", "slurm script --plan plan.json"),
        ("merge", "merge results/suite -o merged"), ("merge", "merge merged -o again"), ("verify", "verify merged"),
        ("verify", "verify merged --trial {trial} --frames frames"), ("report", "report merged"), ("report", "report merged --format md"),
        ("leaderboard_build", "leaderboard build evaluation -o site"),
        ("report", "report merged --format csv"), ("report", "report merged --format csv -o ranking.csv"),
        ("try", "try random --scene gaussian_spot --noise-level none --steps 2"), ("validate", "validate suite.json"), ("list", "list"),
        ("describe", "describe relign_od --noise-level rho0.25 --instances 2"), ("describe", "describe transfer-gp"),
        ("describe", "describe tolerances"), ("doctor", "doctor"), ("explain", "explain"),
        ("explain", "explain timeout"), ("render", "render --scene gaussian_spot -o one.png"),
        ("render", "render --noise-level rho0.25 --animate start->nominal --frames 2 -o film.gif"),
        ("render", f"render --randomise {ROOT}/python/relign_bench/training/randomisation.json -o sheet.png"),
        ("scene_landscape", "scene landscape --scene gaussian_spot --points 5 -o spot.csv"),
        ("scene_new", f"scene new {ROOT}/tests/golden/lenses/cooke_triplet_utf8.zmx -o new"), ("lens_info", "lens info"),
        ("lens_info", "lens info --scene new/scene.json"), ("lens_draw", "lens draw -o lens.svg"),
        ("lens_export_mesh", "lens export-mesh -o meshes"), ("lens_fit_mesh", "lens fit-mesh {meshes} -o fitted.json"),
        ("submit_pack", "submit pack sub -o sub.tar.gz"), ("submit_evaluate", "submit evaluate sub.tar.gz --suite suite.json -o ev"),
        ("plugin_new", "plugin new mine --kind optimizer --lang python"),
        ("plugin_new", f"plugin new net --kind agent --scene relign_od --onnx {ROOT}/plugins/agents/imitation/imitation.onnx"), ("plugin_check", "plugin check nothing random"),
        ("plugin_prepare", "plugin prepare transfer-gp --scene gaussian_spot --parameters "
                           '{"sources":2,"source_steps":3}'))

    def test_each_is_valid_and_its_mistakes_are_found(self):
        schema = tools.load("printed")
        verbs = [one["$ref"].rsplit("/", 1)[1] for one in schema["anyOf"]]
        self.assertEqual(sorted({name for name, _ in self.CALLS}), sorted(verbs))
        with tempfile.TemporaryDirectory() as place:
            folder = pathlib.Path(place)
            (folder / "suite.json").write_text(json.dumps(PLAIN))
            (folder / "sub").mkdir()
            (folder / "sub/submission.json").write_text(json.dumps(SUBMISSION))
            for name, call in self.CALLS:
                with self.subTest(call):
                    if name == "leaderboard_build":
                        make_evaluation(folder / "evaluation", folder / "results/suite", "random")
                    document = self.printed(folder, call)
                    one = {**schema["definitions"][name], "definitions": schema["definitions"]}
                    check = tools.Draft7Validator(one)
                    self.assertEqual(tools.complaints(check, document), [])
                    for what, wrong in tools.wrong_versions(one, document, most=60):
                        self.assertFalse(check.is_valid(wrong), what)

    def printed(self, folder, call):
        words = []
        for word in call.split():
            if word == "{trial}":
                words.append(json.loads(next(folder.glob("merged/trials/*")).read_text().splitlines()[0])["trial"])
            elif word == "{meshes}":
                words += sorted(map(str, folder.glob("meshes/*.ply")))
            else:
                words.append(word)
        done = subprocess.run([str(program.path()), *words, "--json", "--progress", "none"], capture_output=True, text=True, cwd=folder,
                              env={**os.environ, "XDG_CACHE_HOME": str(folder / "cache")})
        if "was built without" in done.stderr or "not possible on this machine" in done.stderr:
            self.skipTest(done.stderr)
        self.assertTrue(done.stdout, f"{call}: {done.stderr}")
        return json.loads(done.stdout)


if __name__ == "__main__":
    unittest.main()
