"""A soft IOC in front of the simulator: motor records, an areaDetector camera and a loader. See README.md.

The records have the names and the behaviour of EPICS's motor record and of areaDetector, as far as clients use them. The
lens, its place in the gripper and the errors of the stage are those of an instance of the benchmark, which no client can
read: a motor's zero is where the loader puts a lens.
"""
import argparse
import asyncio
import os
import signal
import sys
import threading
import time

import numpy as np
from caproto import AlarmSeverity, AlarmStatus, ChannelAlarm, ChannelType
from caproto.server import PVGroup, SubGroup, get_pv_pair_wrapper, pvproperty, run
from genicam import FakeCamera

import relign_bench

COUNTS_AT_1 = 65535  # the camera's count at irradiance 1, where it saturates
TICK_S = 0.02  # between two readbacks of a moving motor
FAULTS = ("stuck", "readback", "nan", "alarm", "disconnect", "silent", "slow", "no-image", "no-camera")
SLOW_S = 0.2  # for which a slow IOC does nothing, again and again
setting = get_pv_pair_wrapper(setpoint_suffix="", readback_suffix="_RBV")


def say(text):
    print(text, flush=True)


class Machine:
    """Ground truth: the lens on its stage.

    Attributes:
        travel: Of each axis, in mm or degrees.
        ends: Where each axis has its limit switches: (low, high) from the load position.
    """

    def __init__(self, bench):
        self.batch = bench.batch(1)
        self.turn = threading.Lock()  # the simulated GenICam camera has a thread of its own
        self.travel = [axis["upper"] - axis["lower"] for axis in bench.description["axes"]]
        self.load(0)

    def load(self, number):
        """Puts another lens into the gripper, with the stage at its load position."""
        with self.turn:
            self.batch.reset([0], [number], "benchmark")
            loaded_at = self.batch.commanded_poses([0])[0]
        self.ends = [(-at * travel, (1 - at) * travel) for at, travel in zip(loaded_at, self.travel)]

    def move(self, axis, amount):
        """Moves one axis by an amount that stays between its ends."""
        move = np.zeros((1, len(self.travel)))
        move[0, axis] = amount / self.travel[axis]
        with self.turn:
            self.batch.move_by([0], move)

    def capture(self):
        """Counts of a new frame, shape (height, width)."""
        with self.turn:
            self.batch.move_by([0], np.zeros((1, len(self.travel))))
            return np.clip(self.batch.frames[0] * COUNTS_AT_1 + 0.5, 0, COUNTS_AT_1).astype(np.uint16)


class Trouble:
    """The fault that --fault orders. It begins after a number of images, with the first motor that moves then."""

    def __init__(self, text):
        self.kind, _, after = text.partition(":")
        self.after = int(after or 0)
        self.images, self.brake, self.genicam = 0, None, None

    def slow_down(self):
        """From now on every answer of the IOC takes long."""
        async def block():
            while True:
                time.sleep(SLOW_S)
                await asyncio.sleep(0)

        self.brake = self.brake or asyncio.create_task(block())

    def now(self, kind):
        return self.kind == kind and self.images >= self.after


class Motor(PVGroup):
    """A motor record of one axis."""

    record = pvproperty(value=0.0, name="", record="motor", precision=6, dtype=float)

    def __init__(self, *args, axis, unit, travel, machine, options, trouble, **kwargs):
        super().__init__(*args, **kwargs)
        self.axis, self.unit, self.travel = axis, unit, travel
        self.machine, self.options, self.trouble = machine, options, trouble
        self.stopping, self.resting, self.target = False, asyncio.Event(), 0.0
        self.resting.set()

    @record.startup
    async def record(self, instance, async_lib):
        fields = instance.field_inst
        fields.stop.putter = self.stop
        await instance.write_metadata(units=self.unit)
        for field, value in (
            (fields.engineering_units, self.unit), (fields.velocity, self.travel * self.options.speed),
            (fields.user_low_limit, -self.travel), (fields.user_high_limit, self.travel),
            (fields.dial_low_limit, -self.travel), (fields.dial_high_limit, self.travel),
            (fields.motor_step_size, 1e-6), (fields.bl_distance, self.options.backlash * self.travel),
        ):
            await field.write(value)

    @record.putter
    async def record(self, instance, value):
        """Moves; the put is complete when the motor rests. A put to a moving motor changes its target."""
        fields, name = instance.field_inst, instance.pvname
        violated = not fields.user_low_limit.value <= value <= fields.user_high_limit.value
        await fields.limit_violation.write(int(violated))
        if violated:
            say(f"{name} refuses {value:.6f}: beyond its soft limits")
            return instance.value
        say(f"{name} moves to {value:.6f}")
        self.target = value
        if not self.resting.is_set():
            await self.resting.wait()
            return self.target
        self.stopping = False
        self.resting.clear()
        await instance.write(value, verify_value=False, update_fields=False)
        await fields.done_moving_to_value.write(0)
        await fields.motor_is_moving.write(1)
        began, extremes = fields.user_readback_value.value, [fields.user_readback_value.value]
        await fields.direction_of_travel.write(int(value > began))
        approach = fields.bl_distance.value
        if approach and (value - began) * approach < 0:  # against the direction of the final approach: first beyond
            await self.travel_to(lambda: self.target - approach, fields, extremes)
        await self.travel_to(lambda: self.target, fields, extremes)
        await self.rest(instance, fields, began)
        say(f"{name} rests at {fields.user_readback_value.value:.6f}, was between {min(extremes):.6f} and {max(extremes):.6f}")
        return self.target

    async def travel_to(self, target, fields, extremes):
        """Moves the readback at the motor's velocity until it is at the target or at an end, or somebody stops it."""
        last, (low, high) = time.monotonic(), self.machine.ends[self.axis]
        while not self.stopping and (position := fields.user_readback_value.value) != min(max(target(), low), high):
            await asyncio.sleep(TICK_S)
            if self.trouble.now("disconnect"):
                say("the IOC dies")
                os._exit(1)
            if self.trouble.now("no-camera") and self.trouble.genicam:
                self.trouble.genicam.close()
            if self.trouble.now("slow"):
                self.trouble.slow_down()
            if self.trouble.now("silent"):
                say("the IOC does not answer any more")
                os.kill(os.getpid(), signal.SIGSTOP)
            now = time.monotonic()
            step, last = fields.velocity.value * (now - last), now
            if self.trouble.now("stuck") and self.axis == 0:
                continue
            position = min(max(target(), position - step, low), position + step, high)
            extremes.append(position)
            await fields.user_readback_value.write(position)
            await fields.dial_readback_value.write(position)

    async def rest(self, instance, fields, began):
        """Moves the stage, and sets the fields that clients read when a move is over."""
        position, (low, high) = fields.user_readback_value.value, self.machine.ends[self.axis]
        self.machine.move(self.axis, position - began)
        switches = (0, 0) if self.stopping else (int(self.target < low), int(self.target > high))
        if self.stopping or any(switches):
            self.target = position
        if self.trouble.now("readback") and self.axis == 0:
            position += 0.02 * self.travel
        if self.trouble.now("nan") and self.axis == 0:
            position = float("nan")
        await fields.user_readback_value.write(position)
        await fields.dial_readback_value.write(position)
        if self.trouble.now("alarm") and self.axis == 0:
            fields.user_readback_value.alarm = ChannelAlarm(status=AlarmStatus.COMM, severity=AlarmSeverity.INVALID_ALARM)
        await fields.user_low_limit_switch.write(switches[0])
        await fields.user_high_limit_switch.write(switches[1])
        await fields.motor_is_moving.write(0)
        await fields.done_moving_to_value.write(1)
        self.resting.set()

    async def stop(self, instance, value):
        if value:
            say(f"{self.record.pvname} STOP at {self.record.field_inst.user_readback_value.value:.6f}")
            self.stopping = True
        return 0

    async def home(self):
        """Where the loader expects it."""
        fields = self.record.field_inst
        self.target = 0.0
        await self.record.write(0.0, verify_value=False, update_fields=False)
        for field in (fields.user_readback_value, fields.dial_readback_value):
            await field.write(0.0)
        for field in (fields.user_low_limit_switch, fields.user_high_limit_switch):
            await field.write(0)


def choice(name, *words, value=None):
    """An enumeration with its readback."""
    return setting(name=name, value=value or words[0], dtype=ChannelType.ENUM, enum_strings=list(words))


def chosen(pair):
    """The word that an enumeration has; clients write words or numbers."""
    value = pair.setpoint.value
    return value if isinstance(value, str) else pair.setpoint.enum_strings[int(value)]


async def acquire(pair, instance, value):
    """A put to Acquire is complete when the image is in image1:ArrayData."""
    if not value:
        return 0
    await pair.readback.write(1)
    await instance.write(1, verify_value=False, update_fields=False)
    await pair.parent.expose()
    await pair.readback.write(0)
    return 0


class Camera(PVGroup):
    """What clients use of an areaDetector driver, cam1:, and of its NDPluginStdArrays, image1:."""

    acquire = setting(name="cam1:Acquire", value=0, dtype=int, put=acquire)
    acquire_time = setting(name="cam1:AcquireTime", value=0.01, dtype=float)
    acquire_period = setting(name="cam1:AcquirePeriod", value=0.03, dtype=float)
    image_mode = choice("cam1:ImageMode", "Single", "Multiple", "Continuous", value="Continuous")
    trigger_mode = choice("cam1:TriggerMode", "Internal", "External")
    cam_callbacks = choice("cam1:ArrayCallbacks", "Disable", "Enable")
    pixel_type = choice("cam1:DataType", "UInt8", "UInt16", value="UInt16")
    num_images = setting(name="cam1:NumImages", value=1, dtype=int)
    num_exposures = setting(name="cam1:NumExposures", value=1, dtype=int)
    cam_counter = setting(name="cam1:ArrayCounter", value=0, dtype=int)
    cam_port = pvproperty(name="cam1:PortName_RBV", value="SIM1", dtype=ChannelType.STRING, read_only=True)
    manufacturer = pvproperty(name="cam1:Manufacturer_RBV", value="relign-bench", dtype=ChannelType.STRING, read_only=True)
    model = pvproperty(name="cam1:Model_RBV", value="simulated camera", dtype=ChannelType.STRING, read_only=True)

    enable = choice("image1:EnableCallbacks", "Disable", "Enable")
    blocking = choice("image1:BlockingCallbacks", "No", "Yes")
    callbacks = choice("image1:ArrayCallbacks", "Disable", "Enable", value="Enable")
    source = setting(name="image1:NDArrayPort", value="SIM1", dtype=ChannelType.STRING)
    image_port = pvproperty(name="image1:PortName_RBV", value="IMAGE1", dtype=ChannelType.STRING, read_only=True)
    plugin_type = pvproperty(name="image1:PluginType_RBV", value="NDPluginStdArrays", dtype=ChannelType.STRING, read_only=True)
    data_type = pvproperty(name="image1:DataType_RBV", value="UInt16", dtype=ChannelType.ENUM, read_only=True,
                           enum_strings=["Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Float32", "Float64"])
    color_mode = pvproperty(name="image1:ColorMode_RBV", value="Mono", dtype=ChannelType.STRING, read_only=True)
    dimensions = pvproperty(name="image1:NDimensions_RBV", value=2, dtype=int, read_only=True)
    size_0 = pvproperty(name="image1:ArraySize0_RBV", value=0, dtype=int, read_only=True)
    size_1 = pvproperty(name="image1:ArraySize1_RBV", value=0, dtype=int, read_only=True)
    size_2 = pvproperty(name="image1:ArraySize2_RBV", value=0, dtype=int, read_only=True)
    counter = setting(name="image1:ArrayCounter", value=0, dtype=int)

    def __init__(self, *args, machine, trouble, **kwargs):
        super().__init__(*args, **kwargs)
        self.machine, self.trouble = machine, trouble

    async def expose(self):
        """Exposes, and passes the image to the plugin where both have their callbacks enabled."""
        await asyncio.sleep(self.acquire_time.setpoint.value)
        counts = self.machine.capture()
        await self.cam_counter.readback.write(self.cam_counter.readback.value + 1)
        if "Disable" in (chosen(self.cam_callbacks), chosen(self.enable)) or self.trouble.now("no-image"):
            return
        self.trouble.images += 1
        height, width = counts.shape
        if chosen(self.pixel_type) == "UInt8":
            counts >>= 8
        await self.data_type.write(chosen(self.pixel_type))
        await self.size_0.write(width)
        await self.size_1.write(height)
        await self.parent.pixels.write(counts.astype(np.int32).ravel())
        await self.counter.readback.write(self.counter.readback.value + 1)


def make_ioc(bench, options):
    """The IOC's records, by name."""
    machine, trouble = Machine(bench), Trouble(options.fault)
    height, width = bench.reference.shape
    if options.genicam:
        def frame():
            trouble.images += 1
            return (machine.capture() >> 8).astype(np.uint8)

        trouble.genicam = FakeCamera(options.genicam, frame)

    class Loader(PVGroup):
        """The records that do not depend on the number of axes."""

        camera = SubGroup(Camera, prefix="", machine=machine, trouble=trouble)
        pixels = pvproperty(name="image1:ArrayData", value=[0], dtype=int, max_length=width * height, read_only=True)
        lens = pvproperty(name="Lens", value=0, dtype=int, doc="loads the lens of this number; complete when it is loaded")

        @lens.putter
        async def lens(self, instance, value):
            say(f"lens {value}")
            machine.load(value)
            for motor in motors:
                await motor.home()

    loader = Loader(prefix=options.prefix)
    motors = [
        Motor(prefix=f"{options.prefix}m{axis + 1}", axis=axis, unit=facts["unit"], travel=machine.travel[axis],
              machine=machine, options=options, trouble=trouble)
        for axis, facts in enumerate(bench.description["axes"])
    ]
    records = dict(loader.pvdb)
    for motor in motors:
        records.update(motor.pvdb)
    return records


def main():
    parser = argparse.ArgumentParser(description="Serve a simulated lens, hexapod and camera as EPICS records.")
    parser.add_argument("--prefix", default="RELIGN:", help="prefix of all records [default: %(default)s]")
    parser.add_argument("--interface", default="127.0.0.1", help="address to listen on [default: %(default)s]")
    parser.add_argument("--scene", default="relign_od", help="id of the scene [default: %(default)s]")
    parser.add_argument("--noise-level", default="rho0.25", help="id of the noise level [default: %(default)s]")
    parser.add_argument("--size", type=int, help="columns of the sensor [default: the scene's own]")
    parser.add_argument("--batch", type=int, default=1, help="seed of the lenses [default: %(default)s]")
    parser.add_argument("--speed", type=float, default=4.0, help="travels per second of a motor [default: %(default)s]")
    parser.add_argument("--backlash", type=float, default=0.0,
                        help="BDST of the motors as a share of the travel [default: %(default)s]")
    parser.add_argument("--genicam", metavar="ADDRESS", help="serve the images by a simulated GigE Vision camera, too (Aravis)")
    parser.add_argument("--golden", metavar="FILE", help="write the image of the perfect lens to this .npy file")
    parser.add_argument("--fault", default="", metavar="KIND:N",
                        help=f"after N images, let a fault begin with the next move or image: {', '.join(FAULTS)}")
    options = parser.parse_args()
    if "{" in options.prefix or "}" in options.prefix:
        parser.error("--prefix: caproto takes braces for its macros; choose a prefix without them")
    if options.fault.partition(":")[0] not in ("", *FAULTS):
        parser.error(f"unknown fault '{options.fault}'; faults: {', '.join(FAULTS)}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    bench = relign_bench.Bench(options.scene, options.noise_level, options.batch, size=options.size, threads=1)
    if options.golden:
        np.save(options.golden, bench.reference.astype(np.float32))
    records = make_ioc(bench, options)

    async def ready(_):
        say(f"serving {len(records)} records, such as {options.prefix}m1 and {options.prefix}cam1:Acquire")

    run(records, interfaces=[options.interface], startup_hook=ready)


if __name__ == "__main__":
    main()
