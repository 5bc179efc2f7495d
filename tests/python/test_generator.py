"""Methods of the benchmark as generators of gest-api, by themselves and in the programs that take generators."""

import copy
import functools
import importlib.util
import multiprocessing
import os
import pickle
import unittest

from support import Folder, package


def bowl(point):
    return {"f": (point["x"] - 0.2) ** 2 + (point["y"] - 2) ** 2}


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
            ([{**point, "x": point["x"] + 0.01, "f": 1.0}], ValueError, "was not suggested last"),
            ([{**point, "x": None, "f": 1.0}], ValueError, "variable 'x' must be a finite number, not None"),
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

    def test_the_end_with_a_point_that_waits_is_as_without(self):
        generator = self.generator(self.vocs(variables={"x": [0, 1]}, objectives={"f": "MINIMIZE"}), "random")
        (point,) = generator.suggest()
        generator.finalize()
        self.assertEqual((generator.should_stop(), generator.suggest()), ((True, "closed"), []))
        with self.assertRaisesRegex(ValueError, "was not suggested last"):
            generator.ingest([{**point, "f": 1.0}])

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
            libE_specs=LibeSpecs(nworkers=1, comms="threads", gen_on_manager=True, final_gen_send=True, disable_log_files=True,
                                 workflow_dir_path=str(self.folder)),
            gen_specs=GenSpecs(generator=self.generator, vocs=self.vocs, batch_size=1, initial_batch_size=1),
            sim_specs=SimSpecs(simulator=lambda point, **_: bowl(point), vocs=self.vocs),
            alloc_specs=AllocSpecs(alloc_f=only_persistent_gens), exit_criteria=ExitCriteria(sim_max=25))
        history, _, flag = ensemble.run()
        self.assertEqual((flag, int(history["sim_ended"].sum())), (0, 25))
        self.check(history["f"])
        self.assertEqual(self.generator._told, 25)

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
