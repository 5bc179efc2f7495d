"""Optimizers of other packages as methods, with the real packages; a method whose package is absent is skipped and named."""

import importlib.util
import itertools
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zipfile

from support import relign_bench

METHODS = pathlib.Path(__file__).resolve().parents[2] / "examples" / "methods"
PACKAGES = {"optuna": ["optuna", "cmaes"], "nevergrad": ["nevergrad"], "cma": ["cma"], "scipy": ["scipy"],
            "pybobyqa": ["pybobyqa"], "cobyqa": ["cobyqa"], "xopt": ["xopt"], "ax": ["ax"],
            "libensemble": ["libensemble", "mpmath", "scipy"], "botorch": ["botorch"]}
PARAMETERS = {"botorch": {"initial": 3}}  # so that few steps use the model

SLOW = ("xopt", "ax", "botorch")  # seconds a step
NUMBERS = itertools.count()
INSTANCE_INSIDE = 4  # its start pose is in the box to search; that of instance 0 is not

PREAMBLE = """
import sys
from relign_bench.plugin import FunctionSearch, GeneratorSearch, serve
from relign_bench.plugin.generators import Generator
"""


class Trials(unittest.TestCase):
    def setUp(self):
        # gaussian_spot of five axes: a trial takes milliseconds.
        self.bench = relign_bench.Bench("gaussian_spot", "rho0", threads=1)

    @staticmethod
    def start_inside(trial):
        """Whether the start pose is in the box to search."""
        return all(0.2 <= value <= 0.8 for value in trial.steps[0]["commanded_pose"])

    def run_class(self, text, steps=6, instance=0):
        """The trial of a plugin whose file has this class, named Search."""
        identity = f'    id = "{self.id().rsplit(".", 1)[-1]}_{next(NUMBERS)}"\n'  # ids are unique in a process
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "search.py"
            text = text.replace("Search):\n", "Search):\n" + identity, 1)
            path.write_text('"""A search."""' + PREAMBLE + text + "\nserve(Search)\n")
            return self.bench.run(str(path), steps=steps, instance=instance)


class GeneratorSearches(Trials):
    def test_start_is_told_first_and_one_point_at_a_time(self):
        inside = {self.start_inside(self.told_first(instance)) for instance in (0, INSTANCE_INSIDE)}
        self.assertEqual(inside, {False, True})

    def told_first(self, instance):
        trial = self.run_class("""
class Recorder:
    def __init__(self, space):
        self.space, self.told = space, []
    def suggest(self, number):
        assert number == 1, number
        assert len(self.told) >= 1, "the start pose was not told"
        if len(self.told) == 1:
            merit = self.told[0].pop("merit")
            assert merit == self.space.start_merit or self.space.start_merit is None
            assert self.told[0] == self.space.point(self.space.start)
        else:
            assert self.told[-1]["_id"] == len(self.told) - 1, self.told[-1]
        if len(self.told) == 4:
            return []
        return [{**self.space.point(self.space.start), "x": 9.0, "_id": len(self.told)}]
    def ingest(self, results):
        self.told += results
class Search(GeneratorSearch):
    def generator(self, space):
        return Recorder(space)
""", instance=instance)
        self.assertEqual((trial.end, trial.message), ("finished", ""))
        started = 0 if self.start_inside(trial) else 1  # a step in the box where the start pose is outside
        self.assertEqual(len(trial.steps), 4 + started)
        for step in trial.steps[1 + started:]:  # clamped to the box
            self.assertEqual(step["commanded_pose"][0], 0.8)
            self.assertEqual(step["commanded_pose"][1:], trial.steps[started]["commanded_pose"][1:])
        return trial

    def test_recommended_point_counts(self):
        trial = self.run_class("""
class Fixed:
    def __init__(self, space):
        self.space = space
    def suggest(self, number):
        return [self.space.point(self.space.start)]
    def ingest(self, results):
        pass
    def recommended(self):
        return self.space.point([0.5] * 5)
class Search(GeneratorSearch):
    def generator(self, space):
        return Fixed(space)
""")
        self.assertEqual(trial.end, "budget_spent")
        self.assertEqual(trial.steps[-1]["recommended_pose"], [0.5] * 5)

    def test_generator_is_finalized(self):
        trial = self.run_class("""
class Last:
    def suggest(self, number):
        return []
    def ingest(self, results):
        pass
    def finalize(self):
        raise RuntimeError("finalized")
class Search(GeneratorSearch):
    def generator(self, space):
        return Last()
""")
        self.assertEqual(trial.end, "failed")
        self.assertIn("finalized", trial.message)

    def test_unusable_points_fail_the_trial_with_their_reason(self):
        for point, message in (("{'x': 0.5}", "lacks y"), ("{**space.point(space.start), 'x': float('nan')}", "not finite")):
            trial = self.run_class(f"""
class Search(GeneratorSearch):
    def generator(self, space):
        class Wrong:
            def suggest(self, number):
                return [{point}]
            def ingest(self, results):
                pass
        return Wrong()
""")
            self.assertEqual(trial.end, "failed")
            self.assertIn(message, trial.message)

    def test_adapter_refuses_results_of_points_that_it_did_not_suggest(self):
        trial = self.run_class("""
class Own(Generator):
    def ask(self):
        return None, self.space.start
    def tell(self, asked, pose, merit):
        pass
class Search(GeneratorSearch):
    def generator(self, space):
        generator = Own(space)
        generator.ingest([{**space.point(space.start), "merit": 1.0, "_id": 7}])
""")
        self.assertEqual(trial.end, "failed")
        self.assertIn("no suggestion with the _id 7", trial.message)


@unittest.skipIf(importlib.util.find_spec("optuna") is None, "optuna is not installed (tests/python/requirements-others.txt)")
class Studies(Trials):
    def run_study(self, arguments, steps=9):
        return self.run_class(f"""
import optuna
from relign_bench.plugin.generators import OptunaGenerator
class Search(GeneratorSearch):
    def generator(self, space):
        return OptunaGenerator(optuna.create_study({arguments}), space)
""", steps=steps, instance=INSTANCE_INSIDE)

    def test_other_directions_are_refused(self):
        for arguments, found in (('direction="maximize"', "maximize"),
                                 ('directions=["minimize", "minimize"]', "minimize, minimize")):
            trial = self.run_study(arguments)
            self.assertEqual(trial.end, "failed")
            self.assertIn(f"the study must minimize one value, the merit, but its directions are {found}", trial.message)

    def test_a_sampler_that_stops_the_study_finishes_the_trial(self):
        grid = "{name: [0.3, 0.6] if name == 'x' else [0.5] for name in space.names}"
        trial = self.run_study(f"sampler=optuna.samplers.GridSampler({grid}, seed=space.seed)")
        self.assertEqual((trial.end, trial.message), ("finished", ""))
        self.assertEqual(sorted(step["commanded_pose"][0] for step in trial.steps[1:]), [0.3, 0.6])


class FunctionSearches(Trials):
    def test_first_call_at_the_start_is_free_and_the_budget_ends_it(self):
        for instance, free in ((0, 0), (INSTANCE_INSIDE, 1)):
            trial = self.run_class("""
class Search(FunctionSearch):
    def search(self, merit, space):
        value = merit(space.start)
        assert space.start_merit in (None, value), value
        for _ in range(20):
            try:
                merit([0.5] * 5)
            except Exception:
                pass
        raise AssertionError("the budget was not spent")
""", instance=instance)
            self.assertEqual((trial.end, trial.message), ("budget_spent", ""))
            self.assertEqual(len(trial.steps), 7)
            at_start = [step["commanded_pose"] != [0.5] * 5 for step in trial.steps[1:]]
            self.assertEqual(sum(at_start), 1 - free)

    def test_returned_pose_is_recommended(self):
        trial = self.run_class("""
class Search(FunctionSearch):
    def search(self, merit, space):
        return [0.25] * 5
""")
        self.assertEqual(trial.end, "finished")
        self.assertEqual(trial.steps[-1]["recommended_pose"], [0.25] * 5)


class Packages(Trials):
    """Every method of examples/methods: two trials, which are equal."""

    def test_methods(self):
        tried, absent = 0, []
        for name, packages in PACKAGES.items():
            missing = [package for package in packages if importlib.util.find_spec(package) is None]
            if missing:
                absent.append(name)
                continue
            path = METHODS / f"{name}_search.py"
            for preset, parameters in self.presets(path).items():
                with self.subTest(method=preset):
                    steps = 6 if name in SLOW else 12
                    chosen = {**PARAMETERS.get(name, {}), **parameters}
                    trials = [self.bench.run(str(path), steps=steps, parameters=chosen) for _ in range(2)]
                    self.assertIn(trials[0].end, ("budget_spent", "finished"), trials[0].message)
                    self.assertGreater(len(trials[0].steps), 5)
                    self.assertEqual(trials[0].steps, trials[1].steps)
                    tried += 1
        if absent:
            self.skipTest(f"{tried} methods passed; packages of {', '.join(absent)} are not installed "
                          "(tests/python/requirements-others.txt)")
        self.assertGreaterEqual(tried, 25)

    def presets(self, path):
        """Parameters of the method and its presets, by id."""
        text = subprocess.run([sys.executable, str(path), "--manifest"], check=True, capture_output=True).stdout
        manifest = json.loads(text)
        return {manifest["id"]: {}, **{name: one["parameters"] for name, one in manifest.get("presets", {}).items()}}


# A registry of OptunaHub in its layout: a sampler that goes half the way from the best pose to a corner.
REGISTRY = {"__init__.py": "from .sampler import CornerSampler\n", "sampler.py": """
import optunahub

class CornerSampler(optunahub.samplers.SimpleBaseSampler):
    def __init__(self, *, seed=None, upper=False):
        super().__init__(seed=seed)
        self.upper, self.seed = upper, seed

    def sample_relative(self, study, trial, search_space):
        assert isinstance(self.seed, int)
        best, share = study.best_params, 0.5
        ends = {name: one.high if self.upper else one.low for name, one in search_space.items()}
        return {name: share * best[name] + (1 - share) * ends[name] for name in ends}
"""}


@unittest.skipIf(importlib.util.find_spec("optunahub") is None,
                 "optunahub is not installed (tests/python/requirements-others.txt)")
class Hub(Trials):
    def run_sampler(self, files, steps=2, **parameters):
        """A trial of the sampler in an archive of these files."""
        with tempfile.TemporaryDirectory() as folder:
            archive = pathlib.Path(folder) / "registry.zip"
            with zipfile.ZipFile(archive, "w") as content:
                for name, text in files.items():
                    content.writestr(f"package/samplers/corner/{name}", text)
            parameters = {"package": "samplers/corner", "sampler": "CornerSampler", "registry": str(archive), **parameters}
            return self.bench.run(str(METHODS / "optunahub_search.py"), steps=steps, parameters=parameters,
                                  instance=INSTANCE_INSIDE)

    @staticmethod
    def with_share(share):
        """The registry with a sampler that goes another share of the way."""
        text = REGISTRY["sampler.py"]
        assert "study.best_params, 0.5" in text
        return {**REGISTRY, "sampler.py": text.replace("study.best_params, 0.5", f"study.best_params, {share}")}

    def test_sampler_of_an_archive(self):
        for upper in (False, True):
            trial = self.run_sampler(REGISTRY, options={"upper": upper})
            self.assertEqual((trial.end, trial.message), ("budget_spent", ""))
            corner, poses = 0.8 if upper else 0.2, [step["commanded_pose"] for step in trial.steps]
            for value, at in zip(poses[1], poses[0]):  # the start pose was told first
                self.assertAlmostEqual(value, (at + corner) / 2)

    def test_each_trial_has_the_sampler_of_its_own_archive(self):
        one, two = self.run_sampler(REGISTRY), self.run_sampler(self.with_share("0.25"))
        self.assertEqual(one.steps, self.run_sampler(REGISTRY).steps)
        for half, quarter in zip(one.steps[1]["commanded_pose"], two.steps[1]["commanded_pose"]):
            self.assertAlmostEqual(quarter - 0.2, (half - 0.2) / 2)

    def test_draws_from_the_global_generator_are_seeded(self):
        drawn = self.with_share("__import__('numpy').random.rand()")
        one, same, other = self.run_sampler(drawn), self.run_sampler(drawn), self.run_sampler(REGISTRY)
        self.assertEqual(one.steps, same.steps)
        self.assertNotEqual(one.steps, other.steps)

    def test_what_is_not_a_sampler_is_refused(self):
        for made in ("None", "seed"):
            trial = self.run_sampler({"__init__.py": f"def CornerSampler(seed): return {made}"})
            self.assertEqual(trial.end, "failed")
            self.assertRegex(trial.message, r"CornerSampler of package/samplers/corner makes \w+, not a sampler of Optuna")

    def test_what_an_archive_lacks_is_named(self):
        for parameters, message in (({"package": "samplers/turbo"}, "no package/samplers/turbo/__init__.py"),
                                    ({"sampler": "TuRBOSampler"}, "TuRBOSampler")):
            trial = self.run_sampler(REGISTRY, **parameters)
            self.assertEqual(trial.end, "failed")
            self.assertIn(message, trial.message)
        with self.assertRaisesRegex(ValueError, "registry"):
            self.bench.run(str(METHODS / "optunahub_search.py"))


@unittest.skipIf(importlib.util.find_spec("gest_api") is None, "gest-api is not installed")
class Vocabulary(Trials):
    def test_vocs(self):
        trial = self.run_class("""
class Search(FunctionSearch):
    def search(self, merit, space):
        vocs = space.vocs()
        assert vocs.variable_names == space.names, vocs.variable_names
        assert vocs.bounds == [list(pair) for pair in space.bounds] or vocs.bounds == space.bounds, vocs.bounds
        assert list(vocs.objectives) == ["merit"], vocs.objectives
""")
        self.assertEqual((trial.end, trial.message), ("finished", ""))


if __name__ == "__main__":
    unittest.main()
