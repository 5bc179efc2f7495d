"""examples/epics_station: a whole trial over Channel Access, the box, and every fault, with caproto's IOC and client."""

import itertools
import json
import re
import signal
import socket
import subprocess
import sys
import time
import unittest
from unittest import mock

try:
    import caproto  # noqa: F401
except ImportError:
    raise unittest.SkipTest("caproto is not installed; ./quickstart test installs it into .python/") from None
import epics
from epics import ALL_STOPPED, SIZE, IocCase, StationCase, eventually, plugin_process

import relign_bench


class Trials(IocCase):
    def run_suite(self, **suite):
        self.write_layout()
        facts = {
            "name": "trial", "noise_levels": ["none"], "protocol": "blind", "instances": 1, "steps": 8,
            "scenes": [{"use": "./station.py", "name": "lab", "parameters": {"timeout_s": 60, "move_timeout_s": 60}}],
            "algorithms": ["nlopt-bobyqa"], **suite,
        }
        (self.folder / "suite.json").write_text(json.dumps(facts))
        host = self.run_program("run", "suite.json", "--out", "out")
        output, _ = host.communicate(timeout=5 * epics.PATIENCE_S)
        lines = [json.loads(line) for file in (self.folder / "out/trials").glob("*.jsonl")
                 for line in file.read_text().splitlines()]
        return host.returncode, output, lines

    def test_runs_a_trial_of_a_shipped_method(self):
        self.start_ioc()
        status, output, lines = self.run_suite()
        self.assertEqual(status, 0, output)
        self.assertEqual({line["end"] for line in lines if "end" in line}, {"budget_spent"})
        (trial,) = [line["trial"] for line in lines if line.get("algorithm") == "nlopt-bobyqa"]
        steps = [line for line in lines if line["trial"] == trial and "measured" in line]
        self.assertEqual(len(steps), 9)
        self.assertTrue(all(step["commanded_mse"] is None for step in steps), "a station has no ground truth")
        # The first capture is that of the instance which the loader was asked for, at its start.
        (number,) = {int(found) for found in re.findall(r"^lens (\d+)$", self.log(), re.M)}
        bench = relign_bench.Bench("relign_od", "rho0.25", size=SIZE, threads=1)
        instance = bench.instance(number)
        expected = epics.np.sqrt(epics.np.mean((instance.capture(instance.start) - bench.reference) ** 2))
        self.assertAlmostEqual(steps[0]["measured"] / expected, 1.0, delta=0.15)

    def test_fails_one_trial_when_the_ioc_dies_in_the_middle_of_a_move(self):
        self.start_ioc("--fault", "disconnect:4")
        scenes = [{"use": "./station.py", "name": "lab", "parameters": {"timeout_s": 10, "move_timeout_s": 60}}]
        status, output, lines = self.run_suite(scenes=scenes)
        self.assertEqual(status, 3, output)
        self.assertIn("the IOC dies", self.log())
        closing, after = sorted([line for line in lines if "end" in line], key=lambda line: -line["steps"])
        self.assertEqual((closing["end"], closing["steps"], after["end"]), ("failed", 4, "failed"), "four images came")
        self.assertIn("no IOC answers for", after["message"])
        self.assertRegex(closing["message"], r"the connection to RELIGN:\S+ was lost; check its IOC and the network; STOP did "
                         r"not reach RELIGN:m1 \(x\), .*: look at the machine, and stop it by hand")

    def test_names_the_records_when_no_ioc_answers(self):
        epics.np.save(self.folder / "golden.npy", epics.np.zeros((SIZE, SIZE), epics.np.float32))
        scene = [{"use": "./station.py", "name": "lab", "parameters": {"timeout_s": 1}}]
        status, output, _ = self.run_suite(scenes=scene)
        self.assertEqual(status, 3, output)
        self.assertRegex(output, r"no IOC answers for RELIGN:m1.VAL, .* and 74 more within 1 s; check the names, the IOC and "
                         r"EPICS_CA_ADDR_LIST \(now '127.0.0.1'\); nothing was moved")


class EndOfProcess(IocCase):
    def start_slow_trial(self):
        """A trial whose motors move for minutes. Returns the host and the station's process."""
        self.start_ioc("--speed", "0.0005")
        self.write_layout()
        epics.program()
        host = self.run_program("try", "random", "--scene", "./station.py", "--noise-level", "none", "--steps", "3")
        eventually(lambda: len(re.findall(r"m\d moves to -?\d+\.\d*[1-9]", self.log())) >= 5, "the first move")
        return host, plugin_process(host.pid)

    def assert_all_stop(self):
        eventually(lambda: self.log().count(" STOP at ") >= 5, "STOP of five motors")
        eventually(lambda: len(re.findall(r"^(RELIGN:m\d) rests", self.log(), re.M)) >= 5, "the rest of five motors")

    def test_normal_end_stops_all_motors(self):
        self.start_ioc()
        self.write_layout()
        host = self.run_program("try", "random", "--scene", "./station.py", "--noise-level", "none", "--steps", "1")
        output, _ = host.communicate(timeout=epics.PATIENCE_S)
        self.assertEqual(host.returncode, 0, output)
        eventually(lambda: self.log().count(" STOP at ") == 5, "STOP of five motors")

    def test_sigterm_stops_all_motors(self):
        host, station = self.start_slow_trial()
        epics.os.kill(station, signal.SIGTERM)
        self.assert_all_stop()
        output, _ = host.communicate(timeout=epics.PATIENCE_S)
        self.assertIn(f"the process was ended by SIGTERM; {ALL_STOPPED}", output)

    def test_closed_connection_stops_all_motors(self):
        """A host that lives on, but has closed the connection during a move."""
        self.start_ioc("--speed", "0.0005")
        self.write_layout()
        ours, theirs = socket.socketpair()
        number = str(theirs.fileno())
        plugin = subprocess.Popen(
            [sys.executable, "station.py"], cwd=self.folder, pass_fds=[theirs.fileno()], start_new_session=True,
            env={**epics.os.environ, "RELIGN_TO_HOST_FD": number, "RELIGN_FROM_HOST_FD": number})
        self.addCleanup(plugin.wait)
        self.addCleanup(plugin.kill)
        theirs.close()
        with ours, ours.makefile("rw") as lines:
            for request in (
                {"message": "hello", "protocols": [1], "id": "epics_station", "needs": []},
                {"message": "create", "parameters": {"layout": str(self.folder / "station.json"), "golden_image": "golden.npy",
                                                     "prefix": "RELIGN:", "timeout_s": 60.0, "move_timeout_s": 60.0}},
                {"message": "begin", "seed": 1}, {"message": "move_by", "delta": [0.1] * 5},
            ):
                print(json.dumps(request), file=lines, flush=True)
                if request["message"] != "move_by":
                    self.assertIn(json.loads(lines.readline())["message"], ("hello", "created", "ok"))
            eventually(lambda: len(re.findall(r"m\d moves to -?\d+\.\d*[1-9]", self.log())) >= 5, "the move")
        began = time.monotonic()
        self.assert_all_stop()
        self.assertLess(time.monotonic() - began, 5, "before SIGKILL")

    def test_death_of_the_benchmark_stops_all_motors(self):
        host, _ = self.start_slow_trial()
        host.kill()
        self.assert_all_stop()


class Box(StationCase):
    def test_no_move_leaves_the_box(self):
        self.start_ioc("--backlash", "0.02")  # of the travel of 2 mm: motors approach targets from below by 0.04 mm
        self.write_layout(axes={0: {"low": -0.1, "high": 0.3}, 1: {"low": 0.0, "high": 0.1}}, load=None)
        station = self.make_station()
        station.begin(1)
        for share in (5.0, -5.0, 0.3, -0.2, 1e6, -1e6):
            made = station.move_by([share, share, 0.0, 0.0, 0.0])
            if abs(share) > 1:
                self.assertEqual(made.limits, [1 if share > 0 else -1] * 2 + [0] * 3)
        extremes = self.extremes()
        for record, low, high in (("RELIGN:m1", -0.1, 0.3), ("RELIGN:m2", 0.0, 0.1)):
            self.assertGreaterEqual(extremes[record][0], low - 1e-6)
            self.assertLessEqual(extremes[record][1], high + 1e-6)
        self.assertAlmostEqual(extremes["RELIGN:m1"][1], 0.3, places=5)
        self.assertAlmostEqual(extremes["RELIGN:m1"][0], -0.1, places=5)  # beyond the lowest target, by the backlash

    def test_refuses_a_target_outside_the_box(self):
        self.start_ioc()
        self.write_layout()
        station = self.make_station()
        station.begin(1)
        before = self.moves()
        for bad in (1.1, -1.1, float("nan")):
            self.assert_fails(lambda bad=bad: station.motors.move_to([0.5, bad, None, None, None]), "RELIGN:m2 (y)", "outside")
        self.assertEqual(self.moves(), before, "nothing moves, not even the axes before it")

    def test_reports_a_limit_switch_and_how_far_the_motor_came(self):
        self.start_ioc()
        self.write_layout()
        station = self.make_station()
        station.begin(3)
        start = relign_bench.Bench("relign_od", "rho0.25", size=SIZE, threads=1).instance(3).start
        made = station.move_by([0.0, 0.0, 0.0, -0.4, 0.0])
        self.assertLess(start[3], 0.4, "the lens of this number is close to the end of this axis")
        self.assertEqual(made.limits, [0, 0, 0, -1, 0])
        self.assertAlmostEqual(made.moved[3], -start[3], places=6)

    def test_equal_seeds_start_at_the_same_pose_of_the_box(self):
        self.start_ioc()
        self.write_layout(axes={0: {"low": -0.1, "high": 0.3}, 3: {"low": -0.05, "high": 0.05}}, start_spread=0.5)
        station, poses = self.make_station(), []
        for seed in (5, 6, 5):
            station.begin(seed)
            poses.append(station.motors.positions())
        epics.np.testing.assert_allclose(poses[0], poses[2], atol=1e-6)
        self.assertGreater(abs(poses[0][0] - poses[1][0]), 1e-4)
        self.assertTrue(all(-1e-6 <= pose[0] <= 0.2 + 1e-6 for pose in poses), "the middle half of the box")


class Refusals(StationCase):
    def test_refuses_what_could_leave_the_box_before_anything_moves(self):
        self.start_ioc()
        self.write_layout()
        self.write_layout("metres.json", axes={2: {"unit": "m"}})
        self.write_layout("narrow.json", axes={0: {"low": 0.5, "high": 0.9}})
        self.write_layout("wide.json", axes={4: {"high": 20.0}})
        cases = (
            ("metres.json", None, "RELIGN:m3 (z) has the unit 'mm' (EGU), the layout says 'm'"),
            ("narrow.json", None, "RELIGN:m1 (x) is at 0 mm, outside the box of 0.5 to 0.9; move it into the box by hand"),
            ("wide.json", None, "the box of RELIGN:m5 (ry), -7 to 20, leaves the motor's soft limits, -14 to 14"),
            ("station.json", ("RELIGN:m2.HLM", 0.5), "the box of RELIGN:m2 (y), -1 to 1, leaves the motor's soft limits, -2"),
            ("station.json", ("RELIGN:m1.SET", 1), "RELIGN:m1 (x) is in set mode: a put would redefine its position"),
            ("station.json", ("RELIGN:m4.SPMG", 0), "RELIGN:m4 (rx) is halted by RELIGN:m4.SPMG; put 3 (Go)"),
            ("station.json", ("RELIGN:m1.BDST", 3), "the backlash of RELIGN:m1 (x), 3, is larger than its box"),
        )
        for layout, put, phrase in cases:
            with self.subTest(phrase=phrase):
                if put:
                    before = self.channel(put[0])
                    self.channel(*put)
                station = self.make_station(layout=str(self.folder / layout))
                self.assert_fails(lambda station=station: station.begin(1), phrase, ALL_STOPPED)
                if put:
                    self.channel(put[0], before)
        self.assertEqual(self.moves(), 0)
        self.make_station().begin(1)
        self.assertEqual(self.moves(), 5)

    def test_refuses_images_of_another_size(self):
        self.start_ioc()
        self.write_layout(camera={"width": SIZE + 1})
        station = self.make_station()
        station.begin(1)
        self.assert_fails(station.capture, f"RELIGN:image1: has images of {SIZE} x {SIZE}, the layout says {SIZE + 1} x {SIZE}")
        with self.assertRaisesRegex(ValueError, rf"golden.npy has float32 values of shape \({SIZE}, {SIZE}\), expected"):
            station.reference()

    def test_refuses_time_limits_beyond_the_benchmarks(self):
        self.write_layout()
        with mock.patch.dict("os.environ", {"RELIGN_CALL_SECONDS": "60"}):
            with self.assertRaisesRegex(ValueError, "raise RELIGN_CALL_SECONDS, or lower the limits"):
                self.make_station(move_timeout_s=30.0)
            self.write_layout(camera={"exposure_s": 100})
            with self.assertRaisesRegex(ValueError, "an image may take 1[0-9]* s, with 'exposure_s' and two 'timeout_s'"):
                self.make_station(move_timeout_s=10.0, timeout_s=5.0)

    def test_refuses_a_golden_image_that_is_not_finite(self):
        self.write_layout()
        image = epics.np.zeros((SIZE, SIZE), epics.np.float32)
        image[1, 2] = float("nan")
        epics.np.save(self.folder / "golden.npy", image)
        with self.assertRaisesRegex(ValueError, "golden.npy has pixels without a finite value"):
            self.make_station().reference()

    def test_explains_mistakes_in_the_layout(self):
        cases = (
            ({"axes": {0: {"low": 2.0}}}, "axis 1: 'low' is 2 and must be below 'high', 1"),
            ({"axes": {1: {"hihg": 2.0}}}, "axis 2: unknown key 'hihg'; keys: name, pv, unit, low, high, tolerance, start"),
            ({"axes": {1: {"high": "1"}}}, "axis 2: 'high' is '1', expected float"),
            ({"axes": {1: {"start": 1.5}}}, "axis 2: 'start' is 1.5 and must be in the box of -1 to 1"),
            ({"axes": {1: {"tolerance": 0}}}, "axis 2: 'tolerance' is 0 and must be positive"),
            ({"axes": {1: {"tolerance": 1e9}}}, "axis 2: 'tolerance' is 1e+09 and must be less than the box's width, 2"),
            ({"axes": {1: {"tolerance": "1"}}}, "axis 2: 'tolerance' is '1', expected float"),
            ({"axes": {4: {"pv": "$(P)m4"}}}, "axis 'rx' and axis 'ry' have the same record, 'RELIGN:m4'"),
            ({"axes": {4: {"pv": "RELIGN:m4.VAL"}}}, "axis 'rx' and axis 'ry' have the same record, 'RELIGN:m4'"),
            ({"axes": {4: {"pv": ""}}}, "axis 5: 'pv' is empty"),
            ({"camera": {"image": " "}}, "camera: 'image' is empty"),
            ({"load": "$(P)m1"}, "axis 'x' and 'load' have the same record, 'RELIGN:m1'"),
            ({"camera": {"exposure_s": -1}}, "camera: 'exposure_s' is -1 and must be positive"),
            ({"camera": {"exposure_s": 0}}, "camera: 'exposure_s' is 0 and must be positive"),
            ({"camera": {"counts_at_1": -100}}, "camera: 'counts_at_1' is -100 and must be positive"),
            ({"camera": {"counts_at_1": 0}}, "camera: 'counts_at_1' is 0 and must be positive"),
            ({"camera": {"white": None}}, "camera: 'white' is None, expected float"),
            ({"camera": {"exposure": 1}}, "camera: unknown key 'exposure'"),
            ({"start_spread": 2}, "'start_spread' is 2 and must be from 0 to 1"),
        )
        for changes, phrase in cases:
            with self.subTest(phrase=phrase), self.assertRaises(ValueError) as caught:
                self.write_layout(**changes)
                self.make_station()
            self.assertIn(phrase, str(caught.exception))
            self.assertIn("station.json", str(caught.exception))


class Faults(StationCase):
    def begin(self, *options, **parameters):
        self.start_ioc(*options)
        self.write_layout()
        station = self.make_station(**parameters)
        station.begin(1)
        station.capture()
        return station

    def stops(self):
        return sorted(re.findall(r"^RELIGN:(m\d) STOP at", self.log(), re.M))

    def test_stuck_motor(self):
        station = self.begin("--fault", "stuck:1", move_timeout_s=5.0)
        message = self.assert_fails(
            lambda: station.move_by([0.05, 0.05, 0, 0, 0]), "RELIGN:m1 (x) did not reach 0.1 mm within 5 s and is at 0; check "
            "its drive and amplifier, or raise 'move_timeout_s'", ALL_STOPPED)
        self.assertNotIn("m2", message)
        self.assertEqual(self.stops(), ["m1", "m2", "m3", "m4", "m5"])
        eventually(lambda: self.channel("RELIGN:m1.DMOV") == 1, "the end of the move")

    def test_motor_at_its_target_whose_record_reports_no_end(self):
        station = self.begin(move_timeout_s=4.0)
        number = station.channels.number
        station.channels.number = lambda name, **how: 0.0 if name == "RELIGN:m1.DMOV" else number(name, **how)
        self.assert_fails(lambda: station.move_by([0.05, 0, 0, 0, 0]), "RELIGN:m1 (x) is at its target, 0.1 mm, but its record "
                          "did not report the end of the move (DMOV) within 4 s; check its IOC", ALL_STOPPED)

    def test_readback_that_disagrees(self):
        station = self.begin("--fault", "readback:1")
        self.assert_fails(lambda: station.move_by([0.05, 0, 0, 0, 0]), "RELIGN:m1 (x) was sent to 0.1 mm and reads 0.14, off "
                          "by more than 0.002; check its encoder and drive", ALL_STOPPED)
        self.assertEqual(self.stops(), ["m1", "m2", "m3", "m4", "m5"])

    def test_readback_that_is_no_number_or_an_old_one(self):
        for fault, phrase in (("nan", "RELIGN:m1.RBV has no finite value; check its encoder"),
                              ("alarm", "RELIGN:m1.RBV has the alarm severity INVALID; check its controller")):
            with self.subTest(fault=fault):
                station = self.begin("--fault", f"{fault}:1")
                message = self.assert_fails(lambda made=station: made.move_by([0.05, 0, 0, 0, 0]), phrase, ALL_STOPPED)
                self.assertNotRegex(message, r"\bnan\b")
                self.end_ioc()

    def test_another_client_stops_a_motor(self):
        station = self.begin()
        self.channel("RELIGN:m1.VELO", 0.001)
        start = station.channels.start

        def start_and_stop(name, value, limit_s):
            done = start(name, value, limit_s)
            self.channel("RELIGN:m1.STOP", 1)
            return done

        station.channels.start = start_and_stop
        self.assert_fails(lambda: station.move_by([0.2, 0, 0, 0, 0]), "RELIGN:m1 (x) was sent to 0.4 mm and reads ",
                          "whether another client stopped it", ALL_STOPPED)

    def test_ioc_that_does_not_answer(self):
        station = self.begin("--fault", "silent:1", timeout_s=4.0, move_timeout_s=4.0)
        self.assert_fails(lambda: station.move_by([0.05, 0, 0, 0, 0]), "did not answer within 4 s; check its IOC and the "
                          "network", "STOP did not reach RELIGN:m1 (x), ")

    def test_ioc_that_answers_too_slowly(self):
        station = self.begin("--fault", "slow:1")
        station.longest_s = 4.0
        self.assert_fails(lambda: station.move_by([0.05, 0.05, 0.05, 0.05, 0.05]), "the IOC answers too slowly for the time "
                          "limits; check its load and the network; ")
        eventually(lambda: self.stops() == ["m1", "m2", "m3", "m4", "m5"], "STOP of five motors")

    def test_stops_motors_over_a_new_connection_where_the_old_one_is_lost(self):
        station = self.begin()
        for axis in "12345":
            self.channel(f"RELIGN:m{axis}.VELO", 0.001)
        start = station.channels.start

        def start_and_lose(name, value, limit_s):
            done = start(name, value, limit_s)
            if name == "RELIGN:m5.VAL":
                eventually(lambda: self.moves() == 10, "the moves of five motors")
                station.channels.pvs[name].circuit_manager.disconnect()
            return done

        station.channels.start = start_and_lose
        self.assert_fails(lambda: station.move_by([0.2] * 5), "was lost", ALL_STOPPED)
        self.assertEqual(self.stops(), ["m1", "m2", "m3", "m4", "m5"])

    def test_sigterm_and_sigint_in_a_call_end_it_between_messages(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            with self.subTest(number=number):
                station = self.begin()
                self.channel("RELIGN:m1.VELO", 0.001)
                start = station.channels.start

                def start_and_end(name, value, limit_s, start=start, number=number):
                    done = start(name, value, limit_s)
                    epics.os.kill(epics.os.getpid(), number)
                    return done

                station.channels.start = start_and_end
                self.assert_fails(lambda made=station: made.move_by([0.2, 0, 0, 0, 0]),
                                  f"the process was ended by {number.name}", ALL_STOPPED)
                self.end_ioc()
                self.module.EpicsStation.connected.clear()

    def test_lost_connection(self):
        station = self.begin("--fault", "disconnect:1")
        self.assert_fails(lambda: station.move_by([0.05, 0, 0, 0, 0]), "the connection to RELIGN:", "was lost; check its IOC",
                          "STOP did not reach RELIGN:m1 (x), ")

    def test_connection_that_comes_back_counts_as_lost(self):
        station = self.begin()
        self.end_ioc()
        eventually(lambda: station.channels.lost, "the loss of the connection")
        self.start_ioc()
        self.assert_fails(lambda: station.move_by([0.05, 0, 0, 0, 0]), "was lost")  # whether or not it is back yet
        self.assertEqual(self.moves(), 0, "the new IOC may be another machine, or the same at another place")

    def test_camera_without_image(self):
        station = self.begin("--fault", "no-image:1", timeout_s=4.0)
        self.assert_fails(station.capture, "no image arrived within 4.01 s after RELIGN:cam1:Acquire: "
                          "RELIGN:image1:ArrayCounter_RBV stays at 1; check the camera's trigger", ALL_STOPPED)

    def test_camera_with_another_pixel_type(self):
        station = self.begin()
        self.channel("RELIGN:cam1:DataType", 0)
        self.assert_fails(station.capture,
                          "RELIGN:image1: has pixels of type UInt8, which end at 255, and 'counts_at_1' is 65535")

    def test_every_capture_is_a_new_image(self):
        station = self.begin()
        images = [station.capture()[0] for _ in range(4)]
        for one, other in itertools.combinations(images, 2):
            self.assertFalse(epics.np.array_equal(one, other))
        reference = station.reference()
        self.assertLess(epics.np.abs(images[0] - reference).max(), 1.0)


del StationCase, IocCase  # the bases have no tests

if __name__ == "__main__":
    unittest.main()
