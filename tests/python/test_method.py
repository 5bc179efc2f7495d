"""Methods of the benchmark in a loop of the caller's own."""

import copy
import gc
import multiprocessing.connection
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import unittest
import warnings
from unittest import mock

from support import np, relign_bench

Method = relign_bench.Method
AXES = {"x": (-0.5, 0.5), "y": (-0.5, 0.5), "z": (0.0, 10.0)}


def measure(x, y, z):
    """A bowl whose lowest point is at (0.1, -0.2, 3)."""
    return ((x - 0.1) ** 2 + 4 * (y + 0.2) ** 2 + 0.01 * (z - 3) ** 2) ** 0.5


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
            with self.assertRaisesRegex(ValueError, "without masked values: a masked value is not a number"):
                method.tell(np.ma.array(np.full((2, 3), 0.6), mask=np.eye(2, 3)))
            method.tell(np.ma.array(np.full((2, 3), 0.75)))  # nothing is masked
            self.assertAlmostEqual(method.best[1], 0.25)

    def test_the_best_value_keeps_double_precision(self):
        with Method("random", {"x": (0, 1)}, steps=2, reference=np.full((2, 3), 0.1)) as method:
            method.ask()
            method.tell(np.full((2, 3), 0.1 + 1e-12))
            self.assertAlmostEqual(method.best[1] / 1e-12, 1, 3)

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
            (("random", AXES, 5, None, 1, None, np.ma.masked_less([[0.0, 1.0]], 0.5)), "reference .*, without masked values"),
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
                               (np.ma.masked, "a number, without masked values"), (-1.5, "below the goal -1"),
                               (np.ma.array([0.5], mask=[True]), "a number, without masked values")):
            with self.assertRaisesRegex(ValueError, message):
                method.tell(value)
        with self.assertRaisesRegex(ValueError, "seconds must be a finite number, not '3'"):
            method.tell(-0.5, "3")
        method.tell(-0.5)  # nothing is lost
        self.assertEqual(method.best[1], -0.5)

    def test_a_method_that_fails_says_why(self):
        method = Method("sensitivity", AXES, steps=3)
        method.tell(measure(**method.ask()))
        for _ in range(2):
            with self.assertRaisesRegex(RuntimeError, "^the method failed: .*sensitivity.*relign.model"):
                method.ask()
        self.assertEqual((method.end, method.recommended), ("failed", None))

    def test_a_changed_best_changes_nothing(self):
        with Method("random", AXES, steps=3) as method:
            pose = method.ask()
            method.tell(1.0)
            method.best[0].clear()
            self.assertEqual(method.best, (pose, 1.0))

    def test_the_limit_for_answers_is_restored(self):
        before = os.environ.get("RELIGN_CALL_SECONDS")
        Method("random", AXES, steps=1).close()
        self.assertEqual(os.environ.get("RELIGN_CALL_SECONDS"), before)


class Ends(unittest.TestCase):
    def test_in_a_long_temporary_folder(self):
        with tempfile.TemporaryDirectory() as short:
            folder = pathlib.Path(short) / ("long" * 30)
            folder.mkdir()
            with mock.patch.object(tempfile, "tempdir", str(folder)):
                self.assertEqual(len(poses_of(Method("random", AXES, steps=2))), 3)

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


class Interrupts(unittest.TestCase):
    """KeyboardInterrupt, as of Ctrl-C."""

    def test_at_any_line_of_ask_and_tell(self):
        """The method goes on: every pose is asked for in turn, and its value is told once."""
        method, poses, interrupted = Method("cma-es", AXES, steps=300), [], 0
        files, line = {relign_bench.method.__file__, multiprocessing.connection.__file__}, 0

        def trace(frame, event, _):
            nonlocal line
            if frame.f_code.co_filename in files and event == "line":
                line -= 1
                if not line:
                    raise KeyboardInterrupt
            return trace

        before = sys.gettrace()
        watchdog = threading.Timer(60, signal.pthread_kill, (threading.get_ident(), signal.SIGINT))
        watchdog.start()
        for number in range(1, 301):
            pose, line = None, number
            sys.settrace(trace)
            try:
                pose = method.ask()
                method.tell(measure(**pose))
            except KeyboardInterrupt:
                interrupted += 1
                self.assertLessEqual(line, 0, f"hangs after the interrupt at line {number - 1}")
            finally:
                sys.settrace(before)
            if pose is not None and pose not in poses:
                poses.append(pose)
            if line > 0:
                break
        watchdog.cancel()
        self.assertGreater(interrupted, 20)
        while (pose := method.ask()) is not None:
            if pose not in poses:
                poses.append(pose)
            method.tell(measure(**pose))
        self.assertEqual(method.end, "budget_spent")
        self.assertEqual(poses, poses_of(Method("cma-es", AXES, steps=300)))


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


if __name__ == "__main__":
    unittest.main()
