"""A station as a scene of the benchmark: a hexapod, a camera and a loader behind a line protocol over TCP."""
import array
import socket
import struct
import sys

from relign_bench.plugin import Moved, Station, parameter, serve

AXES = (("x", "mm", 0.5), ("y", "mm", 0.5), ("z", "mm", 0.5), ("rx", "deg", 3.5), ("ry", "deg", 3.5))
TRAVEL = [2 * half for _, _, half in AXES]  # the benchmark moves in shares of the travel, 0 to 1
WIDTH = HEIGHT = 200
COUNTS_AT_1 = 65535  # captures and reference must be in one unit: here irradiance, where the camera saturates at 1


class Line:
    """One command, one answer. Whatever goes wrong is one sentence that says with whom and during what."""

    def __init__(self, host, port, timeout_s):
        self.name = "%s:%d" % (host, port)
        try:
            self.socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            raise RuntimeError("no station answers at %s: %s" % (self.name, error)) from None
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.answers = self.socket.makefile("rb")

    def ask(self, command):
        """The words of the answer."""
        try:
            self.socket.sendall(command.encode("ascii") + b"\n")
            line = self.answers.readline(1000)
        except OSError as error:
            raise RuntimeError("the station %s did not answer '%s': %s" % (self.name, command, error)) from None
        if not line.endswith(b"\n"):
            raise RuntimeError("the station %s dropped the connection during '%s'" % (self.name, command))
        status, *words = line.decode("ascii", errors="replace").split()
        if status != "OK":
            raise RuntimeError("the station %s refused '%s': %s" % (self.name, command, " ".join(words)))
        return words

    def numbers(self, command, count=len(AXES)):
        words = self.ask(command)
        if len(words) != count:
            raise RuntimeError("%d numbers expected after '%s', found '%s'" % (count, command, " ".join(words)))
        return [float(word) for word in words]

    def data(self, size, command):
        """What comes behind an answer's line."""
        try:
            data = self.answers.read(size)
        except OSError as error:
            raise RuntimeError("the station %s stopped in '%s': %s" % (self.name, command, error)) from None
        if len(data) != size:
            raise RuntimeError(
                "the station %s dropped the connection during '%s': %d of %d bytes came"
                % (self.name, command, len(data), size)
            )
        return data


class BenchStation(Station):
    id = "bench_station"

    host = parameter("127.0.0.1", description="where the station listens")
    port = parameter(7001, minimum=1, maximum=65535)
    timeout_s = parameter(
        30.0, minimum=0.1, maximum=3600.0, unit="s", description="longest wait for one answer of the station"
    )
    golden_image = parameter(
        "golden.npy", type="file", description="what a perfect lens shows: .npy, float32, as large as a capture"
    )

    line = None  # made with the first trial: describing and validating need no machine

    def describe(self):
        return {
            "name": "bench_station",
            "summary": "Hexapod and camera at %s:%d" % (self.host, self.port),
            "axes": [{"name": name, "unit": unit, "lower": -half, "upper": half} for name, unit, half in AXES],
            "image": {"width": WIDTH, "height": HEIGHT, "white": 0.115},  # white: what pictures show as white
        }

    def reference(self):
        with open(self.golden_image, "rb") as file:
            data = file.read()
        if data[:6] != b"\x93NUMPY" or b"'<f4'" not in data[:128]:
            raise ValueError("%s: expected an .npy file of float32 values" % self.golden_image)
        (header,) = struct.unpack_from("<H", data, 8)
        return array.array("f", data[10 + header :])

    def begin(self, seed):
        """The next lens, at a start pose. Nobody counts the time of loading."""
        if self.line is None:
            self.line = Line(self.host, self.port, self.timeout_s)
        self.line.ask("NEXT %d" % seed)

    def move_by(self, delta):
        before = self.line.numbers("POS?")
        amounts = ["%.6f" % (share * travel) for share, travel in zip(delta, TRAVEL)]
        # A station of your own may have no clock: then take time.monotonic() before and after.
        (seconds,) = self.line.numbers("MOVE " + " ".join(amounts), count=1)
        after = self.line.numbers("POS?")
        return Moved(
            # By the encoders: a limit, or a controller that rounds, makes less of a move than was asked for.
            moved=[(there - here) / travel for here, there, travel in zip(before, after, TRAVEL)],
            machine_seconds=seconds,
            limits=[int(limit) for limit in self.line.numbers("LIMITS?")],
        )

    def capture(self):
        seconds, width, height = self.line.numbers("SNAP", count=3)
        if (width, height) != (WIDTH, HEIGHT):
            raise RuntimeError("pictures of %d x %d pixels expected, found %d x %d" % (WIDTH, HEIGHT, width, height))
        counts = array.array("H", self.line.data(2 * WIDTH * HEIGHT, "SNAP"))
        if sys.byteorder == "big":
            counts.byteswap()
        return array.array("f", [count / COUNTS_AT_1 for count in counts]), seconds


if __name__ == "__main__":
    serve(BenchStation)
