"""relign-train ppo: runs of a minute, interrupted and resumed. Needs torch and Stable-Baselines3."""

import contextlib
import csv
import dataclasses
import io
import json
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile
import types
import unittest
import weakref
from unittest import mock

from support import Folder, failure, np

try:
    import stable_baselines3  # noqa: F401
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch and stable-baselines3, from the Python index") from None

from relign_bench.training import cli, export, exporting, reinforce
from relign_bench.training.devices import processor, trained_on
from relign_bench.training.imitate import Recipe as ImitateRecipe
from relign_bench.training.imitate import Training
from relign_bench.training.recipe import PRESETS, SHAPED, SHAPED_EVEN, SHAPED_REWARDS, Recipe, preset_recipe
from relign_bench.training.reinforce import Reinforcement
from relign_bench.training.settings import changed_settings, kept_recipe, with_goal, with_settings
from relign_bench.training.shaped import LEAST_EFFECT
from relign_bench.training.stable_baselines import StableBaselinesEnv

PAPER = dataclasses.replace(PRESETS["paper"], size=100, environments=2, steps=20, batch=40, epochs=1, episode=10, total=120,
                            stretch=40)
TUNED = dataclasses.replace(PRESETS["tuned"], size=40, environments=10, batch=60, epochs=1, total=360, stretch=120,
                            optimum_samples=32)


def quiet(_):
    pass


class Runs(Folder):
    def warm_start(self):
        """The folder of an imitation run that has not trained yet."""
        recipe = ImitateRecipe(size=40, levels=(0.0,), optimum_samples=32)
        training = Training(recipe, self.folder / "warm", threads=1, log=quiet)
        training.seconds = 1800.0
        with training.folder.alone():
            training._save(0, torch.optim.Adam(training.net.parameters()))
        return self.folder / "warm"

    def expect_same(self, whole, resumed):
        for name, value in whole.model.policy.state_dict().items():
            np.testing.assert_array_equal(value.numpy(), resumed.model.policy.state_dict()[name].numpy(), name)
        rows = [[{k: v for k, v in row.items() if k != "hours"} for row in run.rows] for run in (whole, resumed)]
        self.assertEqual(*rows)


class Segments(Runs):
    def test_interrupted_paper_recipe_resumes_to_the_same_weights_with_any_number_of_threads(self):
        whole = Reinforcement(PAPER, self.folder / "whole", threads=1, log=quiet)
        whole.run()
        Reinforcement(PAPER, self.folder / "parts", threads=3, log=quiet).run(until=1)
        resumed = Reinforcement(PAPER, self.folder / "parts", threads=2, log=quiet)
        self.assertEqual(resumed.done, 1)
        resumed.run()
        self.expect_same(whole, resumed)
        self.assertEqual([row["steps"] for row in whole.rows], [40, 80, 120])
        self.assertEqual((self.folder / "whole/curve.csv").read_text().count("\n"), 4)
        self.assertTrue((self.folder / "whole/curve.png").read_bytes().startswith(b"\x89PNG"))

    def test_segment_does_not_keep_the_last_observations_of_its_episodes(self):
        last, alive = [], []

        def step_wait(environments, step=StableBaselinesEnv.step_wait):
            stepped = step(environments)
            last.extend(weakref.ref(info["terminal_observation"]) for info in stepped[3] if info)
            return stepped

        def evaluate(*arguments, evaluated=reinforce.evaluate):
            alive.append(sum(observation() is not None for observation in last))
            return evaluated(*arguments)

        with mock.patch.object(StableBaselinesEnv, "step_wait", step_wait), mock.patch.object(reinforce, "evaluate", evaluate):
            Reinforcement(PAPER, self.folder / "run", threads=1, log=quiet).run(until=1)
        self.assertEqual(len(last), PAPER.stretch // PAPER.episode)
        self.assertLessEqual(alive[0], PAPER.environments)

    def test_rewards_of_the_recipe_are_those_of_the_environments(self):
        least, named = {}, {}
        for reward in SHAPED_REWARDS:
            recipe = dataclasses.replace(PAPER, reward=reward, goal=0.0, optimum_samples=32, total=40)
            training = Reinforcement(recipe, self.folder / reward, threads=1, log=quiet)
            training.run()
            effects = training.env._directions.values
            least[reward], named[reward] = effects.min() / effects.max(), training.env.named
        self.assertLess(least[SHAPED], 0.001)
        self.assertAlmostEqual(least[SHAPED_EVEN], LEAST_EFFECT**2, 12)
        self.assertEqual(named, {reward: reward for reward in SHAPED_REWARDS})

    def test_run_can_be_extended_when_the_rate_is_constant(self):
        whole = Reinforcement(PAPER, self.folder / "whole", threads=1, log=quiet)
        whole.run()
        less = dataclasses.replace(PAPER, total=80)
        Reinforcement(less, self.folder / "longer", threads=1, log=quiet).run()
        longer = Reinforcement(PAPER, self.folder / "longer", threads=1, log=quiet)
        self.assertEqual((longer.done, kept_recipe(Recipe, self.folder / "longer").total), (2, less.total))
        longer.run()
        self.assertEqual(kept_recipe(Recipe, self.folder / "longer").total, PAPER.total)
        self.expect_same(whole, longer)
        with self.assertRaisesRegex(ValueError, "another recipe \\(total: 120 in the folder, 80 given\\)"):
            Reinforcement(less, self.folder / "longer", threads=1, log=quiet)
        Reinforcement(dataclasses.replace(less, last_rate=0.0), self.folder / "falls", threads=1, log=quiet).run(until=0)
        with self.assertRaisesRegex(ValueError, "another recipe \\(total: 80 in the folder, 120 given\\)"):
            Reinforcement(dataclasses.replace(PAPER, last_rate=0.0), self.folder / "falls", threads=1, log=quiet)

    def test_run_continues_the_network_of_another_by_another_recipe(self):
        first = Reinforcement(PAPER, self.folder / "first", threads=1, log=quiet)
        first.run(until=2)
        recipe, log = dataclasses.replace(PAPER, goal=0.0, last_rate=0.0, total=80, seed=1), []
        whole = Reinforcement(recipe, self.folder / "whole", self.folder / "first", threads=1, log=log.append)
        for name, value in first.model.policy.state_dict().items():
            np.testing.assert_array_equal(value.numpy(), whole.model.policy.state_dict()[name].numpy(), name)
        steps = [learner.model.policy.optimizer.state_dict()["state"][0]["step"] for learner in (first, whole)]
        self.assertEqual(*steps)
        self.assertGreater(steps[0], 0)
        self.assertEqual((whole.done, whole.model.num_timesteps, whole.warm_seconds), (0, 0, first.seconds))
        self.assertRegex(whole.recipe.warm_start, "^sha256:")
        whole.run()
        self.assertEqual([row["steps"] for row in whole.rows], [40, 80])
        self.assertRegex(log[0], r"^starts from '.*first' after 80 steps, with a standard deviation of moves of 0\.0")
        self.assertEqual(log[1].split()[0], "40")
        Reinforcement(recipe, self.folder / "parts", self.folder / "first", threads=1, log=quiet).run(until=1)
        resumed = Reinforcement(recipe, self.folder / "parts", self.folder / "first", threads=1, log=quiet)
        resumed.run()
        self.expect_same(whole, resumed)
        again = dataclasses.replace(recipe, seed=0, first_log_std=-4.5)
        quieter = Reinforcement(again, self.folder / "same", self.folder / "first", threads=1, log=log.append)
        np.testing.assert_array_equal(quieter.model.policy.log_std.detach(), -4.5)
        self.assertIn("seed 0 is that of --warm-start, so training repeats its instances", log[-1])
        self.assertEqual(Reinforcement(recipe, self.folder / "parts", threads=1, log=quiet).done, 2)  # without the source
        first.run()
        with self.assertRaisesRegex(ValueError, "was begun from another checkpoint than --warm-start"):
            Reinforcement(recipe, self.folder / "parts", self.folder / "first", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "is the folder of the run itself"):
            Reinforcement(PAPER, self.folder / "first", self.folder / "first", threads=1, log=quiet)
        for change, why in (({"optimizer": None}, "has no state of the optimizer"),
                            ({"policy": {**first.model.policy.state_dict(), "log_std": torch.full((5,), torch.nan)}},
                             "weights that are not finite"), ({"policy": None}, "is damaged or of another run")):
            state = torch.load(self.folder / "first/checkpoint.pt", weights_only=True)
            shutil.copytree(self.folder / "first", self.folder / "changed", dirs_exist_ok=True)
            torch.save({**state, **change}, self.folder / "changed/checkpoint.pt")
            with self.assertRaisesRegex(ValueError, why):
                Reinforcement(recipe, self.folder / "refused", self.folder / "changed", threads=1, log=quiet)
        tuned = self.folder / "tuned"
        Reinforcement(TUNED, tuned, self.warm_start(), threads=1, log=quiet).run(until=1)
        with self.assertRaisesRegex(ValueError, "is of preset tuned, whose network is another one"):
            Reinforcement(recipe, self.folder / "other", tuned, threads=1, log=quiet)

    def test_interrupted_tuned_recipe_resumes_to_the_same_weights_after_the_warm_up(self):
        warm = self.warm_start()
        whole = Reinforcement(TUNED, self.folder / "whole", warm, threads=1, log=quiet)
        self.assertIn("spread", dict(whole.model.policy.named_buffers()))  # which move to a GPU
        first = {name: value.clone() for name, value in whole.model.policy.net.state_dict().items()}
        whole.run(until=1)
        for name, value in whole.model.policy.net.state_dict().items():
            np.testing.assert_array_equal(value.numpy(), first[name].numpy(), name)  # only the critic has learnt
        whole.run()
        self.assertEqual(whole.drawn, whole.done)  # the last segment, although its picture would have been too early
        changed = [name for name, value in whole.model.policy.net.state_dict().items() if not torch.equal(value, first[name])]
        self.assertIn("head.weight", changed)
        Reinforcement(TUNED, self.folder / "parts", warm, threads=1, log=quiet).run(until=2)
        resumed = Reinforcement(TUNED, self.folder / "parts", warm, threads=1, log=quiet)
        resumed.run()
        self.expect_same(whole, resumed)

    def test_other_algorithms_of_the_paper_train(self):
        for algorithm in ("a2c", "trpo", "recurrent-ppo"):
            with self.subTest(algorithm):
                if algorithm != "a2c":
                    try:
                        import sb3_contrib  # noqa: F401
                    except ImportError as problem:
                        self.skipTest(f"{problem}: needs sb3-contrib, from the Python index")
                recipe = dataclasses.replace(PAPER, algorithm=algorithm, total=40)
                training = Reinforcement(recipe, self.folder / algorithm, threads=1, log=quiet)
                training.run()
                self.assertEqual(training.rows[-1]["steps"], 40)

    def test_goal_follows_the_level_unless_it_is_set(self):
        def goal(*settings, preset="paper"):
            return with_goal(with_settings(PRESETS[preset], settings), settings).goal

        self.assertEqual([goal(f"level={level}") for level in (0, 0.25, 0.5)], [0.051, 0.0555, 0.06])
        self.assertEqual(goal("level=0.5", "goal=0.02"), 0.02)
        self.assertEqual(goal("level=0.5", "goal=0"), 0)
        self.assertEqual(goal("level=0.3", preset="tuned"), 0)
        with self.assertRaisesRegex(ValueError, "only for 0, 0.25, 0.5; add --set goal="):
            goal("level=0.3")

    def test_wrong_recipes_are_refused(self):
        with self.assertRaisesRegex(ValueError, "unknown input 'bytes'; inputs: float32, uint8"):
            Reinforcement(dataclasses.replace(PAPER, input="bytes"), self.folder / "z", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "device 'mps' is not supported; expected 'cpu', 'cuda' or 'cuda:N'"):
            Reinforcement(PAPER, self.folder / "z", threads=1, log=quiet, device="mps")
        with self.assertRaisesRegex(ValueError, "size=40.*at least 64 columns"):
            Reinforcement(dataclasses.replace(PAPER, size=40), self.folder / "z", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "needs --warm-start FOLDER"):
            Reinforcement(TUNED, self.folder / "x", threads=1, log=quiet)
        with self.assertRaisesRegex(ValueError, "'tuned' has the reward 'shaped' only, not 'paper'; add --preset paper"):
            Reinforcement(dataclasses.replace(TUNED, reward="paper"), self.folder / "x", threads=1, log=quiet)
        Reinforcement(PAPER, self.folder / "y", threads=1, log=quiet).run(until=0)
        with self.assertRaisesRegex(ValueError, "another recipe"):
            Reinforcement(dataclasses.replace(PAPER, rate=1e-3), self.folder / "y", threads=1, log=quiet)


class Commands(unittest.TestCase):
    """Of a run of one training segment, in which no episode ends."""

    SETTINGS = ("size=100", "input=uint8", "frames=1", "environments=2", "steps=10", "stretch=20", "total=20", "batch=20",
                "epochs=1", "goal=0")

    @classmethod
    def setUpClass(cls):
        kept = tempfile.TemporaryDirectory()
        cls.addClassCleanup(kept.cleanup)
        cls.trained, cls.log = pathlib.Path(kept.name) / "trained", io.StringIO()
        with contextlib.redirect_stderr(cls.log), contextlib.redirect_stdout(io.StringIO()):
            assert cli.main(cls.command(cls.trained)) == 0, cls.log.getvalue()

    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name) / "run"

    @classmethod
    def command(cls, folder, *settings):
        chosen = (part for setting in (*cls.SETTINGS, *settings) for part in ("--set", setting))
        return ["ppo", "--preset", "paper", "--threads", "1", *chosen, "-o", str(folder)]

    def opened(self, *settings, log=quiet):
        return Reinforcement(with_settings(PRESETS["paper"], [*self.SETTINGS, *settings]), self.folder, threads=1, log=log)

    def test_segment_without_episodes_has_no_reward(self):
        self.assertIn("reward - per step, - steps per episode", self.log.getvalue())
        with (self.trained / "curve.csv").open(newline="") as file:
            row = next(csv.DictReader(file))
        self.assertEqual([row[name] for name in ("episodes", "reward", "episode", "success")], ["0", "", "", ""])
        self.assertNotIn("nan", self.log.getvalue() + (self.trained / "curve.csv").read_text())
        self.assertTrue((self.trained / "curve.png").is_file())
        report = pathlib.Path(__file__).parents[2] / "reports" / "paper" / "training.py"
        figure = self.folder.with_suffix(".png")
        subprocess.run([sys.executable, report, self.trained, "-o", self.folder.with_suffix(".csv"), "--figure", figure],
                       check=True, capture_output=True)
        self.assertTrue(figure.is_file())

    def test_corrected_command_uses_the_same_folder(self):
        tuned = ("--preset", "tuned", "--set")
        for wrong, why in ((("--scene", "nope"), "unknown scene 'nope'"), (("--set", "size=70"), "does not divide captures"),
                           (("--set", "noise_level=foo"), "unknown noise level 'foo'"),
                           (("--threads", "-1"), "--threads must be a positive integer, not -1"),
                           (("--seed", "-1"), "seed must be a non-negative"),
                           (("--set", "seed=99999999999999999999"), "seed must be from 0 to"),
                           (("--set", "steps=50"), r"stretch=20 must be a multiple of environments \* steps, here 100"),
                           (("--set", "warm_start=x"), "'warm_start' is not a setting; use --warm-start"),
                           (("--set", "preset=x"), "'preset' is not a setting; use --preset"),
                           (("--set", "first_log_std=nan"), "first_log_std must be a finite number"),
                           (("--warm-start", self.trained, "--set", "size=200"),
                            "has a network for size=100, not 200; add --set size=100"),
                           (("--warm-start", self.trained, "--set", "heads="),
                            "has a network for heads=64,64, not \\(\\); add --set heads=64,64"),
                           (("--warm-start", self.trained, "--algorithm", "a2c"), "add --algorithm ppo"),
                           (("--warm-start", "nowhere"), "'nowhere' is not the folder of a run"),
                           (("--warm-start", ""), "--warm-start '' names no folder"),
                           ((*tuned, "environments=5", "--set", "stretch=50", "--warm-start", self.trained),
                            "of relign-train ppo; expected one of relign-train imitate; or add --preset paper"),
                           ((*tuned, "environments=7"), "environments=7 must be a multiple of 5"),
                           (("--until", "0"), "--until must be a positive integer, not 0"),
                           (("--until", "-1"), "--until must be a positive integer, not -1"),
                           (("--minutes", "nan"), "--minutes must be a non-negative number, not nan")):
            with self.subTest(wrong):
                self.assertRegex(failure(*self.command(self.folder), *wrong), why)
                self.assertFalse(self.folder.exists())

    def test_scene_that_tuning_instances_refuse_leaves_no_folder(self):
        with mock.patch("relign_bench.training.reinforce.tuning_instances", side_effect=ValueError("a fixed sensor")):
            self.assertIn("a fixed sensor", failure(*self.command(self.folder)))
        self.assertFalse(self.folder.exists())

    def test_warm_start_of_another_size_is_refused_at_once(self):
        warm = Training(ImitateRecipe(size=40, levels=(0.0,)), self.folder, 1, quiet)
        with warm.folder.alone():
            message = failure("ppo", "--warm-start", self.folder, "-o", self.folder / "x")
            self.assertIn("has a network for size=40, not 100; add --set size=40", message)
            again = ("ppo", "--warm-start", self.folder, "--set", "size=40", "-o", self.folder / "x")
            self.assertIn("nothing trained yet: --warm-start", failure(*again))
            torch.save({"policy": {}}, self.folder / "checkpoint.pt")
            self.assertRegex(failure(*again), "checkpoint.pt' is damaged or of another run")

    def test_run_without_a_checkpoint_has_nothing_to_export(self):
        run = self.opened()
        run.run(minutes=0)
        self.assertEqual(run.untrained(), f"nothing trained yet in '{self.folder}': it has no checkpoint.pt")
        self.assertRegex(failure("export", self.folder, "-o", self.folder / "x.onnx"), "^error: nothing trained yet in ")
        self.assertEqual(list(self.folder.glob("x*")), [])

    def test_exports_the_network_with_the_best_score_or_the_last_one(self):
        shutil.copytree(self.trained, self.folder)
        best = torch.load(self.folder / "best.pt", weights_only=True)
        last = torch.load(self.folder / "checkpoint.pt", weights_only=True)
        last["policy"]["action_net.bias"] += 0.125
        last["steps"] = 40
        torch.save(last, self.folder / "checkpoint.pt")
        for options, state, steps, chosen_on in (((), best, 20, "tuning"), (("--last",), last, 40, "none")):
            with contextlib.redirect_stdout(io.StringIO()):
                self.assertEqual(cli.main(["export", str(self.folder), *options, "-o", str(self.folder / "x.onnx")]), 0)
            about = json.loads((self.folder / "x.json").read_text())
            run = self.opened()
            run.model.policy.load_state_dict(state["policy"])
            answers = self.answers(export.Actor(run.model.policy, run.recipe.input), about["observation"]["frames"])
            np.testing.assert_allclose(about["parity"]["answers"], answers, rtol=1e-5)
            self.assertEqual((about["trained"]["steps"], about["trained"]["instances"]["checkpoint"]), (steps, chosen_on))

    @staticmethod
    def answers(net, frames):
        blocks = export.enlarged(export.parity_blocks(frames), 100).astype(np.float32)
        with torch.no_grad():
            return [net(torch.from_numpy(image[None]))[0].tolist() for image in blocks]

    def test_missing_network_with_the_best_score_is_named(self):
        shutil.copytree(self.trained, self.folder)
        (self.folder / "best.pt").unlink()
        (self.folder / "ppo.onnx").unlink()
        self.assertIn("best.pt' is missing, the network with the best score", failure(*self.command(self.folder)))
        self.assertFalse((self.folder / "ppo.onnx").exists())

    def test_damaged_checkpoints_are_named(self):
        shutil.copytree(self.trained, self.folder)
        run = self.opened()
        for name in ("checkpoint.pt", "best.pt"):
            whole, foreign = (self.folder / name).read_bytes(), io.BytesIO()
            torch.save([1], foreign)
            for content in (b"", b"garbage", whole[:len(whole) // 2], foreign.getvalue()):
                (self.folder / name).write_bytes(content)
                with self.subTest(name), self.assertRaisesRegex(ValueError, f"{name}' is damaged or of another run"):
                    run._load(name)

    def test_complete_run_writes_its_curves_anew(self):
        shutil.copytree(self.trained, self.folder)
        for name in ("curve.csv", "errors.csv"):
            (self.folder / name).unlink()
        self.opened().run()
        for name in ("curve.csv", "errors.csv", "recipe.json"):
            self.assertEqual((self.folder / name).read_bytes(), (self.trained / name).read_bytes(), name)

    def test_longer_run_keeps_the_recipe_while_another_process_trains(self):
        shutil.copytree(self.trained, self.folder)
        with self.opened().folder.alone():
            message = failure(*self.command(self.folder, "total=40"))
        self.assertRegex(message, "another process trains in ")
        self.assertEqual(kept_recipe(Recipe, self.folder).total, 20)

    def test_run_opened_before_another_process_trained_is_refused(self):
        shutil.copytree(self.trained, self.folder)
        late, first = self.opened("total=60"), self.opened("total=60")
        first.run(until=2)
        first.run(until=3)
        before = (self.folder / "checkpoint.pt").read_bytes()
        with self.assertRaisesRegex(ValueError, "another process has trained in '.*' meanwhile; run the same command again"):
            late.run()
        self.assertEqual((self.folder / "checkpoint.pt").read_bytes(), before)

    def test_resumed_run_knows_how_long_a_segment_takes(self):
        shutil.copytree(self.trained, self.folder)
        lines = []
        run = self.opened("total=30", log=lines.append)
        run.rows[-1]["hours"] = 1.0
        run.run(minutes=59)
        self.assertEqual(run.done, 1)
        self.assertEqual(lines[-2:], ["the run ends at step 40: training segments are of 20 steps",
                                      "stopped at step 20 of 40; the same command resumes"])

    def test_folder_of_imitation_is_named(self):
        with Training(ImitateRecipe(size=40, levels=(0.0,)), self.folder, 1, quiet).folder.alone():
            pass
        self.assertRegex(failure(*self.command(self.folder)),
                         "^error: '.*' is the folder of a run of relign-train imitate; expected one of relign-train ppo$")


class Export(Runs):
    def assert_repeats(self, command, recipe):
        """The command of a side file makes the recipe."""
        words = iter(shlex.split(command)[2:])
        given = {"--algorithm": ["ppo"]}
        for option in words:
            given.setdefault(option, []).append(next(words))
        usual = preset_recipe(given["--preset"][0], given["--algorithm"][0], given["--scene"][0], int(given["--seed"][0]))
        self.assertEqual(with_goal(with_settings(usual, given["--set"]), given["--set"]), recipe)
        self.assertEqual(given["--threads"], ["1"])

    def test_changed_settings_give_those_that_would_follow(self):
        usual = PRESETS["paper"]
        for changes in ({}, {"level": 0.5}, {"level": 0.1}, {"rate": 1e-3}, {"rate": 1e-3, "last_rate": 1e-3}, {"heads": ()}):
            recipe = dataclasses.replace(usual, **changes)
            settings = changed_settings(recipe, usual)
            self.assertEqual(with_goal(with_settings(usual, settings), settings), recipe)
        self.assertEqual(settings, ["heads="])

    def test_published_network_is_of_the_second_run_of_preset_linear(self):
        side_file = pathlib.Path(__file__).parents[2] / "reports" / "paper" / "trainings" / "shaped-linear-3e-4.json"
        trained = json.loads(side_file.read_text())["trained"]["recipe"]
        second = with_settings(PRESETS["linear"], ["last_rate=0", "total=540000", "seed=1"])
        self.assertEqual(dataclasses.replace(second, preset="paper", warm_start=trained["warm_start"]), Recipe(**trained))

    def test_side_files_of_both_recipes(self):
        command = [sys.executable, "-m", "relign_bench.training"]
        Reinforcement(PAPER, self.folder / "paper", threads=1, log=quiet).run(until=1)
        subprocess.run([*command, "export", self.folder / "paper", "-o", self.folder / "paper.onnx"], check=True,
                       capture_output=True)
        side = json.loads((self.folder / "paper.json").read_text())
        self.assertEqual((side["output"], side["observation"]["frames"], side["trained"]["steps"]), ("move", 5, 40))
        self.assertEqual(side["trained"]["threads"], 1)
        self.assertEqual(side["trained"]["machine"], processor())
        self.assert_repeats(side["command"], PAPER)
        Reinforcement(TUNED, self.folder / "tuned", self.warm_start(), threads=1, log=quiet).run(until=2)
        subprocess.run([*command, "export", self.folder / "tuned", "-o", self.folder / "tuned.onnx"], check=True,
                       capture_output=True)
        side = json.loads((self.folder / "tuned.json").read_text())
        self.assertEqual((side["output"], side["observation"]["frames"]), ("way", 1))
        self.assert_repeats(side["command"], TUNED)
        self.assertEqual(side["trained"]["warm_start"], {"hours": 0.5})  # part of the network's cost
        self.assertEqual(len(side["parity"]["inputs"]), 64)
        self.assertEqual(len(side["reference"]["means"]), 400)

    def test_command_of_a_training_on_a_gpu_names_it(self):
        with mock.patch.object(torch.cuda, "get_device_name", lambda _: "NVIDIA H200"):
            places = trained_on({}, 2, "cuda", "cuda")
        self.assertEqual(places["machine"], f"{processor()}, NVIDIA H200")
        run = types.SimpleNamespace(recipe=PAPER, trained_on=places)
        self.assertTrue(exporting.command_of(run, PAPER, "ppo").endswith("--threads 2 --device cuda --render cuda -o FOLDER"))

    def test_folder_without_a_run_is_refused(self):
        done = subprocess.run([sys.executable, "-m", "relign_bench.training", "export", self.folder, "-o", "x.onnx"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("is not the folder of a run", done.stderr)

    def test_parity_inputs_are_blocks(self):
        blocks = export.parity_blocks(2)
        inputs = export.enlarged(blocks, 40)
        self.assertEqual(inputs.shape, (64, 2, 40, 40))
        np.testing.assert_array_equal(inputs[3, 1, 8:12, 36:40], np.full((4, 4), blocks[3, 1, 2, 9]))


if __name__ == "__main__":
    unittest.main()
