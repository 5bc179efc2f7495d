"""The station behind `relign_bench.Method`: it asks the program that owns the machine for every capture.

Messages to the program are `capture` with the commanded pose in shares of the travel from the start, and its answers are
`{"shape": ..., "seconds": ..., "moved": ...}` followed by the pixels as float32 values.
"""

from __future__ import annotations

import json
from multiprocessing.connection import Client

from relign_bench.plugin import Moved, Station, parameter, serve

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from relign_bench.plugin.scenes import Pose


class LoopStation(Station):
    """A machine in somebody's own loop."""

    id = "relign_loop"
    address = parameter(type="text", description="Socket of the program")

    def __init__(self) -> None:
        self.program = Client(self.address, family="AF_UNIX")
        self.set_up = json.loads(self.program.recv_bytes())
        self.goal = self.program.recv_bytes()
        self.range = self.set_up["range"]
        self.pose = [0.0] * len(self.range)

    def describe(self) -> dict[str, Any]:
        """One axis for each of the program's, from the start pose."""
        height, width = self.set_up["shape"]
        # Units and travel of real axes are the program's own; a description allows mm and deg, and methods see shares.
        axes = [{"name": name, "unit": "mm", "lower": 0.0, "upper": travel} for name, travel in self.set_up["axes"]]
        return {"name": "relign_loop", "axes": axes, "image": {"width": width, "height": height, "white": 1.0}}

    def reference(self) -> bytes:
        """The program's goal."""
        return self.goal

    def begin(self, seed: int) -> None:
        """Begins at the start pose, where the program's machine is."""
        self.pose = [0.0] * len(self.range)

    def move_by(self, delta: Pose) -> Moved:
        """Moves within the program's bounds."""
        wanted = [at + step for at, step in zip(self.pose, delta)]
        reached = [min(max(value, low), high) for value, (low, high) in zip(wanted, self.range)]
        moved = [there - here for there, here in zip(reached, self.pose)]
        limits = [(value > high) - (value < low) for value, (low, high) in zip(wanted, self.range)]
        self.pose = reached
        return Moved(moved, 0.0, limits)

    def capture(self) -> tuple[bytes, float]:
        """What the program measures at the pose."""
        self.program.send_bytes(json.dumps(self.pose).encode())
        seconds = json.loads(self.program.recv_bytes())
        return self.program.recv_bytes(), seconds


if __name__ == "__main__":
    serve(LoopStation)
