"""Simulates a station over TCP: a hexapod that holds a lens in front of a camera, with its loader. See README.md.

Images come from `relign-bench render`. For every lens this program draws how the gripper holds it, how the hexapod's moves
are distorted and how its elements are offset; no client can ask for these.
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
LOADED_AT = (0.0, 0.0, -0.2, 0.0, 0.0)  # where the hexapod takes a lens, slightly away from the camera
SPEED = 5.0  # mm/s and deg/s
SETTLING_S, EXPOSURE_S, READOUT_S = 0.040, 0.015, 0.030
WIDTH = HEIGHT = 200
COUNTS_AT_1 = 65535  # the camera's count at irradiance 1, where it saturates

# The simulated scene relign_od, whose travel is longer than the hexapod's.
SCENE_TRAVEL = (1.0, 1.0, 1.0, 7.0, 7.0)
ELEMENTS = ("L3", "L4")
GRIP = 0.2  # largest offset of a lens in the gripper, per axis, as a share of the scene's travel
DISTORTION, SHIFT_MM, TILT_DEG = 0.01, 0.0002, 0.4  # standard deviations


class Lens:
    """Ground truth: one lens in the gripper, and the stage that moves it."""

    def __init__(self, batch, seed):
        rng = random.Random(f"batch {batch} lens {seed}")
        axes = range(len(AXES))
        self.grip = [rng.uniform(-GRIP, GRIP) for _ in axes]
        self.distortion = [[float(row == column) + rng.gauss(0, DISTORTION) for column in axes] for row in axes]
        self.elements = {
            name: {
                "shift_mm": [rng.gauss(0, SHIFT_MM) for _ in range(3)],
                "tilt_deg": [rng.gauss(0, TILT_DEG) for _ in range(2)],
            }
            for name in ELEMENTS
        }
        self.rng = rng  # for the camera's noise

    def true_pose(self, position):
        """The simulator's true pose, 0 to 1 along each axis, for a position of the hexapod's encoders."""
        share = [value / (2 * travel) for value, travel in zip(position, SCENE_TRAVEL)]
        moved = [sum(entry * value for entry, value in zip(row, share)) for row in self.distortion]
        # The mechanical stops are at 0 and 1.
        return [min(max(0.5 + grip + move, 0.0), 1.0) for grip, move in zip(self.grip, moved)]


class Camera:
    """Images by `relign-bench render`."""

    def __init__(self, program, folder):
        self.program = program
        self.folder = pathlib.Path(folder)

    def snap(self, lens, position):
        """Counts of 16 bits, row 0 on top."""
        pose = ",".join(repr(value) for value in lens.true_pose(position))
        assembly, picture = self.folder / "assembly.json", self.folder / "picture.npy"
        assembly.write_text(json.dumps({"elements": lens.elements}))
        command = [self.program, "render", "--scene", "relign_od", "--assembly", assembly, "--pose", pose]
        command += ["--seed", str(lens.rng.getrandbits(63)), "--out", picture]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
        if done.returncode != 0:
            message = done.stderr.decode(errors="replace").strip().replace("\n", "; ")
            raise RuntimeError("relign-bench render failed: " + message)
        data = picture.read_bytes()
        (header,) = struct.unpack_from("<H", data, 8)  # .npy: magic, version, length of the header, header, values
        light = array.array("f", data[10 + header :])
        return array.array("H", [min(int(value * COUNTS_AT_1 + 0.5), COUNTS_AT_1) for value in light])


class Machine:
    """The commands. A method returns the rest of the answer's line; it raises errors with one-line messages."""

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
        """The line of the answer, and the bytes that follow it."""
        name, *words = line.split()
        if name not in self.commands:
            raise ValueError(f"unknown command '{name}'; commands: {', '.join(self.commands)}")
        try:
            text = self.commands[name](*words)
        except TypeError:
            raise ValueError(f"wrong number of arguments for {name}") from None
        text, data = text if isinstance(text, tuple) else (text, b"")
        return "OK " + text, data

    def identity(self):
        return "relign-bench example station 1"

    def next(self, seed):
        """Loads a lens, which the hexapod takes at LOADED_AT. Equal seeds give equal lenses; real loaders count trays."""
        if not seed.isdigit():
            raise ValueError(f"NEXT takes a non-negative integer, found '{seed}'")
        self.lens = Lens(self.batch, int(seed))
        self.position = list(LOADED_AT)
        self.limits = [0] * len(AXES)
        return "loaded"

    def move(self, *words):
        """Moves all axes by mm and degrees; each axis stops at its limit. Returns the duration in seconds."""
        delta = [float(word) for word in words]
        if len(delta) != len(AXES) or not all(math.isfinite(value) for value in delta):
            raise ValueError(f"MOVE takes {len(AXES)} finite numbers: {' '.join(AXES)} in mm and degrees")
        before = self.position
        # The encoders' resolution is 1 nm and a millionth of a degree.
        asked = [round(value + change, 6) for value, change in zip(before, delta)]
        self.position = [min(max(value, -travel), travel) for value, travel in zip(asked, TRAVEL)]
        self.limits = [(value > travel) - (value < -travel) for value, travel in zip(asked, TRAVEL)]
        longest = max(abs(after - value) for after, value in zip(self.position, before))
        return f"{longest / SPEED + SETTLING_S:.3f}"

    def where(self):
        return " ".join(f"{value:.6f}" for value in self.position)

    def met(self):
        """Limits that the last move met: -1 lower, 1 upper, 0 neither."""
        return " ".join(str(value) for value in self.limits)

    def snap(self):
        """Captures. Returns duration in seconds, width and height, then the counts, two bytes each, low byte first."""
        if self.lens is None:
            raise RuntimeError("no lens is loaded; send NEXT first")
        counts = self.camera.snap(self.lens, self.position)
        if sys.byteorder == "big":
            counts.byteswap()
        return f"{EXPOSURE_S + READOUT_S:.3f} {WIDTH} {HEIGHT}", counts.tobytes()


class Line:
    """Serves one connection after the other."""

    def __init__(self, machine, drop_at):
        self.machine = machine
        self.drop_at = drop_at  # number of the image in whose middle the connection breaks; 0: never
        self.images = 0

    def serve(self, door):
        while True:
            connection, _ = door.accept()
            with connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                try:
                    self.serve_client(connection)
                except OSError as error:
                    say(f"connection lost: {error}")

    def serve_client(self, connection):
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
                text, data = f"ERR {error}", b""
            reply = text.replace("\n", " ").encode() + b"\n" + data
            self.images += bool(data)
            if data and self.images == self.drop_at:
                say(f"dropping the connection in the middle of image {self.images}")
                connection.sendall(reply[: len(reply) // 2])
                return
            connection.sendall(reply)


def say(text):
    print(text, flush=True)


def find_program():
    """Path of relign-bench: in PATH, else in the clone that has this file."""
    clone = pathlib.Path(__file__).resolve().parents[2]
    built = clone / "build" / "release" / "bin" / "relign-bench"
    for place in (shutil.which("relign-bench"), clone / "relign-bench", built):
        if place and os.access(place, os.X_OK):
            return str(place)
    return None


def main():
    parser = argparse.ArgumentParser(description="Simulate a station's hexapod, camera and loader on a local TCP port.")
    parser.add_argument("--port", type=int, default=7001,
                        help="TCP port; 0: a free one, which is printed [default: %(default)s]")
    parser.add_argument("--program", default=find_program(), help="path of relign-bench [default: in PATH or in this clone]")
    parser.add_argument("--batch", type=int, default=1, help="seed of the lenses [default: %(default)s]")
    parser.add_argument("--drop-at", type=int, default=0, metavar="N",
                        help="break the connection once, in the middle of image N, to test how the benchmark handles it")
    given = parser.parse_args()
    if given.program is None:
        parser.error("relign-bench is neither in PATH nor in this clone; name it with --program")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with tempfile.TemporaryDirectory(prefix="station-") as folder:
        camera = Camera(given.program, folder)
        try:
            with socket.create_server(("127.0.0.1", given.port)) as door:
                camera.snap(Lens(given.batch, 0), LOADED_AT)  # reports an error now instead of in the first trial
                say(f"listening on 127.0.0.1:{door.getsockname()[1]}")
                Line(Machine(camera, given.batch), given.drop_at).serve(door)
        except (OSError, RuntimeError) as error:
            sys.exit(f"{pathlib.Path(__file__).name}: {error}")
        except KeyboardInterrupt:
            pass


if __name__ == "__main__":
    main()
