"""The soft IOC of examples/epics_station on free ports of the loopback, for the tests of the examples around it."""

import contextlib
import importlib
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

from support import np

from relign_bench.plugin.parameters import create

ALL_STOPPED = "STOP was put to all motors"
EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "examples" / "epics_station"
SIZE = 40
PATIENCE_S = 120  # for everything that must happen, on a slow and busy machine
LIMITS = {"RELIGN_CALL_SECONDS": "600", "RELIGN_HANDSHAKE_SECONDS": "300", "RELIGN_PYTHON": sys.executable}


def program():
    """Path of relign-bench."""
    found = os.environ.get("RELIGN_PROGRAM") or shutil.which("relign-bench")
    if not found:
        raise unittest.SkipTest("the program relign-bench is not installed: set RELIGN_PROGRAM")
    return found


def free_port():
    """A port that is free for TCP and UDP."""
    for _ in range(100):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as tcp, \
                socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            tcp.bind(("127.0.0.1", 0))
            with contextlib.suppress(OSError):
                udp.bind(("127.0.0.1", tcp.getsockname()[1]))
                return tcp.getsockname()[1]
    raise AssertionError("no port is free for TCP and UDP")


def eventually(condition, what):
    """Waits until a condition holds."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError(f"{what} did not happen within {PATIENCE_S} s")


class IocCase(unittest.TestCase):
    """A test with a folder, a copy of the example in it, and ports of its own."""

    def setUp(self):
        super().setUp()
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        for file in EXAMPLE.glob("*.py"):
            shutil.copy(file, self.folder)
        self.environment = {
            "EPICS_CA_SERVER_PORT": str(free_port()), "EPICS_CA_REPEATER_PORT": str(free_port()),
            "EPICS_CA_ADDR_LIST": "127.0.0.1", "EPICS_CA_AUTO_ADDR_LIST": "NO", **LIMITS,
        }
        before = {name: os.environ.get(name) for name in self.environment}
        os.environ.update(self.environment)
        self.addCleanup(self.restore, before)
        self.ioc = self.other = None

    @staticmethod
    def restore(before):
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value

    def start_ioc(self, *options):
        """Starts the IOC; it ends with the test."""
        self.log_file = self.folder / "ioc.log"
        with open(self.log_file, "w") as log:
            self.ioc = subprocess.Popen(
                [sys.executable, "ioc.py", "--size", str(SIZE), "--golden", "golden.npy", *options], cwd=self.folder,
                stdout=log, stderr=subprocess.STDOUT)
        self.addCleanup(self.end_ioc)
        eventually(lambda: "serving" in self.log() or self.ioc.poll() is not None, "the start of the IOC")
        self.assertIn("serving", self.log())

    def end_ioc(self):
        self.ioc.kill()  # also ends a stopped process
        self.ioc.wait()

    def log(self):
        """What the IOC has printed."""
        return self.log_file.read_text()

    def write_layout(self, name="station.json", **changes):
        """The example's layout for the small sensor. An axis's keys change by `axes={0: {...}}`. Returns the path."""
        facts = json.loads((EXAMPLE / "station.json").read_text())
        facts["camera"].update({"width": SIZE, "height": SIZE, **changes.pop("camera", {})})
        for number, keys in changes.pop("axes", {}).items():
            facts["axes"][number].update(keys)
        facts.update(changes)
        path = self.folder / name
        path.write_text(json.dumps(facts))
        return str(path)

    def channel(self, name, value=None):
        """Writes a record from another client, if a value is given, and returns its value."""
        from caproto.threading.client import Context

        if self.other is None:
            self.other = Context()
            self.addCleanup(self.other.disconnect)
        (record,) = self.other.get_pvs(name, timeout=PATIENCE_S)
        if value is not None:
            record.write(value, timeout=PATIENCE_S)
        return record.read(timeout=PATIENCE_S).data[0]

    def extremes(self):
        """The lowest and highest position of each motor so far, by record."""
        found = {}
        for name, low, high in re.findall(r"^(\S+) rests at \S+, was between (\S+) and (\S+)$", self.log(), re.M):
            before = found.get(name, (0.0, 0.0))
            found[name] = min(before[0], float(low)), max(before[1], float(high))
        return found

    def run_program(self, *arguments, **keywords):
        """Starts relign-bench; it ends with the test."""
        started = subprocess.Popen([program(), *arguments], cwd=self.folder, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True, **keywords)
        self.addCleanup(started.wait)
        self.addCleanup(started.stdout.close)
        self.addCleanup(started.kill)
        return started


class StationCase(IocCase):
    """A test with the station's class in this process."""

    def setUp(self):
        super().setUp()
        path = mock.patch.object(sys, "path", [str(self.folder), *sys.path])
        modules = ("station", "channel_access", "genicam", "layout")
        path.start()
        self.addCleanup(path.stop)
        for name in modules:
            sys.modules.pop(name, None)
            self.addCleanup(sys.modules.pop, name, None)
        before = signal.getsignal(signal.SIGTERM)
        self.addCleanup(signal.signal, signal.SIGTERM, before)
        self.module = importlib.import_module("station")

    def make_station(self, **parameters):
        made = create(self.module.EpicsStation, {
            "layout": str(self.folder / "station.json"), "golden_image": str(self.folder / "golden.npy"), "timeout_s": 60.0,
            "move_timeout_s": 60.0, **parameters})
        self.addCleanup(lambda: made.channels and made.channels.context.disconnect())
        return made

    def moves(self):
        """How often a motor has begun to move."""
        return self.log().count(" moves to ")

    def assert_fails(self, act, *phrases):
        """The message of an action that must fail, in one sentence."""
        with self.assertRaises(RuntimeError) as caught:
            act()
        message = str(caught.exception)
        for phrase in phrases:
            self.assertIn(phrase, message)
        self.assertNotIn("\n", message)
        return message


def plugin_process(host):
    """Process id of the station below a process, or None."""
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, ValueError):
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == host and b"station.py" in (folder / "cmdline").read_bytes():
                return int(folder.name)
    return None


__all__ = ["ALL_STOPPED", "IocCase", "PATIENCE_S", "SIZE", "StationCase", "eventually", "np", "plugin_process",
           "program", "signal"]
