"""Methods of the benchmark in a loop of the caller's own."""

import copy
import functools
import gc
import importlib.util
import multiprocessing
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import textwrap
import threading
import unittest
import warnings

from support import Folder, np, package, relign_bench

Method = relign_bench.Method
AXES = {"x": (-0.5, 0.5), "y": (-0.5, 0.5), "z": (0.0, 10.0)}


def measure(x, y, z):
    """A bowl whose lowest point is at (0.1, -0.2, 3)."""
    return ((x - 0.1) ** 2 + 4 * (y + 0.2) ** 2 + 0.01 * (z - 3) ** 2) ** 0.5


def bowl(point):
    return {"f": (point["x"] - 0.2) ** 2 + (point["y"] - 2) ** 2}


def poses_of(method, function=measure):
    poses = []
    while (pose := method.ask()) is not None:
        poses.append(pose)
        method.tell(function(**pose))
    return poses


class Loop(unittest.TestCase):
    def test_bobyqa_finds_the_lowest_point(self):
        method = Method("nlopt-bobyqa", AXES, steps=60, start={"x": 0.3, "y": 0.0, "z": 2.0})
        poses = poses_of(method)
        self.assertEqual(poses[0], {"x": 0.3, "y": 0.0, "z": 2.0})
        self.assertEqual((len(poses), method.end), (61, "budget_spent"))
        pose, value = method.best
        self.assertEqual(value, min(measure(**one) for one in poses))
        self.assertLess(value, 0.05)
        self.assertEqual(method.recommended, pose)

    def test_poses_keep_the_bounds_whatever_the_start(self):
        for start in (None, {"x": 0.5, "y": -0.5, "z": 0.0}):
            method = Method("random", AXES, steps=80, start=start)
            poses = poses_of(method) + [method.recommended]
            for name, (lower, upper) in AXES.items():
                values = [pose[name] for pose in poses]
                self.assertGreaterEqual(min(values), lower)
                self.assertLessEqual(max(values), upper)
                if start is None:  # and use them
                    self.assertGreater(max(values) - min(values), 0.9 * (upper - lower))

    def test_axes_as_many_and_as_large_as_allowed(self):
        for axes in ({f"a{k}": (-1, 1) for k in range(64)}, {"x": (-1e300, 1e300)}):
            for start in (None, {name: lower for name, (lower, _) in axes.items()}):
                poses = poses_of(Method("random", axes, steps=20, start=start), lambda **_: 1.0)
                self.assertEqual((len(poses), len(poses[0])), (21, len(axes)))
                shares = [(pose[name] - lower) / (upper - lower) for pose in poses for name, (lower, upper) in axes.items()]
                self.assertTrue(all(0 <= share <= 1 for share in shares))

    def test_an_algorithm_as_an_object_of_a_suite(self):
        one, other = (poses_of(Method(algorithm, AXES, steps=12, parameters=parameters)) for algorithm, parameters in (
            ({"use": "cma-es", "parameters": {"first_stride": 0.3}}, None), ("cma-es", {"first_stride": 0.3})))
        self.assertEqual(one, other)
        self.assertNotEqual(one, poses_of(Method("cma-es", AXES, steps=12)))

    def test_seeds(self):
        one, same, other = (poses_of(Method("cma-es", AXES, steps=12, seed=seed)) for seed in (1, 1, 2))
        self.assertEqual(one, same)
        self.assertNotEqual(one, other)

    def test_the_method_sees_the_merit_of_the_told_values(self):
        """The same poses as on the simulated machine: the loop loses nothing."""
        bench = relign_bench.Bench("gaussian_spot", "rho0", threads=1)
        trial = bench.run("nlopt-bobyqa", protocol="blind", steps=12, keep_frames=True)
        shares = dict.fromkeys(bench.axes, (-0.5, 0.5))
        with Method("nlopt-bobyqa", shares, steps=12, reference=bench.reference) as method:
            for step, frame in zip(trial.steps, trial.frames):
                np.testing.assert_allclose(list(method.ask().values()), step["commanded_pose"], atol=1e-6)
                method.tell(frame)
            self.assertIsNone(method.ask())

    def test_a_large_goal_costs_no_precision(self):
        plain, shifted = Method("nlopt-bobyqa", AXES, steps=30), Method("nlopt-bobyqa", AXES, steps=30, goal=2.0**20)
        self.assertEqual(poses_of(plain, lambda **pose: round(measure(**pose) * 2**20) / 2**20),
                         poses_of(shifted, lambda **pose: round(measure(**pose) * 2**20) / 2**20 + 2.0**20))

    def test_asking_twice_and_two_methods_at_once(self):
        one, other = Method("nlopt-sbplx", AXES, steps=5), Method("random", {"a": (0, 1)}, steps=5)
        for _ in range(6):
            pose = one.ask()
            self.assertEqual(pose, one.ask())
            other.tell(other.ask()["a"])
            one.tell(measure(**pose))
        self.assertEqual((one.ask(), other.ask()), (None, None))
        self.assertEqual(set(other.recommended), {"a"})


class Images(unittest.TestCase):
    def test_shape_and_value(self):
        with Method("random", {"x": (0, 1)}, steps=2, reference=np.full((2, 3), 0.5)) as method:
            method.ask()
            with self.assertRaisesRegex(ValueError, r"expected an image of shape \(2, 3\), found shape \(3, 2\)"):
                method.tell(np.zeros((3, 2)))
            with self.assertRaisesRegex(ValueError, r"must be an image of shape \(2, 3\), not None"):
                method.tell(None)
            method.tell(np.full((2, 3), 0.75))
            self.assertAlmostEqual(method.best[1], 0.25)

    def test_the_largest_pixels_have_a_finite_error(self):
        with warnings.catch_warnings(), Method("random", {"x": (0, 1)}, steps=2, reference=np.zeros((2, 3))) as method:
            warnings.simplefilter("error")
            method.ask()
            method.tell(np.full((2, 3), 1e38))
            self.assertAlmostEqual(method.best[1] / 1e38, 1, 6)


class Mistakes(unittest.TestCase):
    def test_arguments(self):
        for arguments, message in (
            (("nlopt-bobyqqa", AXES), "did you mean 'nlopt-bobyqa'"),
            (("home", AXES), "^'home' requires the true start pose, which is unknown on a machine in your own loop$"),
            (("random", {}), "axes must be"),
            (("random", {"x": (1, 0)}), "lower bound below its upper one"),
            (("random", {"x": (0, float("inf"))}), "bound of axis 'x' must be a finite number, not inf"),
            (("random", [(0, 1), (0, 1)]), r"axes must be \(lower, upper\) by name, such as .*, not \[\(0, 1\), \(0, 1\)\]"),
            (("random", {"x": 5}), "by name; axis 'x' has 5"),
            (("random", {3: (0, 1)}), "a name must be a text of at least one letter, not 3"),
            (("random", {f"a{k}": (0, 1) for k in range(65)}), "at most 64 axes, not 65"),
            (("random", {"x": (-1e308, 1e308)}), r"bounds from -1e\+300 to 1e\+300, not .* another unit"),
            (("random", {"x": (1e16, 1e16 + 2)}), "differ by at least 1e-12 of the larger one, .* another origin"),
            (("random", {"x": ("0", "1")}), "bound of axis 'x' must be a finite number, not '0'"),
            (("random", AXES, 5, [0.0, 0.0, 1.0]), "start must have a value for each of x, y, z, by name"),
            (("random", {"x": (0, 1)}, 5, {"x": "0.5"}), "start of axis 'x' must be a finite number, not '0.5'"),
            (("random", AXES, 5, None, 1, [1]), r"parameters of the algorithm must be an object \(a dict\), not \[1\]"),
            (("random", AXES, 5, None, 1, None, "image.png"), r"reference must be an image of shape \(height, width\), not 'i"),
            (("random", AXES, 5, None, 1, None, [[10**400]]), r"reference must be an image .*, of at most 1.8e308"),
            (("random", AXES, 5, None, 1, {"a": np.float32(0.5)}), "parameter 'a' must be a finite number, .*convert it"),
            (("random", AXES, 5, None, 1, {"a": float("nan")}), "parameter 'a' must be a finite number, .*, not nan"),
            (("random", AXES, 5, None, 1, None, None, "0"), "goal must be a finite number, not '0'"),
            ((None, AXES), "algorithm must be an id, a preset, a path, or an object .*, not None"),
            (("random", AXES, 0), "steps"),
            (("random", AXES, True), "steps must be a positive integer, not True"),
            (("random", {"x": (False, True)}), "bound of axis 'x' must be a finite number, not False"),
            (("random", AXES, 5, {"x": 0.0}), "start must have a value"),
            (("random", {"x": (0, 1)}, 5, {"x": 2.0}), "from 0 to 1, not 2"),
            (("random", AXES, 5, None, -1), "seed"),
            (("cma-es", AXES, 5, None, 1, {"sigmma": 1}), "sigmma"),
        ):
            with self.subTest(arguments=arguments), self.assertRaisesRegex(ValueError, message):
                Method(*arguments)

    def test_values(self):
        method = Method("random", AXES, steps=3, goal=-1.0)
        with self.assertRaisesRegex(RuntimeError, "call ask"):
            method.tell(1.0)
        method.ask()
        for value, message in ((float("nan"), "not finite"), (1e60, "not finite"), ([1.0, 2.0], "expected a number"),
                               ("1.0", "a measurement must be a number, not '1.0'"), (1j, "must be a number, not 1j"),
                               (None, "a measurement must be a number, not None"), (10**400, "a number, of at most 1.8e308"),
                               (-1.5, "below the goal -1")):
            with self.assertRaisesRegex(ValueError, message):
                method.tell(value)
        with self.assertRaisesRegex(ValueError, "seconds must be a finite number, not '3'"):
            method.tell(-0.5, "3")
        method.tell(-0.5)  # nothing is lost
        self.assertEqual(method.best[1], -0.5)

    def test_a_method_that_fails_says_why(self):
        method = Method("sensitivity", AXES, steps=3)
        method.tell(measure(**method.ask()))
        with self.assertRaisesRegex(RuntimeError, "sensitivity.*relign.model"):
            method.ask()

    def test_the_limit_for_answers_is_restored(self):
        before = os.environ.get("RELIGN_CALL_SECONDS")
        Method("random", AXES, steps=1).close()
        self.assertEqual(os.environ.get("RELIGN_CALL_SECONDS"), before)


class Ends(unittest.TestCase):
    def test_closing_early(self):
        with Method("random", AXES, steps=50) as method:
            method.ask()
        self.assertEqual((method.end, method.ask()), ("closed", None))
        with self.assertRaisesRegex(RuntimeError, "call ask"):
            method.tell(1.0)

    def test_nothing_remains(self):
        program = textwrap.dedent("""
            import relign_bench
            one = relign_bench.Method("random", {"x": (0, 1)}, steps=50)
            one.ask()
            other = relign_bench.Method("random", {"x": (0, 1)}, steps=1)
            while other.ask():
                other.tell(1.0)
            print("done")
        """)
        with tempfile.TemporaryDirectory() as folder:
            ended = subprocess.run([sys.executable, "-c", program], env={**os.environ, "TMPDIR": folder}, timeout=300,
                                   capture_output=True, text=True, check=False)
            self.assertEqual((ended.stdout, ended.returncode), ("done\n", 0), ended.stderr)
            self.assertEqual([path.name for path in pathlib.Path(folder).glob("relign-*/station")], [])

    def test_a_dropped_method_ends(self):
        method = Method("random", AXES, steps=50)
        thread = method._trial.close.peek()[2][1]
        method.ask()
        del method
        gc.collect()
        thread.join(60)
        self.assertFalse(thread.is_alive())


class Sharing(unittest.TestCase):
    def test_copies_are_refused_and_harm_nothing(self):
        with Method("random", AXES, steps=2) as method:
            for _ in range(2):
                for make in (copy.copy, copy.deepcopy, pickle.dumps):
                    with self.assertRaisesRegex(TypeError, "^a Method cannot be copied or pickled; make a new one$"):
                        make(method)
                gc.collect()
                method.tell(measure(**method.ask()))
            self.assertEqual(len(poses_of(method)), 1)

    def test_threads_share_the_pose_that_waits(self):
        method, rounds, seen, refused = Method("cma-es", AXES, steps=30), threading.Barrier(3), [[], [], []], []

        def work(poses):
            while rounds.wait(60) >= 0 and (pose := method.ask()) is not None:
                poses.append(pose)
                rounds.wait(60)
                try:
                    method.tell(measure(**pose))
                except RuntimeError as error:
                    refused.append(str(error))

        threads = [threading.Thread(target=work, args=(poses,), daemon=True) for poses in seen]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(120)
            self.assertFalse(thread.is_alive(), "a thread hangs")
        self.assertEqual((seen[1], seen[2]), (seen[0], seen[0]))
        self.assertEqual(seen[0], poses_of(Method("cma-es", AXES, steps=30)))
        self.assertEqual(refused, ["no pose waits for a value: call ask() before tell()"] * 2 * 31)

    def test_a_forked_process_is_refused_and_the_first_one_ends(self):
        forked = multiprocessing.get_context("fork")
        for early in (False, True):
            method = Method("random", AXES, steps=3)
            trial, pose = method._trial.close.peek()[2][1], method.ask()
            receives, sends = forked.Pipe(duplex=False)
            done = forked.Event()

            def use(method=method, sends=sends, done=done, pose=pose):
                for act in (method.ask, lambda: method.tell(measure(**pose))):
                    try:
                        sends.send(act())
                    except RuntimeError as error:
                        sends.send(str(error))
                method.close()
                done.wait(300)  # meanwhile this process has all that the other one had open

            process = forked.Process(target=use, daemon=True)
            process.start()
            for _ in range(2):
                self.assertTrue(receives.poll(60), "the forked process hangs")
                self.assertRegex(receives.recv(), "cannot be used in another process than its own; make a new one there")
            if early:
                method.close()
            else:
                ending = threading.Thread(target=poses_of, args=(method,), daemon=True)
                ending.start()
                ending.join(60)
                self.assertEqual(method.end, "budget_spent")
            trial.join(1)
            self.assertFalse(trial.is_alive())
            done.set()
            process.join(60)


@unittest.skipIf(importlib.util.find_spec("gest_api") is None, "gest-api is not installed")
class Generators(unittest.TestCase):
    def setUp(self):
        from gest_api.vocs import VOCS

        from relign_bench.generator import MethodGenerator

        self.vocs, self.generator = VOCS, MethodGenerator

    def test_maximizes_with_a_goal(self):
        vocs = self.vocs(variables={"x": [-0.5, 0.5], "y": [0, 3]}, objectives={"f": "MAXIMIZE"}, constants={"k": 3})
        generator = self.generator(vocs, "nlopt-bobyqa", steps=40, goal=10)
        points = []
        while suggested := generator.suggest(1):
            points += suggested
            self.assertEqual(suggested[0]["k"], 3)
            generator.ingest([{**p, "f": 10 - (p["x"] - 0.2) ** 2 - (p["y"] - 2) ** 2} for p in suggested])
        self.assertEqual(len(points), 41)
        pose, value = generator.method.best
        self.assertAlmostEqual(pose["x"], 0.2, 2)
        self.assertAlmostEqual(value, -10, 2)

    def test_rules_of_gest_api(self):
        generator = self.generator(self.vocs(variables={"x": [0, 1]}, objectives={"f": "MINIMIZE"}), "random")
        with self.assertRaisesRegex(ValueError, "one point at a time, not 2"):
            generator.suggest(2)
        (point,) = generator.suggest()
        with self.assertRaisesRegex(ValueError, "ingest it first"):
            generator.suggest()
        for results, kind, message in (
            ([{"x": point["x"], "f": 1.0}], ValueError, "lacks the key '_id': ingest .* with the point as it was suggested"),
            ([point], ValueError, "lacks the key 'f'"), ([{**point, "f": None}], ValueError, "value of 'f' must .* not None"),
            ([{**point, "f": "1"}], ValueError, "the value of 'f' must be a finite number, not '1'"),
            ([{**point, "_id": 7, "f": 1.0}], ValueError, "was not suggested last"),
            ({**point, "f": 1.0}, TypeError, "results must be a list of points, .*, not {"),
            ("f", TypeError, "must be a list of points"),
        ):
            with self.subTest(results=results), self.assertRaisesRegex(kind, message):
                generator.ingest(results)
        generator.ingest([{**point, "f": 1.0}])
        with self.assertRaisesRegex(ValueError, "was not suggested last"):
            generator.ingest([{**point, "f": 1.0}])
        generator.finalize()
        self.assertEqual(generator.suggest(), [])

    def test_a_value_better_than_the_goal(self):
        for kind, sign, message in (("MAXIMIZE", 1, "1.0 is above the goal 0: set goal to the highest value"),
                                    ("MINIMIZE", -1, "-1.0 is below the goal 0: set goal to the lowest value")):
            generator = self.generator(self.vocs(variables={"x": [0, 1]}, objectives={"f": kind}), "random")
            (point,) = generator.suggest()
            with self.assertRaisesRegex(ValueError, f"^{message} that can be measured, noise included$"):
                generator.ingest([{**point, "f": sign * 1.0}])
            generator.ingest([{**point, "f": 0.0}])

    def test_arguments_of_another_kind_are_refused(self):
        with self.assertRaisesRegex(TypeError, r"vocs must be a VOCS of gest_api.vocs, not {'x': \[0, 1\]}"):
            self.generator({"x": [0, 1]}, "random")
        with self.assertRaisesRegex(ValueError, "goal must be a finite number, not None"):
            self.generator(self.vocs(variables={"x": [0, 1]}, objectives={"f": "MINIMIZE"}), "random", goal=None)

    def test_other_spaces_are_refused(self):
        for space, message in (
            ({"variables": {"x": {1, 2}}, "objectives": {"f": "MINIMIZE"}}, "continuous variables only"),
            ({"variables": {"x": [0, 1]}, "objectives": {"f": "MINIMIZE", "g": "MINIMIZE"}}, "one objective"),
            ({"variables": {"x": [0, 1]}, "objectives": {"f": "EXPLORE"}}, "one objective"),
            ({"variables": {"x": [0, 1]}, "objectives": {"f": "MINIMIZE"}, "constraints": {"c": ["LESS_THAN", 1]}},
             "no constraints: c"),
        ):
            with self.subTest(space=space), self.assertRaisesRegex(ValueError, message):
                self.generator(self.vocs(**space), "random")

    def test_a_copy_begins_anew_and_one_that_has_begun_is_not_copied(self):
        vocs = self.vocs(variables={"x": [-0.5, 0.5], "y": [0, 3]}, objectives={"f": "MINIMIZE"})
        generator = self.generator(vocs, "cma-es", steps=6, seed=7)
        for copied in (copy.deepcopy(generator), pickle.loads(pickle.dumps(generator))):
            self.assertEqual(self.points_of(copied), self.points_of(self.generator(vocs, "cma-es", steps=6, seed=7)))
        points = self.points_of(generator)
        self.assertEqual(points, self.points_of(self.generator(vocs, "cma-es", steps=6, seed=7)))
        for make in (copy.deepcopy, pickle.dumps):
            with self.assertRaisesRegex(RuntimeError, "has suggested a point cannot be copied; make a new generator"):
                make(generator)

    def test_a_forked_process_begins_anew_or_refuses(self):
        vocs = self.vocs(variables={"x": [-0.5, 0.5], "y": [0, 3]}, objectives={"f": "MINIMIZE"})
        forked = multiprocessing.get_context("fork")
        generator = self.generator(vocs, "cma-es", steps=6)
        for begun in (False, True):
            if begun:
                points = self.points_of(generator)
            receives, sends = forked.Pipe(duplex=False)

            def answer(sends=sends):
                try:
                    sends.send(self.points_of(generator))
                except RuntimeError as error:
                    sends.send(str(error))

            process = forked.Process(target=answer)
            process.start()
            self.assertTrue(receives.poll(120), "the forked process hangs")
            answered = receives.recv()
            process.join(60)
            if not begun:
                others = answered
        self.assertEqual(others, points)
        self.assertIn("cannot be used in another process", answered)

    @staticmethod
    def points_of(generator):
        points = []
        while suggested := generator.suggest(1):
            points += suggested
            generator.ingest([{**suggested[0], **bowl(suggested[0])}])
        return points


@unittest.skipIf(importlib.util.find_spec("gest_api") is None, "gest-api is not installed")
class Programs(Folder):
    """Other packages drive a method, to the point and the value that their own history has."""

    def setUp(self):
        super().setUp()
        from gest_api.vocs import VOCS

        from relign_bench.generator import MethodGenerator

        self.vocs = VOCS(variables={"x": [-0.5, 0.5], "y": [0, 3]}, objectives={"f": "MINIMIZE"})
        self.method = functools.partial(MethodGenerator, self.vocs, "nlopt-bobyqa", steps=30)
        self.generator = self.method()
        self.addCleanup(os.chdir, os.getcwd())  # libEnsemble leaves the process in its folder

    def check(self, values, generator=None):
        pose, value = (generator or self.generator).method.best
        self.assertEqual((len(values), value), (25, min(values)))
        self.assertAlmostEqual(pose["x"], 0.2, 3)
        self.assertAlmostEqual(pose["y"], 2, 3)

    def test_libensemble(self):
        package("libensemble")
        from libensemble import Ensemble
        from libensemble.alloc_funcs.start_only_persistent import only_persistent_gens
        from libensemble.specs import AllocSpecs, ExitCriteria, GenSpecs, LibeSpecs, SimSpecs

        ensemble = Ensemble(
            libE_specs=LibeSpecs(nworkers=1, comms="threads", gen_on_manager=True, disable_log_files=True,
                                 workflow_dir_path=str(self.folder)),
            gen_specs=GenSpecs(generator=self.generator, vocs=self.vocs, batch_size=1, initial_batch_size=1),
            sim_specs=SimSpecs(simulator=lambda point, **_: bowl(point), vocs=self.vocs),
            alloc_specs=AllocSpecs(alloc_f=only_persistent_gens), exit_criteria=ExitCriteria(sim_max=25))
        history, _, flag = ensemble.run()
        self.assertEqual((flag, int(history["sim_ended"].sum())), (0, 25))
        self.check(history["f"])

    def test_xopt(self):
        xopt = package("xopt")
        optimisation = xopt.Xopt(generator=self.generator, evaluator=xopt.Evaluator(function=bowl),
                                 stopping_condition={"name": "MaxEvaluationsCondition", "max_evaluations": 25})
        optimisation.run()
        self.check(optimisation.data["f"], optimisation.generator)
        self.assertEqual(optimisation.generator.method.end, "closed")
        with self.assertRaisesRegex(RuntimeError, "cannot be copied"):
            xopt.Xopt(generator=optimisation.generator, evaluator=xopt.Evaluator(function=bowl))

    def test_optimas(self):
        package("optimas")
        from optimas.evaluators import FunctionEvaluator
        from optimas.explorations import Exploration
        from optimas.generators import ExternalGenerator

        def measured_bowl(inputs, outputs):
            outputs["f"] = bowl(inputs)["f"]

        for comms in ("threads", "local"):
            self.generator = self.method()
            exploration = Exploration(ExternalGenerator(self.generator, vocs=self.vocs), FunctionEvaluator(measured_bowl),
                                      max_evals=25, exploration_dir_path=str(self.folder / comms), libe_comms=comms)
            exploration.run()
            self.check(exploration.history["f"])

    def test_blop(self):
        package("blop")
        package("ophyd")
        from blop.plans import optimize
        from blop.protocols import OptimizationProblem
        from bluesky import RunEngine
        from ophyd.sim import SynAxis

        values, motors = [], [SynAxis(name=name) for name in self.vocs.variables]

        def evaluate(uid, suggestions):
            (point,) = suggestions
            outcome = bowl({motor.name: motor.position for motor in motors})  # of the machine
            values.append(outcome["f"])
            return [{"_id": point["_id"], **outcome}]

        problem = OptimizationProblem(self.generator, motors, [], evaluate)
        RunEngine({})(optimize(problem, iterations=25))
        self.check(values)
        ((number, point, outcome),) = self.generator.get_best_points()
        self.assertEqual((number, outcome, bowl(point)), (values.index(min(values)), {"f": min(values)}, {"f": min(values)}))
        RunEngine({})(optimize(problem, iterations=None))  # to the end of the method
        self.assertEqual((len(values), self.generator.should_stop()), (31, (True, "budget_spent")))


if __name__ == "__main__":
    unittest.main()
