"""Plays a station over TCP: a hexapod that holds a lens in front of a camera, with its loader. See README.md.

Behind the line protocol stands the simulator: pictures come from `relign-bench render`. How the gripper holds a lens,
how the hexapod's moves are distorted and how the lens was assembled is drawn here for every lens, and told to nobody.
"""
import argparse
import array
import json
import math
import os
import pathlib
import random
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile

AXES = ("x", "y", "z", "rx", "ry")
TRAVEL = (0.5, 0.5, 0.5, 3.5, 3.5)  # mm and degrees, each way from the middle, by the hexapod's encoders
LOADED_AT = (0.0, 0.0, -0.2, 0.0, 0.0)  # where the hexapod takes a lens: a little away from the camera
SPEED = 5.0  # mm/s and deg/s
SETTLING_S, EXPOSURE_S, READOUT_S = 0.040, 0.015, 0.030
WIDTH = HEIGHT = 200
COUNTS_AT_1 = 65535  # the camera's count at irradiance 1, where it saturates

# The simulated scene relign_od, which moves further than this hexapod.
SCENE_TRAVEL = (1.0, 1.0, 1.0, 7.0, 7.0)
ELEMENTS = ("L3", "L4")
GRIP = 0.2  # share of the scene's travel: the gripper holds a lens this far off at most, per axis
DISTORTION, SHIFT_MM, TILT_DEG = 0.01, 0.0002, 0.4  # standard deviations


class Lens:
    """What nobody is told: one lens in the gripper, and the stage that moves it."""

    def __init__(self, batch, seed):
        chance = random.Random("batch %d lens %d" % (batch, seed))
        axes = range(len(AXES))
        self.grip = [chance.uniform(-GRIP, GRIP) for _ in axes]
        self.distortion = [[float(row == column) + chance.gauss(0, DISTORTION) for column in axes] for row in axes]
        self.elements = {
            name: {
                "shift_mm": [chance.gauss(0, SHIFT_MM) for _ in range(3)],
                "tilt_deg": [chance.gauss(0, TILT_DEG) for _ in range(2)],
            }
            for name in ELEMENTS
        }
        self.chance = chance  # goes on with the camera's noise

    def true_pose(self, position):
        """The lens as the simulator counts it, 0 to 1 along each axis, from the hexapod's encoders."""
        share = [value / (2 * travel) for value, travel in zip(position, SCENE_TRAVEL)]
        moved = [sum(entry * value for entry, value in zip(row, share)) for row in self.distortion]
        # Beyond 0 and 1 stand the mechanical stops.
        return [min(max(0.5 + grip + move, 0.0), 1.0) for grip, move in zip(self.grip, moved)]


class Camera:
    """Pictures by `relign-bench render`."""

    def __init__(self, program, folder):
        self.program = program
        self.folder = pathlib.Path(folder)

    def snap(self, lens, position):
        """Counts of 16 bits, row 0 on top."""
        pose = ",".join(repr(value) for value in lens.true_pose(position))
        assembly, picture = self.folder / "assembly.json", self.folder / "picture.npy"
        assembly.write_text(json.dumps({"elements": lens.elements}))
        command = [self.program, "render", "--scene", "relign_od", "--assembly", assembly, "--pose", pose]
        command += ["--seed", str(lens.chance.getrandbits(63)), "--out", picture]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        if done.returncode != 0:
            raise RuntimeError("no picture: " + done.stderr.decode(errors="replace").strip().replace("\n", "; "))
        data = picture.read_bytes()
        (header,) = struct.unpack_from("<H", data, 8)  # .npy: magic, version, length of the header, header, values
        light = array.array("f", data[10 + header :])
        return array.array("H", [min(int(value * COUNTS_AT_1 + 0.5), COUNTS_AT_1) for value in light])


class Machine:
    """The commands. A method's text is the rest of its answer's line; what goes wrong is raised in one sentence."""

    def __init__(self, camera, batch):
        self.camera = camera
        self.batch = batch
        self.lens = None
        self.position = list(LOADED_AT)
        self.limits = [0] * len(AXES)
        self.commands = {
            "ID?": self.identity, "NEXT": self.next, "MOVE": self.move, "POS?": self.where, "LIMITS?": self.met,
            "SNAP": self.snap,
        }

    def answer(self, line):
        """The answer's line and the bytes behind it."""
        name, *words = line.split()
        if name not in self.commands:
            raise ValueError("unknown command '%s'; known: %s" % (name, ", ".join(self.commands)))
        try:
            text = self.commands[name](*words)
        except TypeError:
            raise ValueError("wrong number of words after %s" % name) from None
        text, data = text if isinstance(text, tuple) else (text, b"")
        return "OK " + text, data

    def identity(self):
        return "relign-bench example station 1"

    def next(self, seed):
        """The loader brings a lens, the hexapod takes it where it always does. Equal seeds, equal lenses: a real
        loader would count its trays."""
        if not seed.isdigit():
            raise ValueError("NEXT takes a whole number, found '%s'" % seed)
        self.lens = Lens(self.batch, int(seed))
        self.position = list(LOADED_AT)
        self.limits = [0] * len(AXES)
        return "loaded"

    def move(self, *words):
        """Relative, all axes at once, in mm and degrees; stops each axis at its limit. Tells the seconds it took."""
        delta = [float(word) for word in words]
        if len(delta) != len(AXES) or not all(math.isfinite(value) for value in delta):
            raise ValueError("MOVE takes %d finite numbers: %s in mm and degrees" % (len(AXES), " ".join(AXES)))
        before = self.position
        # The encoders count in nanometres and millionths of a degree.
        asked = [round(value + change, 6) for value, change in zip(before, delta)]
        self.position = [min(max(value, -travel), travel) for value, travel in zip(asked, TRAVEL)]
        self.limits = [(value > travel) - (value < -travel) for value, travel in zip(asked, TRAVEL)]
        longest = max(abs(after - value) for after, value in zip(self.position, before))
        return "%.3f" % (longest / SPEED + SETTLING_S)

    def where(self):
        return " ".join("%.6f" % value for value in self.position)

    def met(self):
        """Which limits the last move met: -1 lower, 1 upper, 0 neither."""
        return " ".join("%d" % value for value in self.limits)

    def snap(self):
        """The seconds it took, width and height; then the counts, two bytes each, low byte first."""
        if self.lens is None:
            raise RuntimeError("there is no lens: NEXT first")
        counts = self.camera.snap(self.lens, self.position)
        if sys.byteorder == "big":
            counts.byteswap()
        return "%.3f %d %d" % (EXPOSURE_S + READOUT_S, WIDTH, HEIGHT), counts.tobytes()


class Line:
    """Serves one connection after the other: a machine has one master."""

    def __init__(self, machine, drop_at):
        self.machine = machine
        self.drop_at = drop_at  # the picture in whose middle the connection breaks; 0: never
        self.pictures = 0

    def serve(self, door):
        while True:
            connection, _ = door.accept()
            with connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                try:
                    self.talk(connection)
                except OSError as error:
                    say("connection lost: %s" % error)

    def talk(self, connection):
        commands = connection.makefile("rb")
        while True:
            line = commands.readline(1000).decode("ascii", errors="replace").strip()
            if not line:
                return
            if line.startswith("NEXT"):
                say(line)
            try:
                text, data = self.machine.answer(line)
            except (OSError, RuntimeError, ValueError) as error:
                text, data = "ERR %s" % error, b""
            reply = text.replace("\n", " ").encode() + b"\n" + data
            self.pictures += bool(data)
            if data and self.pictures == self.drop_at:
                say("dropping the connection in the middle of picture %d" % self.pictures)
                connection.sendall(reply[: len(reply) // 2])
                return
            connection.sendall(reply)


def say(text):
    print(text, flush=True)


def find_program():
    """relign-bench: in PATH, else in the clone that this file lies in."""
    clone = pathlib.Path(__file__).resolve().parents[2]
    built = clone / "build" / "release" / "bin" / "relign-bench"
    for place in (shutil.which("relign-bench"), clone / "relign-bench", built):
        if place and os.access(place, os.X_OK):
            return str(place)
    return None


def main():
    words = argparse.ArgumentParser(description="Plays a station's hexapod, camera and loader on a local TCP port.")
    words.add_argument("--port", type=int, default=7001, help="TCP port; 0: any free one, which is printed")
    words.add_argument("--program", default=find_program(), help="relign-bench [default: in PATH or in this clone]")
    words.add_argument("--batch", type=int, default=1, help="another number, other lenses")
    words.add_argument(
        "--drop-at", type=int, default=0, metavar="N",
        help="break the connection in the middle of picture N, once, to see what the benchmark says",
    )
    given = words.parse_args()
    if given.program is None:
        words.error("relign-bench is neither in PATH nor in this clone; say where it is with --program")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with tempfile.TemporaryDirectory(prefix="station-") as folder:
        camera = Camera(given.program, folder)
        try:
            with socket.create_server(("127.0.0.1", given.port)) as door:
                camera.snap(Lens(given.batch, 0), LOADED_AT)  # says now what would else fail in the first trial
                say("listening on 127.0.0.1:%d" % door.getsockname()[1])
                Line(Machine(camera, given.batch), given.drop_at).serve(door)
        except (OSError, RuntimeError) as error:
            sys.exit("%s: %s" % (pathlib.Path(__file__).name, error))
        except KeyboardInterrupt:
            pass


if __name__ == "__main__":
    main()
