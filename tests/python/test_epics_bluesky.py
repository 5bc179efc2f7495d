"""examples/epics_station: a Bluesky plan with a method of ours, and blop's agent, over ophyd before caproto's IOC."""

import importlib.util
import json
import re
import signal
import subprocess
import sys
import unittest

import epics
from epics import SIZE, IocCase, eventually

import relign_bench

for package in ("caproto", "ophyd", "bluesky"):
    if not importlib.util.find_spec(package):
        raise unittest.SkipTest(f"{package} is not installed; ./quickstart test --others installs it into .python/")

PAUSED = """
import threading
from bluesky.utils import RunEngineInterrupted
engine, events = RunEngine(), []
engine.subscribe(lambda name, document: events.append(document), "event")
engine.subscribe(lambda name, document: threading.Thread(target=engine.request_pause).start(), "descriptor")
try:
    engine(align(method, motors, [camera], "camera_error"))
except RunEngineInterrupted:
    print("was paused")
while engine.state == "paused":
    try:
        engine.resume()
    except RunEngineInterrupted:
        pass
print("events:", len(events))
"""
SETPOINTS = """
from bluesky import RunEngine, plan_stubs
from ophyd_devices import connect
motors, _, box = connect("station.json", "golden.npy", "RELIGN:", 60.0, 60.0)
setpoint = motors[0].user_setpoint
for act in (lambda: setpoint.put(0.4), lambda: RunEngine()(plan_stubs.abs_set(setpoint, 0.4, wait=True))):
    try:
        act()
    except Exception as error:
        print("refused:", type(error).__name__, error)
for target in ("abc", None, [0.1], 0.1j, float("nan")):
    for act in (motors[0].set, motors[0].user_setpoint.put, lambda target: motors[0].user_setpoint.set(target).wait(60)):
        try:
            act(target)
        except Exception as error:
            print("target:", type(error).__name__, error)
motors[1].user_setpoint.set(0.2).wait(60)
"""
LOST = """
import time
from ophyd_devices import connect
motor = connect("station.json", "golden.npy", "RELIGN:", 60.0, 60.0)[0][0]
motor.stage()
print("staged", flush=True)
while motor.connected:
    time.sleep(0.02)
print("lost", flush=True)
motor.wait_for_connection(timeout=60)
for act in (motor.set, motor.user_setpoint.put, lambda target: motor.user_setpoint.set(target).wait(60)):
    try:
        act(0.1)
    except Exception as error:
        print("refused:", type(error).__name__, error)
motor.unstage()
motor.stage()
motor.set(0.2).wait(60)
motor.user_setpoint.put(0.3)
"""
STUCK = (r"RELIGN:m1 \(x\) did not reach \S+ mm within 10 s and is at \S+; "
         "check its drive and amplifier, or raise 'move_timeout_s'")
STOPS = ["m1", "m2", "m3", "m4", "m5"]


class PlanCase(IocCase):
    def setUp(self):
        super().setUp()
        self.environment = {"OPHYD_CONTROL_LAYER": "caproto", "OMP_NUM_THREADS": "1"}
        before = {name: epics.os.environ.get(name) for name in self.environment}
        epics.os.environ.update(self.environment)
        self.addCleanup(self.restore, before)

    def start_script(self, name, *arguments):
        """Starts a program of the example; it ends with the test."""
        started = subprocess.Popen([sys.executable, name, "--timeout", "60", *arguments], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for ending in (started.wait, started.stdout.close, started.kill):
            self.addCleanup(ending)
        return started

    def run_script(self, name, *arguments):
        """(exit status, output) of a program."""
        started = self.start_script(name, *arguments)
        output, _ = started.communicate(timeout=5 * epics.PATIENCE_S)
        return started.returncode, output

    def align(self, *arguments):
        return self.run_script("bluesky_align.py", "nlopt-sbplx", "--steps", "6", "--documents", "documents.jsonl", *arguments)

    def documents(self, kind):
        lines = [json.loads(line) for line in (self.folder / "documents.jsonl").read_text().splitlines()]
        return [document for name, document in lines if name == kind]

    def stops(self):
        return sorted(set(re.findall(r"^RELIGN:(m\d) STOP at", self.log(), re.M)))


class Plan(PlanCase):
    def test_aligns_within_the_box_and_records_events(self):
        self.start_ioc()
        self.write_layout(axes={0: {"low": -0.1, "high": 0.3}, 3: {"low": -1, "high": 1}})
        status, output = self.align()
        self.assertEqual(status, 0, output)
        (start,), (stop,), streams = (self.documents(kind) for kind in ("start", "stop", "descriptor"))
        self.assertEqual((start["algorithm"], start["motors"]), ("nlopt-sbplx", ["x", "y", "z", "rx", "ry"]))
        self.assertEqual((stop["exit_status"], stop["num_events"]), ("success", {"primary": 7, "recommended": 1}))
        names, events = {stream["uid"]: stream["name"] for stream in streams}, self.documents("event")
        self.assertEqual([names[event["descriptor"]] for event in events], ["primary"] * 7 + ["recommended"])
        golden = epics.np.load(self.folder / "golden.npy")
        for event in events:
            image = epics.np.array(event["data"]["camera_image"])
            self.assertEqual(image.shape, (SIZE, SIZE))
            self.assertAlmostEqual(event["data"]["camera_error"], epics.np.sqrt(epics.np.mean((image - golden) ** 2)), places=6)
        best = min(events[:7], key=lambda event: event["data"]["camera_error"])["data"]
        self.assertIn(f"best: {best['camera_error']:.6f} at x {best['x_user_setpoint']:.4f}", output)
        self.assertGreater(len({event["data"]["x"] for event in events}), 1)
        extremes = self.extremes()
        for record, low, high in (("RELIGN:m1", -0.1, 0.3), ("RELIGN:m4", -1, 1)):
            self.assertGreaterEqual(extremes[record][0], low - 1e-6)
            self.assertLessEqual(extremes[record][1], high + 1e-6)

    def test_the_readme_session_survives_a_pause(self):
        self.start_ioc("--speed", "0.5")
        self.write_layout()
        code = re.search(r"```python\n(.*?)```", (epics.EXAMPLE / "README.md").read_text(), re.DOTALL).group(1)
        run = 'RunEngine()(align(method, motors, [camera], "camera_error"))'
        self.assertIn(run, code)
        code = code.replace('"RELIGN:")', '"RELIGN:", 60.0, 60.0)').replace("steps=30", "steps=3").replace(run, PAUSED)
        (self.folder / "session.py").write_text(code)
        status, output = self.run_script("session.py")
        self.assertEqual(status, 0, output)
        self.assertIn("was paused\n", output)
        self.assertIn("events: 5\n({'x': ", output, "no pose is missing, and none is there twice")
        self.assertEqual(self.stops(), STOPS)

    def test_refuses_before_anything_moves(self):
        self.start_ioc()
        self.write_layout(axes={4: {"high": 20.0}})
        status, output = self.align()
        self.assertEqual(status, 1, output)
        self.assertIn("the plan failed: the box of RELIGN:m5 (ry), -7 to 20, leaves the motor's soft limits, -14 to 14", output)
        self.assertNotIn(" moves to ", self.log())

    def test_a_setpoint_that_a_plan_sets_keeps_the_box(self):
        self.start_ioc()
        self.write_layout(axes={0: {"low": -0.1, "high": 0.3}})
        (self.folder / "session.py").write_text(SETPOINTS)
        status, output = self.run_script("session.py")
        self.assertEqual(status, 0, output)
        self.assertIn("refused: LimitError RELIGN:m1 (x) must not move to 0.4 mm: outside -0.1 to 0.3", output)
        self.assertIn("refused: FailedStatus", output)
        for target in ("'abc'", "None", "[0.1]", "0.1j"):
            self.assertEqual(output.count(f"target: TypeError RELIGN:m1 (x) takes a number in mm, not {target}\n"), 3, output)
        self.assertEqual(len(re.findall("target: LimitError .*nan", output)), 3, output)
        self.assertNotIn("m1 moves to ", self.log())
        self.assertAlmostEqual(self.channel("RELIGN:m2.RBV"), 0.2, places=3)

    def test_after_a_lost_connection_nothing_moves_until_staged_again(self):
        self.start_ioc()
        self.write_layout()
        (self.folder / "session.py").write_text(LOST)
        session = self.start_script("session.py")
        self.assertIn("staged\n", iter(session.stdout.readline, ""))
        self.end_ioc()
        self.assertIn("lost\n", iter(session.stdout.readline, ""))
        self.start_ioc()
        output, _ = session.communicate(timeout=5 * epics.PATIENCE_S)
        self.assertEqual(session.returncode, 0, output)
        refused = ("refused: RuntimeError the connection to RELIGN:m1 (x) was lost since it was staged; "
                   "look at the machine first\n")
        self.assertEqual(output.count(refused), 3, output)
        eventually(lambda: "m1 moves to 0.3" in self.log(), "the last move")
        self.assertEqual(re.findall(r"m1 moves to (\S+)", self.log()), ["0.200000", "0.300000"])

    def test_faults_end_the_plan_with_all_motors_stopped(self):
        cases = (
            ("stuck:2", STUCK, STOPS), ("readback:2", r"RELIGN:m1 \(x\) was sent to ", STOPS),
            ("no-image:2", "the exposure ended without an image in RELIGN:image1:", STOPS),
            ("disconnect:2", "the connection to RELIGN:m", []),
        )
        for fault, phrase, stops in cases:
            with self.subTest(fault=fault):
                self.start_ioc("--fault", fault)
                self.write_layout()
                status, output = self.align("--move-timeout", "10")
                self.assertEqual(status, 1, output)
                self.assertRegex(output.rpartition("the plan failed: ")[2], phrase, output)
                self.assertEqual(self.documents("stop")[-1]["exit_status"], "fail")
                self.assertEqual(self.stops(), stops)
                if stops:
                    eventually(lambda: all(self.channel(f"RELIGN:{motor}.DMOV") == 1 for motor in STOPS), "the rest of motors")
                    self.other.disconnect()
                    self.other = None
                self.end_ioc()

    def test_ctrl_c_and_sigterm_stop_motors_in_the_middle_of_a_move(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(signal=number):
                self.start_ioc("--speed", "0.0005")
                self.write_layout()
                plan = self.start_script("bluesky_align.py", "random", "--move-timeout", "600",
                                         "--documents", "documents.jsonl")
                eventually(lambda: len(re.findall(r"m\d moves to -?\d+\.\d*[1-9]", self.log())) >= 5, "the first move")
                plan.send_signal(number)
                output, _ = plan.communicate(timeout=epics.PATIENCE_S)
                self.assertEqual(plan.returncode, 1, output)
                self.assertIn("the plan was aborted, and the motors were stopped", output)
                self.assertEqual((self.documents("stop")[-1]["exit_status"], self.stops()), ("abort", STOPS))
                eventually(lambda: len(re.findall(r"^RELIGN:m\d rests", self.log(), re.M)) >= 10, "the rest of five motors")
                self.end_ioc()

    def test_names_the_records_when_no_ioc_answers(self):
        epics.np.save(self.folder / "golden.npy", epics.np.zeros((SIZE, SIZE), epics.np.float32))
        self.write_layout()
        status, output = self.align("--timeout", "1")
        self.assertEqual(status, 1, output)
        self.assertRegex(output, r"no IOC answers for all records within 1 s; check the names, the IOC and EPICS_CA_ADDR_LIST "
                         r"\(now '127.0.0.1'\): .*RELIGN:m1.RBV.*; nothing was moved")


@unittest.skipUnless(importlib.util.find_spec("blop"), "blop is not installed; ./quickstart test --others installs it")
class Blop(PlanCase):
    def test_an_agent_aligns_two_axes(self):
        self.start_ioc()
        self.write_layout()
        layout = self.folder / "station.json"
        facts = json.loads(layout.read_text())
        layout.write_text(json.dumps({**facts, "axes": facts["axes"][:2]}))
        status, output = self.run_script("blop_align.py", "--steps", "7")
        self.assertEqual(status, 0, output)
        self.assertIn("using GenerationNode MBM", output, "the surrogate model, not only its initial design")
        error, x, y = map(float, re.search(r"^best: (\S+) at x (\S+), y (\S+)$", output, re.M).groups())
        bench = relign_bench.Bench("relign_od", "rho0.25", size=SIZE, threads=1)
        instance = bench.instance(0)
        start = epics.np.sqrt(epics.np.mean((instance.capture(instance.start) - bench.reference) ** 2))
        self.assertLess(error, 0.95 * start)
        for record in ("RELIGN:m1", "RELIGN:m2"):
            low, high = self.extremes()[record]
            self.assertTrue(-1 <= low <= high <= 1)
        self.assertAlmostEqual(self.channel("RELIGN:m2.RBV"), y, places=3)


del PlanCase, IocCase  # the bases have no tests

if __name__ == "__main__":
    unittest.main()
