"""The layout's motors and camera as ophyd devices, for Bluesky plans and for blop. See README.md.

The devices are ophyd's own, with the checks of the station plugin: staging refuses what could leave the box, no move is
sent beyond it, and a move or an image that went wrong fails with a message. Any plan that stages its devices gets them.
"""
import contextlib
import functools
import numbers
import os
import threading

import numpy as np
from channel_access import AreaDetector, Motors, finite
from layout import Layout, golden_image
from ophyd import Component, EpicsMotor, EpicsSignal, EpicsSignalRO, FormattedComponent
from ophyd.areadetector import CamBase, DetectorBase, ImagePlugin, SingleTrigger
from ophyd.areadetector.trigger_mixins import ADTriggerStatus
from ophyd.positioner import PositionerBase
from ophyd.signal import AttributeSignal, EpicsSignalBase
from ophyd.status import wait as wait_for
from ophyd.utils import LimitError
from ophyd.utils.errors import DisconnectedError, InvalidState, StatusTimeoutError


class Records:
    """Single records by name, read as `Motors` and `AreaDetector` need them."""

    def __init__(self, timeout_s):
        self.timeout_s, self.signals = timeout_s, {}

    def read(self, name, data_count=None, **how):
        if name not in self.signals:
            self.signals[name] = EpicsSignalRO(name, name=name)
        try:
            return self.signals[name].get(count=data_count, timeout=self.timeout_s, connection_timeout=self.timeout_s, **how)
        except TimeoutError:
            raise RuntimeError(f"{name} did not answer within {self.timeout_s:g} s; check its IOC and the network") from None

    def number(self, name, alarms=False):
        value = self.read(name)
        return finite(name, value, self.signals[name].alarm_severity if alarms else 0)

    def text(self, name):
        return str(self.read(name, as_string=True))


class Setpoint(EpicsSignal):
    """A motor's setpoint. It has the checks of all targets: ophyd's motor asks it, and a plan may set it itself."""

    def check_value(self, value):
        """Refuses what is not a number, a target beyond the soft limits or the box, and all after a lost connection."""
        self.parent.check_movable(value)
        super().check_value(value)
        self.parent.check_box(value)


class Motor(EpicsMotor):
    """A motor record that keeps its axis's box.

    Args:
        axis: Of the layout.
        records: For the checks.
        timeout: Time limit for a move, in s.
    """

    user_setpoint = Component(Setpoint, ".VAL", limits=True, auto_monitor=True)

    def __init__(self, axis, records, timeout):
        self._axis, self._status = axis, None
        self._lost, self._completed, self._ended, self._ending = False, False, True, threading.Lock()
        self._checks = Motors([axis], records, timeout)
        super().__init__(axis.pv, name=axis.name, timeout=timeout)
        self.user_readback.subscribe(self._connection_changed, event_type=self.user_readback.SUB_META, run=False)

    def stage(self):
        self._checks.check_ready()
        self._lost = False
        return super().stage()

    def check_movable(self, position):
        if not isinstance(position, numbers.Real):
            raise TypeError(f"{self._axis} takes a number in {self._axis.unit}, not {position!r}")
        if self._lost:
            raise RuntimeError(f"the connection to {self._axis} was lost since it was staged; look at the machine first")

    def check_box(self, position):
        low, high = self._checks.reachable(self._axis)
        if not low <= position <= high:  # not for NaN, either
            raise LimitError(f"{self._axis} must not move to {position:g} {self._axis.unit}: outside {low:g} to {high:g}")

    def move(self, position, wait=True, **kwargs):
        self._status = PositionerBase.move(self, position, **kwargs)
        self._status._settled = functools.partial(self._explain_timeout, self._status, self._status._settled)
        self._completed = self._ended = False
        try:
            self.user_setpoint.put(position, wait=False, callback=self._put_completed, timeout=self._status.timeout,
                                   connection_timeout=1.0)
        except (TimeoutError, RuntimeError):  # the connection was lost after the check
            self._connection_changed(connected=False)
        if wait:
            wait_for(self._status)
        return self._status

    def stop(self, *, success=False):
        self._ended = True
        super().stop(success=success)

    def _put_completed(self, **kwargs):
        self._completed = True
        try:
            resting = self.motor_done_move.get(use_monitor=False, connection_timeout=1.0)
        except Exception:  # noqa: BLE001 (a client completes puts at the end of a connection, too)
            self._connection_changed(connected=False)
        else:
            if resting:  # a gateway may complete a put early; then DMOV ends the move
                self._end()

    def _done_moving(self, success=True, **kwargs):
        """Called by stop, and at each change of DMOV, of which that of a short move may be lost."""
        if not kwargs:
            super()._done_moving(success=success)
        elif self._completed:
            self._end()

    def _end(self):
        """Ends the move. A limit switch ends it without a failure, as for the station plugin; events have the readback."""
        with self._ending:
            if self._ended:
                return
            self._ended = True
        try:
            self._checks.arrived(self._axis, self._status.target)
        except Exception as error:  # noqa: BLE001 (the status carries it to the plan)
            self._fail(error)
        else:
            super()._done_moving(success=True)

    def _fail(self, error):
        self._reset_sub(self._SUB_REQ_DONE)  # ophyd's own end of the move
        with contextlib.suppress(InvalidState):
            self._status.set_exception(error)

    def _explain_timeout(self, status, settled):
        """ophyd's hook before a status is done: the time limit stays ophyd's, its error becomes the station plugin's."""
        if isinstance(status._exception, StatusTimeoutError):
            self._ended = True
            self._reset_sub(self._SUB_REQ_DONE)  # else stop, which follows, would replace the error
            try:
                if self.user_readback.connected:
                    status._exception = self._checks.late_error(self._axis, status.target, status.timeout)
                else:  # ophyd tells it later where one of its callbacks waits for another record of the motor
                    self._lost, status._exception = True, self._lost_error()
            except Exception as error:  # noqa: BLE001 (the status carries it to the plan)
                status._exception = error
        with contextlib.suppress(DisconnectedError):  # asks for the position
            settled()

    def _lost_error(self):
        return RuntimeError(f"the connection to {self._axis} was lost in a move; STOP cannot reach it: look at the machine")

    def _connection_changed(self, connected=True, **kwargs):
        if connected:
            return
        self._lost = True
        if self._status is not None and not self._status.done:  # even where a check is under way, which now gets no answer
            self._fail(self._lost_error())


class Camera(SingleTrigger, DetectorBase):
    """areaDetector's driver and NDPluginStdArrays: a trigger takes one image.

    Args:
        facts: The layout's camera.
        records: For the checks.
        timeout: Time limit for an image, besides its exposure, in s.
        golden: Image of a perfect lens, shape (height, width), 1 for counts_at_1.
    """

    _default_read_attrs = ("image", "error")
    cam = FormattedComponent(CamBase, "{self._facts[cam]}")
    plugin = FormattedComponent(ImagePlugin, "{self._facts[image]}")
    image = Component(AttributeSignal, "_image", write_access=False, kind="normal")  # shape (height, width), 1 for counts_at_1
    error = Component(AttributeSignal, "_error", write_access=False, kind="hinted")  # RMSE between image and golden

    def __init__(self, facts, records, timeout, golden):
        self._facts, self._golden = facts, golden
        self._images = AreaDetector(facts, records, timeout)
        self._before = self._taken = None
        super().__init__("", name="camera")
        self.stage_sigs.update({"cam.acquire_time": facts["exposure_s"], "cam.num_images": 1})
        limit = timeout + facts["exposure_s"]
        self._status_type = lambda device: ADTriggerStatus(device, timeout=limit)

    def unstage(self):
        try:
            return super().unstage()
        except TimeoutError as error:  # an error here would hide the one that ended the plan
            self.log.warning("the settings of %s were not restored: %s", self._facts["cam"], error)
            return [self]

    def trigger(self):
        self._before, self._taken = self._counter(), None
        return super().trigger()

    def _counter(self):
        return self._images.channels.number(self._images.image + "ArrayCounter_RBV")

    @property
    def _image(self):
        if self._taken is None:
            if self._counter() == self._before:
                raise RuntimeError(f"the exposure ended without an image in {self._images.image}: check NDArrayPort and "
                                   "EnableCallbacks")
            self._taken = np.asarray(self._images.image_counts() / self._facts["counts_at_1"], np.float32)
        return self._taken

    @property
    def _error(self):
        return float(np.sqrt(np.mean((self._image - self._golden) ** 2.0)))


def connect(layout="station.json", golden="golden.npy", prefix="RELIGN:", timeout_s=5.0, move_timeout_s=20.0):
    """The devices of a layout file.

    Args:
        layout: The file; README.md describes it.
        golden: .npy file of the image of a perfect lens.
        prefix: Replaces $(P) in the layout.
        timeout_s: Time limit for connections, answers and images.
        move_timeout_s: Time limit for one move.

    Returns:
        (motors, camera, box): the motors in the layout's order, and (low, high) by name of the motor.

    Raises:
        TimeoutError: A record does not answer.
        ValueError: The layout or the image is not valid.
    """
    facts = Layout(layout, prefix)
    image = golden_image(golden, facts.camera)
    if "genicam" in facts.camera:
        raise ValueError(f"{layout}: serve the camera by areaDetector (ADAravis) and name its records 'cam' and 'image'")
    with contextlib.suppress(RuntimeError):  # a session that has devices already keeps its own limits
        EpicsSignalBase.set_defaults(timeout=timeout_s, connection_timeout=timeout_s)
    records = Records(timeout_s)
    motors = [Motor(axis, records, move_timeout_s) for axis in facts.axes]
    try:
        for motor in motors:
            motor.wait_for_connection(timeout=timeout_s)
        camera = Camera(facts.camera, records, timeout_s, image)
        camera.wait_for_connection(timeout=timeout_s)
    except TimeoutError as error:
        raise TimeoutError(f"no IOC answers for all records within {timeout_s:g} s; check the names, the IOC and "
                           f"EPICS_CA_ADDR_LIST (now '{os.environ.get('EPICS_CA_ADDR_LIST', '')}'): {error}") from None
    return motors, camera, {axis.name: (axis.low, axis.high) for axis in facts.axes}
