"""A station as a scene of the benchmark: a hexapod, a camera and a loader behind a line protocol over TCP."""
import array
import math
import socket
import struct
import sys

from relign_bench.plugin import Moved, Station, parameter, serve

AXES = (("x", "mm", 0.5), ("y", "mm", 0.5), ("z", "mm", 0.5), ("rx", "deg", 3.5), ("ry", "deg", 3.5))
TRAVEL = [2 * half for _, _, half in AXES]  # the benchmark's moves are shares of the travel
WIDTH = HEIGHT = 200
COUNTS_AT_1 = 65535  # captures and reference need the same unit: here irradiance, at which the camera saturates at 1


class Line:
    """A connection with one answer per command. Error messages name the station and the command."""

    def __init__(self, host, port, timeout_s):
        self.name = f"{host}:{port}"
        try:
            self.socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            raise RuntimeError(f"no station answers at {self.name}: {error}") from None
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.answers = self.socket.makefile("rb")

    def ask(self, command):
        """The words of the answer."""
        try:
            self.socket.sendall(command.encode("ascii") + b"\n")
            line = self.answers.readline(1000)
        except OSError as error:
            raise RuntimeError(f"the station {self.name} did not answer '{command}': {error}") from None
        if not line.endswith(b"\n"):
            raise RuntimeError(f"the station {self.name} dropped the connection during '{command}'")
        status, *words = line.decode("ascii", errors="replace").split()
        if status != "OK":
            raise RuntimeError(f"the station {self.name} refused '{command}': {' '.join(words)}")
        return words

    def numbers(self, command, count=len(AXES)):  # noqa: B008
        """The numbers of the answer."""
        words = self.ask(command)
        if len(words) != count:
            raise RuntimeError(f"expected {count} numbers after '{command}', found '{' '.join(words)}'")
        return [float(word) for word in words]

    def data(self, size, command):
        """The bytes that follow an answer's line."""
        try:
            data = self.answers.read(size)
        except OSError as error:
            raise RuntimeError(f"the station {self.name} stopped in '{command}': {error}") from None
        if len(data) != size:
            raise RuntimeError(
                f"the station {self.name} dropped the connection during '{command}': {len(data)} of {size} bytes came"
            )
        return data


class BenchStation(Station):
    id = "bench_station"

    host = parameter("127.0.0.1", description="address of the station")
    port = parameter(7001, minimum=1, maximum=65535)
    timeout_s = parameter(
        30.0, minimum=0.1, maximum=3600.0, unit="s", description="time limit for one answer of the station"
    )
    golden_image = parameter(
        "golden.npy", type="file", description="image of a perfect lens: .npy, float32, as large as a capture"
    )

    line = None  # made in the first trial: `describe` and `validate` need no machine

    def describe(self):
        return {
            "name": "bench_station",
            "summary": f"Hexapod and camera at {self.host}:{self.port}",
            "axes": [{"name": name, "unit": unit, "lower": -half, "upper": half} for name, unit, half in AXES],
            "image": {"width": WIDTH, "height": HEIGHT, "white": 0.115},  # white: the value of a white pixel
        }

    def reference(self):
        with open(self.golden_image, "rb") as file:
            data = file.read()
        if data[:6] != b"\x93NUMPY" or b"'<f4'" not in data[:128]:
            raise ValueError(f"{self.golden_image}: expected an .npy file of float32 values")
        (header,) = struct.unpack_from("<H", data, 8)
        pixels = array.array("f", data[10 + header :])
        if not all(map(math.isfinite, pixels)):
            raise ValueError(f"{self.golden_image} has pixels without a finite value")
        return pixels

    def begin(self, seed):
        """Loads the next lens and moves to a start pose. The time for it does not count."""
        if self.line is None:
            self.line = Line(self.host, self.port, self.timeout_s)
        self.line.ask(f"NEXT {seed}")

    def move_by(self, delta):
        before = self.line.numbers("POS?")
        amounts = ["%.6f" % (share * travel) for share, travel in zip(delta, TRAVEL)]
        # If your station reports no durations, call time.monotonic() before and after.
        (seconds,) = self.line.numbers("MOVE " + " ".join(amounts), count=1)
        after = self.line.numbers("POS?")
        return Moved(
            # By the encoders: limits and rounding make a move differ from the command.
            moved=[(there - here) / travel for here, there, travel in zip(before, after, TRAVEL)],
            machine_seconds=seconds,
            limits=[int(limit) for limit in self.line.numbers("LIMITS?")],
        )

    def capture(self):
        seconds, width, height = self.line.numbers("SNAP", count=3)
        if (width, height) != (WIDTH, HEIGHT):
            raise RuntimeError(f"expected images of {WIDTH} x {HEIGHT} pixels, found {width:g} x {height:g}")
        counts = array.array("H", self.line.data(2 * WIDTH * HEIGHT, "SNAP"))
        if sys.byteorder == "big":
            counts.byteswap()
        return array.array("f", [count / COUNTS_AT_1 for count in counts]), seconds


if __name__ == "__main__":
    serve(BenchStation)
