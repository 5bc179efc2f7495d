"""A laboratory's EPICS motors and areaDetector camera as a station of the benchmark. See README.md.

Nothing moves beyond the box of the layout. Every error, SIGTERM and the end of the process, except by SIGKILL, stop
all motors.
"""
import contextlib
import os
import random
import signal
import time

import numpy as np
from channel_access import STOP_S, AreaDetector, Channels, Motors
from genicam import GenICam
from layout import Layout, golden_image

from relign_bench.plugin import Moved, Station, parameter, serve

ENDS = (signal.SIGTERM, signal.SIGINT)
LEAST_SHARE = 1e-9  # of the travel: less is rounding, and no move


class EpicsStation(Station):
    id = "epics_station"

    layout = parameter("station.json", type="file", description="axes, box and camera: a JSON file, see README.md")
    golden_image = parameter("golden.npy", type="file",
                             description="image of a perfect lens: .npy, float32, as large as a capture, 1 for counts_at_1")
    prefix = parameter("RELIGN:", description="replaces $(P) in the layout")
    timeout_s = parameter(5.0, minimum=0.1, maximum=600.0, unit="s",
                          description="time limit for connections, answers and images")
    move_timeout_s = parameter(20.0, minimum=0.1, maximum=3600.0, unit="s", description="time limit for one move")

    connected = []  # those that the end of the process must stop
    busy = False  # in a call that talks to the machine

    def __init__(self):
        self.facts = Layout(self.layout, self.prefix)
        self.channels = self.motors = self.camera = None  # made in the first trial: `validate` needs no machine
        self.at_rest = True
        start, image = 2 * (self.move_timeout_s + self.timeout_s), self.facts.camera["exposure_s"] + 2 * self.timeout_s
        self.longest_s = max(start, image)
        limit, longest = float(os.environ.get("RELIGN_CALL_SECONDS", "60")), self.longest_s + 3 * STOP_S
        if longest >= limit:
            what, members = ("a start", "two 'move_timeout_s'") if start >= image else ("an image", "'exposure_s'")
            raise ValueError(
                f"{what} may take {longest:g} s, with {members} and two 'timeout_s', but relign-bench kills this "
                f"process after {limit:g} s, and nothing stops the motors then: raise RELIGN_CALL_SECONDS, or lower the limits"
            )

    def describe(self):
        camera = self.facts.camera
        return {
            "name": "epics_station",
            "summary": f"Motors and camera at {self.facts.axes[0].pv} ...",
            "axes": [
                {"name": axis.name, "unit": axis.unit, "lower": axis.low, "upper": axis.high} for axis in self.facts.axes
            ],
            "image": {"width": camera["width"], "height": camera["height"], "white": camera["white"]},
        }

    def reference(self):
        return golden_image(self.golden_image, self.facts.camera)

    def begin(self, seed):
        """Loads a lens where the layout has a loader, and moves to the start. Equal seeds request the same."""
        with self.stopping_at_errors():
            self.connect()
            self.motors.check_ready()
            self.camera.prepare()
            if self.facts.load:
                self.channels.put(self.facts.load, seed % 2**31, self.move_timeout_s)
            draw = random.Random(seed)
            self.motors.move_to([self.start_of(axis, draw) for axis in self.facts.axes])

    def start_of(self, axis, draw):
        width = self.facts.start_spread * (axis.high - axis.low)
        low, high = self.motors.reachable(axis)
        return min(max(axis.start + draw.uniform(-0.5, 0.5) * width, low), high)

    def connect(self):
        if self.channels:
            return
        kind = GenICam if "genicam" in self.facts.camera else AreaDetector
        names = [*Motors.names(self.facts.axes), *kind.names(self.facts.camera)]
        self.channels = Channels(names + ([self.facts.load] if self.facts.load else []), self.timeout_s)
        self.channels.deadline = self.deadline
        self.motors = Motors(self.facts.axes, self.channels, self.move_timeout_s)
        self.camera = kind(self.facts.camera, self.channels, self.timeout_s)
        for number in ENDS:
            signal.signal(number, end)
        EpicsStation.connected.append(self)

    def move_by(self, delta):
        with self.stopping_at_errors():
            began, before = time.monotonic(), self.motors.positions()
            targets, limits = [], []
            for axis, share, position in zip(self.facts.axes, delta, before):
                asked, (low, high) = position + share * (axis.high - axis.low), self.motors.reachable(axis)
                moves = abs(share) > LEAST_SHARE
                targets.append(min(max(asked, low), high) if moves else None)
                limits.append(int(asked > high) - int(asked < low) if moves else 0)
            switches = self.motors.move_to(targets)
            after, seconds = self.motors.positions(), time.monotonic() - began
        return Moved(
            moved=[
                (there - here) / (axis.high - axis.low) for axis, here, there in zip(self.facts.axes, before, after)
            ],
            machine_seconds=seconds,
            limits=[switch or limit for switch, limit in zip(switches, limits)],
        )

    def capture(self):
        with self.stopping_at_errors():
            began = time.monotonic()
            counts = self.camera.capture()
        return np.asarray(counts / self.facts.camera["counts_at_1"], np.float32), time.monotonic() - began

    @contextlib.contextmanager
    def stopping_at_errors(self):
        """Stops everything at an error, whose message then ends with what became of it."""
        self.at_rest = False
        EpicsStation.busy = True
        self.deadline = time.monotonic() + self.longest_s
        if self.channels:
            self.channels.deadline = self.deadline
        try:
            yield
        except (Exception, SystemExit) as error:
            raise RuntimeError(f"{error}; {self.stop()}") from None
        finally:
            EpicsStation.busy = False

    def stop(self):
        """Stops motors and camera. Returns a phrase for messages."""
        if not self.motors:
            return "nothing was moved"
        if self.at_rest:
            return "all motors were stopped before"
        late = self.channels.put_at_once({**self.motors.stops(), **self.camera.stops()})
        motors = [axis for axis in self.facts.axes if f"{axis.pv}.STOP" in late]
        self.at_rest = not motors
        if motors:
            return f"STOP did not reach {', '.join(map(str, motors))}: look at the machine, and stop it by hand"
        return "STOP was put to all motors"


def end(signal_number, frame):
    """Handles SIGTERM, which the process also gets when relign-bench closes the connection during a call, and SIGINT."""
    ignore_ends()
    text = f"the process was ended by {signal.Signals(signal_number).name}"
    for station in EpicsStation.connected:
        station.channels.ended = text
    if not EpicsStation.busy:  # else the call ends itself: an exception here could cut a message to the IOC in two
        raise SystemExit(text)


def ignore_ends():
    for number in ENDS:
        signal.signal(number, signal.SIG_IGN)


if __name__ == "__main__":
    try:
        serve(EpicsStation)
    finally:  # not atexit: by then the client's threads have ended
        try:
            ignore_ends()  # an exception of `end` would cut the STOP short
        finally:
            for station in EpicsStation.connected:
                station.stop()
