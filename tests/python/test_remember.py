"""relign-train on a scene with a score of its own: the policy remembers readings, and the harness runs it. Needs torch."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

from support import Folder, failure, np, relign_bench

try:
    import onnx  # noqa: F401
    import torch
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: training needs torch and onnx, from the Python index") from None

from relign_bench.conventions import to_bytes
from relign_bench.training.episodes import Episode, Pool, probed, searching
from relign_bench.training.history import HistoryFormat, HistoryNet
from relign_bench.training.remember import Training

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
FIBRE = str(EXAMPLES / "fibre" / "fibre.py")
TINY = dict(pool=16, passes=2, epochs=1, moves=6, probes=3, last=4, best=2, hidden=32, batch=16, tuning_steps=5)


def command(folder, scene=FIBRE, **changes):
    settings = [part for name, value in {**TINY, **changes}.items() for part in ("--set", f"{name}={value}")]
    return [sys.executable, "-m", "relign_bench.training", "imitate", "--scene", scene, "-o", str(folder), "--threads", "1",
            *settings]


class Inputs(unittest.TestCase):
    """The values of tests/training/policies/history_test.cpp."""

    def setUp(self):
        self.format = HistoryFormat(1, 2, 1, np.array([10.0]), np.array([5.0]), np.array([2.0]), 0)

    def at(self, poses, readings):
        poses = np.array(poses)[None, :, None]
        return self.format.inputs(poses / 20, np.array(readings, np.float32)[None, :, None])[0]

    def test_latest_slots_fill_from_the_end_and_best_ones_from_the_front(self):
        log = np.log
        np.testing.assert_allclose(self.at([10.0], [20]), [1, 0, 0, 2, log(11), 0, 0, 0, 0, 0, 1, 0, 0, 2, log(11)], rtol=1e-6)
        found = self.at([10.0, 4.0, 6.0], [20, 4, 4])
        away = [-0.1, -log(1 + 0.1 / 0.005)]
        np.testing.assert_allclose(found, [1, *away, -1.2, log(3), 1, *away, -1.2, log(3), 1, 0, 0, -1.2, log(3)], rtol=1e-6)

    def test_scenes_with_images_keep_poses_alone(self):
        form = HistoryFormat(2, 3, 0, np.empty(0), np.empty(0), np.empty(0))
        found = form.inputs(np.zeros((5, 2, 2)), np.empty((5, 2, 0), np.float32))
        self.assertEqual(found.shape, (5, 15))
        np.testing.assert_array_equal(found[0].reshape(3, 5)[:, 0], [0, 1, 1])


class Probes(unittest.TestCase):
    def test_probes_end_on_instances_with_a_low_reading(self):
        poses = np.zeros((2, 2, 1))
        poses[:, 1] = 0.25
        readings = np.array([[[60], [60]], [[60], [20]]], np.float32)
        seen = Episode(poses, np.empty((2, 2, 0)), readings, poses, poses[:, :, 0])
        moves = probed(lambda _: np.full((2, 1), 0.01), np.array([[0.25], [-0.25]]), 30.0, 0)(seen)
        np.testing.assert_allclose(moves, [[-0.5], [0.01]])

    def test_probes_find_more_light_than_the_start(self):
        pool = Pool(FIBRE, "declared", 24, threads=1)
        probes, until = pool.choose_probes(6, np.random.default_rng(1))
        self.assertGreater(len(probes), 2)
        starts = pool.episode(np.arange(24), probed(lambda seen: 0 * seen.poses[:, 0], probes, until, 0), len(probes))
        found = starts.readings[:, :, 0]
        self.assertLess(found.min(1).mean(), found[:, 0].mean() - 5)  # decibels

    def test_searches_approach_the_optimum(self):
        pool = Pool(FIBRE, "declared", 8, threads=1)
        pool.optima = np.full((8, 6), 0.5)
        begin, policy = searching(pool.optima, np.random.default_rng(2), 20)
        seen = pool.episode(np.arange(8), policy, 20, begin)
        away = np.linalg.norm(seen.residuals, axis=2)
        self.assertLess(np.median(away[:, -1]), np.median(away[:, 0]))


class Fibre(Folder):
    def test_harness_moves_as_the_trained_policy(self):
        run = self.folder / "run"
        subprocess.run(command(run), check=True, capture_output=True)
        side = json.loads((run / "imitation.json").read_text())
        self.assertEqual((side["observation"]["score"], len(side["parity"]["answers"])), ("loss", 64))
        self.assertEqual(len((run / "tuning.csv").read_text().splitlines()), 7)
        policy = Training.open(run, 1).policy()
        trial = relign_bench.Bench(FIBRE, "declared", threads=1).run(
            str(run / "imitation.json"), steps=12, protocol="blind", keep_frames=True)
        self.assertTrue(trial.ended_well, trial.message)
        poses = np.array([step["commanded_pose"] for step in trial.steps])[None]
        values = trial.frames.reshape(1, len(trial.steps), 1)
        for step in range(1, len(trial.steps)):
            seen = Episode(poses[:, :step], np.empty((1, step, 0)), values[:, :step], poses[:, :step], values[:, :step, 0])
            np.testing.assert_allclose(poses[0, step - 1] + policy(seen)[0], poses[0, step], atol=1e-5, err_msg=str(step))
        best = np.argmin(values[0, :, 0])
        np.testing.assert_allclose(trial.steps[-1]["recommended_pose"], poses[0, best])

    def test_interrupted_run_resumes_to_the_same_network(self):
        subprocess.run(command(self.folder / "whole"), check=True, capture_output=True)
        code = ("import sys, relign_bench.training.remember as remember\nsave = remember.Training._save\n"
                "def once(self, *given):\n    save(self, *given)\n    raise KeyboardInterrupt\nremember.Training._save = once\n"
                "from relign_bench.training.cli import main\nsys.exit(main(sys.argv[1:]))")
        arguments = command(self.folder / "stopped")
        stopped = subprocess.run([sys.executable, "-c", code, *arguments[3:]], check=False, capture_output=True, text=True)
        self.assertEqual(stopped.returncode, 130, stopped.stderr)
        resumed = subprocess.run(arguments, check=True, capture_output=True, text=True)
        self.assertIn("resuming after pass 1", resumed.stderr)
        for name in ("curve.csv", "imitation.onnx", "tuning.csv"):
            self.assertEqual((self.folder / "whole" / name).read_bytes(), (self.folder / "stopped" / name).read_bytes(), name)

    def test_reinforcement_resumes_and_runs_in_the_harness(self):
        settings = dict(environments=4, steps=5, batch=20, episode=5, total=40, stretch=20, tuning_steps=4, last=3, best=1,
                        hidden=16)
        arguments = [sys.executable, "-m", "relign_bench.training", "ppo", "--preset", "any", "--scene", FIBRE,
                     "--threads", "1",
                     *(part for name, value in settings.items() for part in ("--set", f"{name}={value}"))]
        subprocess.run([*arguments, "-o", self.folder / "whole"], check=True, capture_output=True)
        for further in (["--until", "1"], []):
            subprocess.run([*arguments, "-o", self.folder / "parts", *further], check=True, capture_output=True)
        one, other = ((self.folder / name / "ppo.onnx").read_bytes() for name in ("whole", "parts"))
        self.assertEqual(one, other)
        side = json.loads((self.folder / "parts" / "ppo.json").read_text())
        self.assertEqual((side["output"], side["observation"]["history"]["last"]), ("move", 3))
        trial = relign_bench.Bench(FIBRE, "declared", threads=1).run(str(self.folder / "parts" / "ppo.json"), steps=4,
                                                                    protocol="blind")
        self.assertTrue(trial.ended_well, trial.message)

    def test_other_scenes_are_refused(self):
        run = self.folder / "run"
        subprocess.run(command(run), check=True, capture_output=True)
        bench = relign_bench.Bench(FIBRE, "declared", threads=1, scene_parameters={"ends": 2})
        trial = bench.run(str(run / "imitation.json"), steps=2, protocol="blind")
        self.assertIn("trained for 6 axes, this scene has 12", trial.message)

    def test_mistakes_leave_no_folder(self):
        run = self.folder / "refused"
        for wrong, why in ((("--scene", FIBRE, "--randomise", "default"), "are for scenes of lenses"),
                           (("--scene", FIBRE, "--set", "lenses=3"), "unknown setting 'lenses'"),
                           (("--scene", FIBRE, "--set", "noise_level=nothing"), "nothing"),
                           (("--scene", FIBRE, "--set", "last=0"), "last must be a positive number, not 0"),
                           (("--scene", FIBRE, "--set", "scene_parameters=[2]"), "scene_parameters must be a JSON object"),
                           (("--scene", FIBRE, "--set", 'scene_parameters={"ends": 3}'), "ends"),
                           (("--scene", str(EXAMPLES / "interferometer" / "interferometer.py"), "--set", "columns=8"),
                            "networks see images of 10 to 1024 rows and columns; those of scene .* would have 8 rows and 8")):
            with self.subTest(wrong):
                self.assertRegex(failure("imitate", "-o", run, *wrong), why)
                self.assertFalse(run.exists())


class Images(unittest.TestCase):
    def test_networks_add_images_and_history(self):
        net = HistoryNet(10, 3, (16, 8), (2, 20, 40))
        self.assertEqual(net(torch.zeros(4, 2, 20, 40, dtype=torch.uint8), torch.zeros(4, 10)).shape, (4, 3))

    def test_harness_moves_as_the_policy_that_was_trained_on_images(self):
        scene = str(EXAMPLES / "interferometer" / "interferometer.py")
        with tempfile.TemporaryDirectory() as folder:
            run = pathlib.Path(folder, "run")
            subprocess.run(command(run, scene, pool=2, passes=1, moves=2, frames=2, batch=4, tuning_steps=1,
                                   noise_parameters='{"start": 0.2}'), check=True, capture_output=True)
            training = Training.open(run, 1)
            pool, policy = training.pool, training.policy()
            trial = relign_bench.Bench(scene, "declared", threads=1, noise_level_parameters={"start": 0.2}).run(
                str(run / "imitation.json"), steps=3, protocol="blind", keep_frames=True)
        self.assertTrue(trial.ended_well, trial.message)
        poses = np.array([step["commanded_pose"] for step in trial.steps])[None]
        images = to_bytes(trial.frames[:, :-1], pool.batch.white)[None]
        self.assertEqual(images.shape[2:], (256, 256), "without the line of readings")
        readings = trial.frames[None, :, -1, :1]
        self.assertGreater(readings.std(), 0)
        for step in range(1, len(trial.steps)):
            seen = Episode(poses[:, :step], images[:, :step], readings[:, :step], poses[:, :step], np.zeros((1, step)))
            self.assertFalse(np.array_equal(policy(seen), policy(seen._replace(readings=readings[:, :step] + 0.1))))
            np.testing.assert_allclose(poses[0, step - 1] + policy(seen)[0], poses[0, step], atol=1e-5, err_msg=str(step))


if __name__ == "__main__":
    unittest.main()
