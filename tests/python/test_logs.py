"""relign-train --log: learning curves read back by TensorBoard and MLflow, of runs that were killed and resumed."""

import dataclasses
import json
import os
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

from support import failure, np, package

try:  # all that training imports: mock.patch.dict would forget it, and onnx cannot be imported twice
    import matplotlib.figure  # noqa: F401
    import onnx  # noqa: F401
    import stable_baselines3  # noqa: F401
    import torch  # noqa: F401
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch and stable-baselines3, from the Python index") from None

from relign_bench.training import cli, reinforce
from relign_bench.training.imitate import Recipe as ImitateRecipe
from relign_bench.training.imitate import Training
from relign_bench.training.recipe import PRESETS
from relign_bench.training.reinforce import Reinforcement

PAPER = dataclasses.replace(PRESETS["paper"], size=100, environments=2, steps=10, batch=20, epochs=1, episode=10, total=80,
                            stretch=40)
IMITATE = ImitateRecipe(size=40, levels=(0.0,), lenses=20, pictures=2, passes=2, moves=3, optimum_samples=32)
TRAINING = "requirements-training.txt has"


class Killed(Exception):
    pass


def evaluated(moves, tuning, frames):
    """In place of an evaluation, which takes longer than the training here."""
    error = float(np.random.uniform(0.01, 0.02))  # of the segment's seed
    return {"rmse_6": error, "rmse_12": error / 2, "under_0.01": 1.0, "score": error, "errors": {}}


class Logs(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = pathlib.Path(place.name) / "ppo"
        store = {"MLFLOW_TRACKING_URI": f"file://{place.name}/mlruns", "MLFLOW_ALLOW_FILE_STORE": "true",
                 "WANDB_MODE": "offline", "WANDB_SILENT": "true"}
        for patch in (mock.patch.dict(os.environ, store), mock.patch.object(reinforce, "evaluate", evaluated),
                      mock.patch.object(reinforce, "tuning_instances", mock.Mock())):
            patch.start()
            self.addCleanup(patch.stop)

    def train(self, loggers, until=None, lines=None):
        run = Reinforcement(PAPER, self.folder, threads=1, log=(lines if lines is not None else []).append, loggers=loggers)
        run.run(until)
        return run

    def killed_and_resumed(self, loggers):
        """A run that was killed after its second segment was logged, before its checkpoint; the resumed run."""
        self.train(loggers, until=1)
        with mock.patch.object(Reinforcement, "_save", side_effect=Killed), self.assertRaises(Killed):
            self.train(loggers)
        return self.train(loggers)

    def test_tensorboard_shows_every_step_once(self):
        package("tensorboard", TRAINING)
        from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

        run = self.killed_and_resumed(["tensorboard"])
        events = EventAccumulator(str(self.folder / "tensorboard")).Reload()
        curve = events.Scalars("curve/rmse_12")
        self.assertEqual([event.step for event in curve], [40, 80])
        for event, row in zip(curve, run.rows):
            self.assertAlmostEqual(event.value, row["rmse_12"], 6)
        learner = [event.step for event in events.Scalars("train/approx_kl")]
        self.assertEqual(learner, sorted(set(learner)))
        self.assertEqual(learner[-1], 80)

    def test_mlflow_has_one_run_and_every_step_once(self):
        mlflow = package("mlflow", TRAINING)
        run = self.killed_and_resumed(["mlflow"])
        client = mlflow.MlflowClient()
        (there,) = client.search_runs(["0"])
        self.assertEqual((there.info.status, there.info.run_name), ("FINISHED", "ppo"))
        self.assertEqual((there.data.params["rate"], there.data.params["preset"]), (str(PAPER.rate), "paper"))
        history = client.get_metric_history(there.info.run_id, "curve/rmse_12")
        self.assertEqual([(one.step, one.value) for one in history], [(row["steps"], row["rmse_12"]) for row in run.rows])
        learner = [one.step for one in client.get_metric_history(there.info.run_id, "train/approx_kl")]
        self.assertEqual(learner, sorted(set(learner)))
        with mock.patch.dict(os.environ, MLFLOW_TRACKING_URI=f"file://{self.folder}/elsewhere"), \
                self.assertRaisesRegex(ValueError, "cannot resume a run at .*; set MLFLOW_TRACKING_URI as before, or remove"):
            self.train(["mlflow"])

    def test_weights_and_biases_continues_its_run_without_a_network(self):
        wandb = package("wandb", TRAINING)
        self.addCleanup(wandb.teardown)  # at the end it would refuse unittest's exit status, which is not an int
        self.train(["wandb"], until=1)
        run = self.train(["wandb"])
        name = f"run-{json.loads((self.folder / 'wandb.json').read_text())['run']}.wandb"
        sessions = [file.read_bytes() for file in sorted(self.folder.glob(f"wandb/offline-run-*/{name}"))]
        self.assertEqual(len(sessions), 2)
        found = [[json.dumps(row["rmse_12"]).encode() in session for row in run.rows] for session in sessions]
        self.assertEqual(found, [[True, False], [False, True]])
        with mock.patch("wandb.init", side_effect=RuntimeError("no API key")), \
                self.assertRaisesRegex(ValueError, "cannot begin a run: no API key; run wandb login, or set WANDB_MODE"):
            self.train(["wandb"])

    def test_a_function_gets_curve_and_learner_and_its_errors_do_not_end_the_training(self):
        logged, lines = [], []

        def failing(step, values):
            raise OSError("no route\nto host")

        self.train([lambda step, values: logged.append((step, values)), failing], lines=lines)
        curve = [(step, values["curve/rmse_6"]) for step, values in logged if "curve/rmse_6" in values]
        self.assertEqual([step for step, _ in curve], [40, 80])
        self.assertTrue(any("train/loss" in values for _, values in logged))
        self.assertFalse([values for _, values in logged if not all(isinstance(one, float) for one in values.values())])
        self.assertTrue(any("did not log step 40: no route to host" in line for line in lines), lines)

    def test_imitation_logs_every_pass_once(self):
        logged = []

        def train():
            Training(IMITATE, self.folder, threads=1, log=lambda _: None,
                     loggers=[lambda step, values: logged.append((step, values["curve/loss"]))]).run()

        with mock.patch.object(Training, "_calibrate", side_effect=Killed), self.assertRaises(Killed):
            train()
        train()
        self.assertEqual([step for step, _ in logged], [1, 2])
        rows = (self.folder / "curve.csv").read_text().splitlines()[1:]
        self.assertEqual(rows, [f"{step},{loss:.6f}" for step, loss in logged])

    def test_missing_packages_are_named_before_anything_is_written(self):
        for name in ("tensorboard", "mlflow", "wandb"):
            with mock.patch.dict(sys.modules, {name: None}):
                for verb in ("ppo", "imitate"):
                    preset = ["--preset", "paper"] if verb == "ppo" else []
                    self.assertIn(f"--log {name} needs {name}: pip install {name}",
                                  failure(verb, *preset, "--log", name, "-o", self.folder))
        self.assertFalse(self.folder.exists())

    def test_tensorboard_is_the_default_where_it_is_installed(self):
        with mock.patch.object(cli, "find_spec", return_value=object()):
            self.assertEqual(cli.chosen_loggers(None), ["tensorboard"])
        with mock.patch.object(cli, "find_spec", return_value=None), mock.patch.object(cli, "log") as log:
            self.assertEqual(cli.chosen_loggers(None), [])
        self.assertIn("pip install tensorboard", log.call_args.args[0])
        self.assertEqual(cli.chosen_loggers(["mlflow", "mlflow"]), ["mlflow"])


if __name__ == "__main__":
    unittest.main()
