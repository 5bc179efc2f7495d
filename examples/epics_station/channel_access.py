"""Motor records, an areaDetector camera and single records over Channel Access.

The client is caproto's: pure Python, 4 MB, without a compiled libca, and the same package as the soft IOC's. Every error
is one sentence that names the record.
"""
import contextlib
import math
import os
import threading
import time

import numpy as np
from caproto import AccessRights, AlarmSeverity, CaprotoError, ChannelType
from caproto.threading.client import Context

POLL_S = 0.01
STOP_S = 2.0  # within which all motors must confirm a STOP
FIELDS = ("VAL", "RBV", "DMOV", "STOP", "HLM", "LLM", "HLS", "LLS", "LVIO", "EGU", "SET", "SPMG", "BDST")
UNSIGNED = {"UInt8": 0xFF, "UInt16": 0xFFFF, "UInt32": 0xFFFFFFFF}
FAILURES = (CaprotoError, OSError, TimeoutError)


class Channels:
    """Connections to records by name. A connection that is lost once counts as lost, even if it comes back.

    Args:
        names: Names of the records.
        timeout_s: Time limit for the first connection, and for each answer.

    Raises:
        RuntimeError: Some records do not answer.
    """

    def __init__(self, names, timeout_s):
        self.timeout_s = timeout_s
        self.lost = []
        self.deadline, self.ended = float("inf"), ""
        self.parent = os.getppid()
        self.context = Context()
        pvs = self.context.get_pvs(*names, timeout=timeout_s, connection_state_callback=self._changed)
        self.pvs = dict(zip(names, pvs))
        deadline = time.monotonic() + timeout_s
        missing = [name for name, pv in self.pvs.items() if not self._connects(pv, deadline)]
        if missing:
            hidden = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
            raise RuntimeError(
                f"no IOC answers for {', '.join(missing[:3])}{hidden} within {timeout_s:g} s; check the names, the IOC and "
                f"EPICS_CA_ADDR_LIST (now '{os.environ.get('EPICS_CA_ADDR_LIST', '')}')"
            )

    @staticmethod
    def _connects(pv, deadline):
        try:
            pv.wait_for_connection(timeout=max(0.01, deadline - time.monotonic()))
        except FAILURES:
            return False
        return True

    def _changed(self, pv, state):
        if state == "disconnected":
            self.lost.append(pv.name)

    def check(self):
        """Raises an error where a connection or the benchmark is gone, or the time of this call is up."""
        gone = self.lost or [name for name, pv in self.pvs.items() if not pv.connected]
        if gone:
            raise RuntimeError(f"the connection to {gone[0]} was lost; check its IOC and the network")
        if os.getppid() != self.parent:
            raise RuntimeError("relign-bench has ended; this process does so, too")
        if self.ended:
            raise RuntimeError(self.ended)
        if time.monotonic() > self.deadline:
            raise RuntimeError("the IOC answers too slowly for the time limits; check its load and the network")

    def response(self, name, **how):
        """The answer of a record, with data and metadata."""
        answers = []
        done = self._begin(name, "read", answers.append, timeout=self.timeout_s, **how)
        if self.wait({name: done}, time.monotonic() + self.timeout_s):
            raise RuntimeError(f"{name} did not answer within {self.timeout_s:g} s; check its IOC and the network")
        return answers[0]

    def read(self, name, **how):
        """The values of a record: an array or a list."""
        return self.response(name, **how).data

    def number(self, name, alarms=False):
        """The value of a record as a float; with `alarms` the record must not have the severity INVALID."""
        answer = self.response(name, data_type="time")
        return finite(name, answer.data[0], answer.metadata.severity if alarms else 0)

    def text(self, name):
        """The value of a record as a text; the label of an enumeration."""
        return bytes(self.read(name, data_type=ChannelType.STRING)[0]).split(b"\0")[0].decode("latin-1").strip()

    def start(self, name, value, limit_s):
        """Puts a value. Returns an event that is set once the record has finished what the put started, within a limit."""
        self.check()
        if AccessRights.WRITE not in self.pvs[name].access_rights:
            raise RuntimeError(f"{name} is read-only for this user and machine; ask for write access (EPICS access security)")
        return self._begin(name, "write", lambda response: None, value, timeout=limit_s)

    def _begin(self, name, verb, take, *values, **how):
        """Sends a request, and returns an event that is set after `take` has got the response."""
        self.check()
        done = threading.Event()

        def receive(response):
            take(response)
            done.set()

        done.receive = receive  # kept here, because the client may hold callbacks weakly
        try:
            getattr(self.pvs[name], verb)(*values, wait=False, callback=receive, **how)
        except FAILURES as error:
            self.check()
            raise RuntimeError(f"{name} does not take a {verb} request: {error}") from None
        return done

    def wait(self, done, deadline):
        """Waits for events of `start`. Returns the names of those that are not set at the deadline."""
        while time.monotonic() < deadline:
            self.check()
            if all(event.is_set() for event in done.values()):
                return []
            time.sleep(POLL_S)
        return [name for name, event in done.items() if not event.is_set()]

    def put(self, name, value, timeout_s=None):
        """Puts a value and waits until the record has finished."""
        limit = self.timeout_s if timeout_s is None else timeout_s
        if self.wait({name: self.start(name, value, limit)}, time.monotonic() + limit):
            raise RuntimeError(f"{name} did not finish what {value!r} started within {limit:g} s; check its IOC")

    def put_at_once(self, values):
        """Puts values by name, as fast as possible and without raising, over new connections where the old ones fail.

        Returns:
            The names that did not confirm in time.
        """
        late = self._put_all(self.pvs, values)
        if not late:
            return []
        with contextlib.suppress(*FAILURES):
            self.context = Context()
            pvs = dict(zip(late, self.context.get_pvs(*late, timeout=STOP_S)))
            deadline = time.monotonic() + STOP_S
            while time.monotonic() < deadline and not all(pv.connected for pv in pvs.values()):
                time.sleep(POLL_S)
            return self._put_all(pvs, {name: values[name] for name in late})
        return late

    @staticmethod
    def _put_all(pvs, values):
        done = {name: threading.Event() for name in values}
        for name, event in done.items():
            event.confirm = lambda response, event=event: event.set()
            try:
                if pvs[name].connected:
                    pvs[name].write(values[name], wait=False, callback=event.confirm, timeout=STOP_S)
            except FAILURES:
                pass
        deadline = time.monotonic() + STOP_S
        while True:
            late = [name for name, event in done.items() if not event.is_set()]
            if time.monotonic() > deadline or not any(pvs[name].connected for name in late):
                return late
            time.sleep(POLL_S)


def finite(name, value, severity=AlarmSeverity.NO_ALARM):
    """A record's value as a float. Refuses NaN, infinity and the severity INVALID, at which the value is an old one."""
    if severity == AlarmSeverity.INVALID_ALARM:
        raise RuntimeError(f"{name} has the alarm severity INVALID; check its controller and the record's STAT")
    if not math.isfinite(value):
        raise RuntimeError(f"{name} has no finite value; check its encoder, controller and driver")
    return float(value)


class Motors:
    """Motor records, which are moved inside a box only.

    Args:
        axes: Of the layout, with name, pv, unit, low, high and tolerance; see layout.py.
        channels: The connections.
        timeout_s: Time limit for a move.
    """

    def __init__(self, axes, channels, timeout_s):
        self.axes, self.channels, self.timeout_s = axes, channels, timeout_s

    @staticmethod
    def names(axes):
        """The records' names."""
        return [f"{axis.pv}.{field}" for axis in axes for field in FIELDS]

    def field(self, axis, field):
        return self.channels.number(f"{axis.pv}.{field}", alarms=True)

    def positions(self):
        """Readbacks, one per axis."""
        return [self.field(axis, "RBV") for axis in self.axes]

    def check_ready(self):
        """Refuses what could move a motor out of the box, before anything moves."""
        for axis in self.axes:
            unit = self.channels.text(f"{axis.pv}.EGU")
            if unit != axis.unit:
                raise RuntimeError(f"{axis} has the unit '{unit}' (EGU), the layout says '{axis.unit}'; correct the layout")
            if self.field(axis, "SET"):
                raise RuntimeError(f"{axis} is in set mode: a put would redefine its position; put 0 (Use) to {axis.pv}.SET")
            if self.channels.text(f"{axis.pv}.SPMG") != "Go":
                raise RuntimeError(f"{axis} is halted by {axis.pv}.SPMG; put 3 (Go) to it if the motor may move")
            low, high = self.field(axis, "LLM"), self.field(axis, "HLM")
            if low != high and (axis.low < low or axis.high > high):  # equal limits are disabled ones
                raise RuntimeError(
                    f"the box of {axis}, {axis.low:g} to {axis.high:g}, leaves the motor's soft limits, {low:g} to {high:g}; "
                    f"make the box smaller, or change {axis.pv}.LLM and .HLM"
                )
            axis.backlash = self.field(axis, "BDST")
            if abs(axis.backlash) >= axis.high - axis.low:
                raise RuntimeError(f"the backlash of {axis}, {axis.backlash:g}, is larger than its box; check {axis.pv}.BDST")
            if not self.field(axis, "DMOV"):
                raise RuntimeError(f"{axis} is moving already; wait until it rests, or stop it, and start again")
            self.check_inside(axis, self.field(axis, "RBV"), "move it into the box by hand, and start again")

    @staticmethod
    def check_inside(axis, position, remedy):
        if not axis.low - axis.tolerance <= position <= axis.high + axis.tolerance:
            raise RuntimeError(
                f"{axis} is at {position:g} {axis.unit}, outside the box of {axis.low:g} to {axis.high:g}; {remedy}"
            )

    @staticmethod
    def reachable(axis):
        """The targets of an axis: backlash correction, which first moves beyond the target, must not leave the box."""
        return axis.low + max(0.0, axis.backlash), axis.high + min(0.0, axis.backlash)

    def move_to(self, targets):
        """Moves axes at once and waits until all rest: any order of arrival stays in the box, whose sides are the axes'.

        Args:
            targets: One per axis; None for an axis that does not move.

        Returns:
            Per axis -1 or 1 for the limit switch that it met, else 0.

        Raises:
            RuntimeError: A target is outside the box (then nothing moves), or a move failed.
        """
        for axis, target in zip(self.axes, targets):
            low, high = self.reachable(axis)
            if target is not None and not low <= target <= high:  # not for NaN, either
                raise RuntimeError(f"{axis} must not move to {target:g} {axis.unit}: outside the box of {low:g} to {high:g}")
        deadline = time.monotonic() + self.timeout_s
        moving = {axis.pv: (axis, target) for axis, target in zip(self.axes, targets) if target is not None}
        self.channels.check()
        done = {pv: self.channels.start(f"{pv}.VAL", target, self.timeout_s) for pv, (_, target) in moving.items()}
        late = self.channels.wait(done, deadline)
        while not late:  # some gateways and device supports complete a put early: DMOV decides
            moving_still = [pv for pv in moving if not self.channels.number(f"{pv}.DMOV")]
            if not moving_still:
                return [self.arrived(axis, target) for axis, target in zip(self.axes, targets)]
            if time.monotonic() > deadline:
                late = moving_still
            time.sleep(POLL_S)
        raise self.late_error(*moving[late[0]], self.timeout_s)

    def late_error(self, axis, target, limit_s):
        """The error of a move that has not ended within its time limit. Asks for the position: raises if it gets no answer."""
        position = self.field(axis, "RBV")
        if abs(position - target) <= axis.tolerance:
            return RuntimeError(
                f"{axis} is at its target, {target:g} {axis.unit}, but its record did not report the end of the move (DMOV) "
                f"within {limit_s:g} s; check its IOC, or raise 'move_timeout_s'"
            )
        return RuntimeError(
            f"{axis} did not reach {target:g} {axis.unit} within {limit_s:g} s and is at "
            f"{position:g}; check its drive and amplifier, or raise 'move_timeout_s'"
        )

    def arrived(self, axis, target):
        """The limit switch that the axis met. Refuses a readback that disagrees with the target."""
        if target is None:
            return 0
        position = self.field(axis, "RBV")
        if self.field(axis, "LVIO"):
            raise RuntimeError(f"{axis} refused {target:g} {axis.unit}: outside its soft limits; check {axis.pv}.LLM and .HLM")
        switch = int(self.field(axis, "HLS") != 0) - int(self.field(axis, "LLS") != 0)
        self.check_inside(axis, position, "it left the box by itself: check its drive and encoder")
        if not switch and abs(position - target) > axis.tolerance:
            raise RuntimeError(
                f"{axis} was sent to {target:g} {axis.unit} and reads {position:g}, off by more than {axis.tolerance:g}; "
                f"check its encoder and drive, whether another client stopped it, and its 'tolerance'"
            )
        return switch

    def stops(self):
        """The puts that stop all motors."""
        return {f"{axis.pv}.STOP": 1 for axis in self.axes}


class AreaDetector:
    """A camera with areaDetector's driver records and NDPluginStdArrays.

    Args:
        facts: Of the layout: cam, image, width, height, exposure_s.
        channels: The connections.
        timeout_s: Time limit for an image, besides its exposure.
    """

    CAM = ("Acquire", "AcquireTime", "ImageMode", "ArrayCallbacks")
    IMAGE = ("EnableCallbacks", "ArrayCounter_RBV", "ArraySize0_RBV", "ArraySize1_RBV", "ArraySize2_RBV", "DataType_RBV",
             "ArrayData")

    def __init__(self, facts, channels, timeout_s):
        self.facts, self.channels, self.timeout_s = facts, channels, timeout_s + facts["exposure_s"]
        self.cam, self.image = facts["cam"], facts["image"]

    @classmethod
    def names(cls, facts):
        """The records' names."""
        return [facts["cam"] + name for name in cls.CAM] + [facts["image"] + name for name in cls.IMAGE]

    def prepare(self):
        """Stops an acquisition under way, and sets single images of the layout's exposure."""
        put = self.channels.put
        put(self.cam + "Acquire", 0)
        put(self.cam + "ImageMode", 0)  # Single
        put(self.cam + "AcquireTime", self.facts["exposure_s"])
        put(self.cam + "ArrayCallbacks", 1)
        put(self.image + "EnableCallbacks", 1)

    def capture(self):
        """Counts of a new image, shape (height, width)."""
        number, counter = self.channels.number, self.image + "ArrayCounter_RBV"
        before, stamp, deadline = number(counter), self.stamp(), time.monotonic() + self.timeout_s
        done = self.channels.start(self.cam + "Acquire", 1, self.timeout_s)
        self.channels.wait({"image": done}, deadline)
        # Without WaitForPlugins, Acquire completes before the plugin has the image; records follow one by one.
        while number(counter) == before or self.stamp() == stamp:
            if time.monotonic() > deadline:
                raise RuntimeError(
                    f"no image arrived within {self.timeout_s:g} s after {self.cam}Acquire: {counter} stays at {before:g}; "
                    f"check the camera's trigger, {self.image}NDArrayPort and {self.image}EnableCallbacks"
                )
            time.sleep(POLL_S)
        return self.image_counts()

    def image_counts(self):
        """Counts of the image that the plugin has, shape (height, width)."""
        width, height = self.facts["width"], self.facts["height"]
        found = [int(self.channels.number(f"{self.image}ArraySize{i}_RBV")) for i in range(3)]
        if found[:2] != [width, height] or found[2] > 1:
            raise RuntimeError(
                f"{self.image} has images of {' x '.join(str(size) for size in found if size)}, the layout says "
                f"{width} x {height}; set the camera's region and colour mode (Mono), or correct the layout"
            )
        counts = np.asarray(self.channels.read(self.image + "ArrayData", data_count=width * height))
        if counts.size != width * height:
            raise RuntimeError(f"{self.image}ArrayData has {counts.size} values, expected {width * height}; raise its NELM")
        kind = self.channels.text(self.image + "DataType_RBV")
        if kind in UNSIGNED:  # waveforms of a signed type have them wrapped
            counts = counts.astype(np.int64) & UNSIGNED[kind]
            if self.facts["counts_at_1"] > UNSIGNED[kind]:
                raise RuntimeError(f"{self.image} has pixels of type {kind}, which end at {UNSIGNED[kind]}, and 'counts_at_1' "
                                   f"is {self.facts['counts_at_1']:g}; set the camera's data type, or correct the layout")
        if not np.isfinite(counts).all():
            raise RuntimeError(f"{self.image}ArrayData has pixels without a finite value; check the camera's driver")
        return counts.reshape(height, width)

    def stamp(self):
        """When the pixels were written, by the IOC."""
        return self.channels.response(self.image + "ArrayData", data_type="time", data_count=1).metadata.timestamp

    def stops(self):
        """The puts that end an exposure."""
        return {self.cam + "Acquire": 0}
