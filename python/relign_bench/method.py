"""The benchmark's methods for your own loop over your own machine: ask for a pose, tell its measured value."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import queue
import shutil
import socket
import tempfile
import threading
import weakref
from collections.abc import Mapping
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._errors import require_integer, require_number
from .bench import LARGEST_BUDGET, trial_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import numpy.typing as npt

    from ._typing import Float64Array, Parameters, Plugin
    from .bench import Trial

STATION = pathlib.Path(__file__).with_name("_loop_station.py")
WAIT_VARIABLE = "RELIGN_CALL_SECONDS"
LARGEST_AXES = 64  # as of scenes (core/foundation/base/limits.h)
LARGEST_BOUND = 1e300
FINEST_RANGE = 1e-12  # of the larger bound, which leaves some thousand numbers between the bounds
LONGEST_SOCKET_FOLDER = 80  # bytes; the whole path of a socket may have 107 on Linux
LONGEST_WAIT_S = 7 * 24 * 3600  # for a measurement; the host's own limit for an answer of a station is a minute


class Method:
    """A method of the benchmark, C++ or Python, that steers a machine which you measure.

        method = Method("nlopt-bobyqa", {"x": (-0.5, 0.5), "y": (-0.5, 0.5)}, steps=50)
        while (pose := method.ask()) is not None:
            method.tell(measure(**pose))
        print(method.best)

    The first pose is the start pose; it costs no step. Poses keep the bounds of the axes. A value is a number, smaller is
    better, such as an error or a distance; with `reference` it is an image. The method observes its distance from the
    goal: abs(value - goal), or the RMSE between image and reference. One method object is one alignment. Threads may share
    it, and wait for each other; it cannot be copied, pickled, or used in a process forked from its own. Methods observe
    measurements in single precision; `best` has them as they were told.

    Args:
        algorithm: Id, preset or path of an algorithm, or an object as in a suite; not one that needs the design or the true
            start. One that needs other axes, or a model of the machine, fails at the `ask` after the first value, since it
            begins only then.
        axes: (lower, upper) by name, in your units; at most 64 axes, and bounds within 1e300.
        steps: Budget, in steps after the start pose; at most 100,000.
        start: Start pose by name; by default the middle of all axes.
        seed: Seed of the method. Equal seeds and equal measurements give equal poses.
        parameters: Parameters of the algorithm.
        reference: Image of a perfect machine, shape (height, width), for methods that observe images; then values are images.
        goal: The lowest value that can be measured, noise included: methods take it for the best that can be.

    Attributes:
        recommended: The pose that the method recommends, once it has ended well; None before, and after `close` or an error.
        end: None while the method runs, then "budget_spent" or "finished"; "closed" after an early `close`; after an error
            "failed" or another end of a trial that `relign-bench explain` lists.

    Raises:
        ValueError: An argument is not valid.
    """

    def __init__(self, algorithm: Plugin, axes: Mapping[str, tuple[float, float]], steps: int = 50,
                 start: Mapping[str, float] | None = None, seed: int = 1, parameters: Parameters | None = None,
                 reference: npt.ArrayLike | None = None, goal: float = 0.0) -> None:
        algorithm, parameters = _native.chosen_plugin("algorithm", algorithm, parameters)
        self._names, self._bounds = _bounds(axes)
        self._start = _start_pose(self._names, self._bounds, start)
        # The search box is half a travel to both sides of the start, so the farther bound decides the travel.
        reach = self._bounds - self._start[:, None]
        self._travel = 2 * np.abs(reach).max(axis=1)
        self._lowest = require_number(goal, "goal")  # subtracted before anything is rounded to float32
        with np.errstate(over="ignore"):  # an infinite value is refused below
            self._goal = np.zeros((1, 1), np.float32) if reference is None else _numbers(
                reference, "reference must be an image of shape (height, width)").astype(np.float32)
        if self._goal.ndim != 2 or not self._goal.size or not np.isfinite(self._goal).all():
            raise ValueError("reference must be a finite image of shape (height, width), found shape "
                             f"{self._goal.shape}{'' if np.isfinite(self._goal).all() else ' with other values'}")
        self._scalar = reference is None
        self._exact_goal = self._goal if reference is None else np.asarray(reference, np.float64)
        self._best: tuple[dict[str, float], float] | None = None
        self.recommended: dict[str, float] | None = None
        self.end: str | None = None
        self._failure = ""
        self._asked: tuple[int, dict[str, float]] | None = None  # number of the pose, and the pose
        self._process, self._lock = os.getpid(), threading.RLock()
        set_up = {"shape": self._goal.shape, "range": (reach / self._travel[:, None]).tolist(),
                  "axes": [[name, travel] for name, travel in zip(self._names, self._travel.tolist())]}
        self._trial = _Trial(algorithm, require_integer(steps, "steps", 1, LARGEST_BUDGET), require_integer(seed, "seed", 0),
                             parameters, set_up, self._goal)

    def __reduce__(self) -> str:
        """Refuses copies, whose end would close the connection of this method.

        Raises:
            TypeError: Always.
        """
        raise TypeError("a Method cannot be copied or pickled; make a new one")

    def _require_own_process(self) -> None:
        if self._process != os.getpid():
            raise RuntimeError("a Method cannot be used in another process than its own; make a new one there")

    @property
    def best(self) -> tuple[dict[str, float], float] | None:
        """A copy of (pose, value) of the lowest value so far; for images the value is the RMSE. None before the first."""
        return None if self._best is None else (dict(self._best[0]), self._best[1])

    def ask(self) -> dict[str, float] | None:
        """The next pose to measure, by name of the axis; the same one until `tell` has its value. None at the end.

        Raises:
            RuntimeError: The method failed, and the message is its own, the same at every further call; or it was made in
                another process.
        """
        self._require_own_process()
        with self._lock:
            if self._failure:
                raise RuntimeError(self._failure)
            if not self.waits and self.end is None:
                shares = self._trial.next_pose()
                if shares is None:
                    self._finish()
                else:
                    self._asked = self._trial.answered, self._pose(shares)
            return dict(self._asked[1]) if self._asked is not None and self.waits else None

    def tell(self, measured: float | npt.ArrayLike, seconds: float = 0.0) -> None:
        """The value measured at the pose of the latest `ask`.

        Args:
            measured: The value, or with `reference` the image, shape (height, width).
            seconds: Machine time that the move and the measurement took.

        Raises:
            ValueError: It is not a finite number, below the goal, or has another shape. The pose still waits for its value.
            RuntimeError: No pose waits for its value, or the method was made in another process.
        """
        self._require_own_process()
        with self._lock:
            self._tell(measured, seconds)

    def _tell(self, measured: float | npt.ArrayLike, seconds: float) -> None:
        wanted = "a number" if self._scalar else f"an image of shape {self._goal.shape}"
        if self._asked is None or not self.waits:
            raise RuntimeError("no pose waits for a value: call ask() before tell()")
        with np.errstate(over="ignore"):  # an infinite value is refused below
            numbers = _numbers(measured, f"a measurement must be {wanted}")
            exact = np.atleast_2d(numbers) - (self._lowest if self._scalar else 0.0)
            pixels = exact.astype(np.float32)
        if pixels.shape != self._goal.shape:
            raise ValueError(f"expected {wanted}, found shape {np.shape(measured)}")
        if not np.isfinite(pixels).all():
            raise ValueError("the measurement is not finite, or farther than 3.4e38 from the goal; tell a large value where "
                             "nothing could be measured")
        if require_number(seconds, "seconds") < 0:
            raise ValueError(f"seconds must be a finite number of at least 0, not {seconds!r}")
        if self._scalar and pixels < 0:
            raise ValueError(f"{measured!r} is below the goal {self._lowest:g}: set goal to the lowest value that can be "
                             "measured, noise included")
        value = numbers.item() if self._scalar else float(np.sqrt(np.mean((exact - self._exact_goal) ** 2)))
        if self._best is None or value < self._best[1]:
            self._best = (self._asked[1], value)
        self._trial.answer(pixels.tobytes(), float(seconds))

    @property
    def waits(self) -> bool:
        """Whether a pose was asked for that has no value yet. An interrupted `tell` (Ctrl-C) leaves it or ends it."""
        return self._asked is not None and self._asked[0] == self._trial.answered

    def close(self) -> None:
        """Ends the method early, once an `ask` of another thread has its pose. Of no effect in another process.

        A method that is computing ends when it asks for its next pose; `close` waits for this, at most 10 s.
        """
        if self._process == os.getpid():
            with self._lock:
                self._asked, self.end = None, self.end or "closed"
                self._trial.close()

    def __enter__(self) -> Method:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _finish(self) -> None:
        trial = self._trial.record()
        if trial.ended_well:
            self.recommended = self._pose(trial.steps[-1]["recommended_pose"])
        self.end = trial.end
        if not trial.ended_well:
            self._failure = f"the method failed: {trial.message or trial.end}"
            raise RuntimeError(self._failure)

    def _pose(self, shares: Sequence[float]) -> dict[str, float]:
        pose = self._start + np.asarray(shares) * self._travel
        return dict(zip(self._names, np.clip(pose, *self._bounds.T).tolist()))


def _numbers(values: npt.ArrayLike, rule: str) -> Float64Array:
    """Numbers as an array; texts, None and masked values are refused, of which numpy would make numbers."""
    if np.ma.is_masked(values):
        raise ValueError(f"{rule}, without masked values: a masked value is not a number")
    try:
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = np.array([float(value) for value in array.flat]).reshape(array.shape)
        if array.dtype.kind not in "biuf":
            raise TypeError
        return array.astype(np.float64)
    except OverflowError:
        raise ValueError(f"{rule}, of at most 1.8e308") from None
    except (TypeError, ValueError):
        raise ValueError(f"{rule}, not {values!r}") from None


def _bounds(axes: Mapping[str, tuple[float, float]]) -> tuple[list[str], Float64Array]:
    """(names, bounds of shape (axes, 2))."""
    if not isinstance(axes, Mapping) or not axes:
        raise ValueError(f"axes must be (lower, upper) by name, such as {{'x': (-0.5, 0.5)}}, not {axes!r}")
    if len(axes) > LARGEST_AXES:
        raise ValueError(f"a method moves at most {LARGEST_AXES} axes, not {len(axes)}")
    bounds = []
    for name, pair in axes.items():
        if not isinstance(name, str) or not name:
            raise ValueError(f"axes must be (lower, upper) by name; a name must be a text of at least one letter, not {name!r}")
        try:
            first, second = pair
        except (TypeError, ValueError):
            raise ValueError(f"axes must be (lower, upper) by name; axis '{name}' has {pair!r}") from None
        lower, upper = require_number(first, f"a bound of axis '{name}'"), require_number(second, f"a bound of axis '{name}'")
        if lower >= upper:
            raise ValueError(f"axis '{name}' must have its lower bound below its upper one, not {pair!r}")
        largest = max(abs(lower), abs(upper))
        if largest > LARGEST_BOUND:
            raise ValueError(f"axis '{name}' must have bounds from -{LARGEST_BOUND:g} to {LARGEST_BOUND:g}, not {pair!r}: "
                             "choose another unit")
        if upper - lower < FINEST_RANGE * largest:
            raise ValueError(f"axis '{name}' must have bounds that differ by at least {FINEST_RANGE:g} of the larger one, not "
                             f"{pair!r}: choose another origin")
        bounds.append((lower, upper))
    return list(axes), np.array(bounds)


def _start_pose(names: list[str], bounds: Float64Array, start: Mapping[str, float] | None) -> Float64Array:
    if start is None:
        return bounds.mean(axis=1)
    if not isinstance(start, Mapping) or set(start) != set(names):
        raise ValueError(f"start must have a value for each of {', '.join(names)}, by name, not {start!r}")
    pose = [require_number(start[name], f"start of axis '{name}'") for name in names]
    for name, value, (lower, upper) in zip(names, pose, bounds.tolist()):
        if not lower <= value <= upper:
            raise ValueError(f"start of axis '{name}' must be from {lower:g} to {upper:g}, not {value:g}")
    return np.array(pose)


class _Trial:
    """The trial in a thread of its own, and the messages with its station.

    Raises:
        ValueError: The algorithm or its parameters are not valid.
    """

    def __init__(self, algorithm: str, steps: int, seed: int, parameters: Parameters | None, set_up: dict[str, Any],
                 goal: Any) -> None:
        long = len(os.fsencode(tempfile.gettempdir())) > LONGEST_SOCKET_FOLDER
        folder = tempfile.mkdtemp(prefix="relign-", dir="/tmp" if long else None)
        address = os.path.join(folder, "station")
        self._outcome: dict[str, Any] = {}
        ended, ends = Pipe(duplex=False)
        arguments = (address, algorithm, steps, seed, parameters, self._outcome, ends)
        thread = threading.Thread(target=_run, args=arguments, daemon=True)
        self._messages = _Messages()
        self.close = weakref.finalize(self, _close, self._messages, thread, folder, os.getpid())
        connection = None
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(address)
            server.listen()
            thread.start()
            if server in wait([server, ended]):
                connection = self._messages.accept(server)
                connection.send_bytes(json.dumps(set_up).encode())
                connection.send_bytes(goal.tobytes())
        threading.Thread(target=self._messages.run, args=(connection, ended), daemon=True).start()
        self.next_pose()

    @property
    def answered(self) -> int:
        """Poses that have their values."""
        return len(self._messages.answers)

    def next_pose(self) -> list[float] | None:
        """Shares of the travel from the start; the same until `answer`. None when the trial has ended."""
        pose = self._messages.next_pose()
        if pose is None and "error" in self._outcome:
            raise self._outcome["error"]
        return pose

    def answer(self, pixels: bytes, seconds: float) -> None:
        """What was captured at the next pose."""
        self._messages.answer(json.dumps(seconds).encode(), pixels)

    def record(self) -> Trial:
        """The trial that has ended."""
        if "lines" not in self._outcome:
            raise RuntimeError("the method was closed")
        return trial_of(self._outcome["lines"])


class _Messages:
    """The messages with the station, in a thread that Ctrl-C cannot interrupt, since that reaches the main thread only.

    Others read `poses` and append to `answers`: an interrupt finds an answer given or not given.
    """

    def __init__(self) -> None:
        self.poses: list[list[float]] = []
        self.answers: list[tuple[bytes, ...]] = []
        self._asked: queue.SimpleQueue[None] = queue.SimpleQueue()  # wakes who waits for a pose
        self._told: queue.SimpleQueue[None] = queue.SimpleQueue()  # wakes the thread
        self._over = self._closed = False
        self._held: socket.socket | None = None

    def accept(self, server: socket.socket) -> Connection:
        """The connection of the station."""
        accepted, _ = server.accept()
        self._held = accepted.dup()  # for `close`: the thread may close the connection meanwhile
        return Connection(accepted.detach())

    def run(self, connection: Connection | None, ended: Connection) -> None:
        """The thread: until the trial has ended, when `ended` becomes readable."""
        try:
            while connection is not None and connection in wait([connection, ended]):
                self.poses.append(json.loads(connection.recv_bytes()))
                self._asked.put(None)
                while len(self.answers) < len(self.poses):
                    self._told.get()
                    if self._closed:
                        return
                for part in self.answers[-1]:
                    connection.send_bytes(part)
                self.answers[-1] = ()  # frees the image
        except (EOFError, OSError):  # the station has ended, and so will the trial
            pass
        finally:
            if connection is not None:
                connection.close()
            wait([ended])
            self._over = True
            self._asked.put(None)

    def next_pose(self) -> list[float] | None:
        """The pose that waits for its answer, once it has come; None when the trial has ended."""
        while len(self.poses) == len(self.answers) and not self._over:
            self._told.put(None)  # an interrupt may have kept `answer` from it
            self._asked.get()
        return self.poses[-1] if len(self.poses) > len(self.answers) else None

    def answer(self, *parts: bytes) -> None:
        """The answer to the latest pose."""
        self.answers.append(parts)
        self._told.put(None)

    def close(self) -> None:
        """The station fails, and with it the trial."""
        self._closed = True
        self._told.put(None)
        if self._held is not None:
            with self._held, contextlib.suppress(OSError):
                self._held.shutdown(socket.SHUT_RDWR)  # a forked process keeps the connection open


def _run(address: str, algorithm: str, steps: int, seed: int, parameters: Parameters | None, outcome: dict[str, Any],
         ends: Connection) -> None:
    """The thread: a trial on the station. Leaves "lines" or "error" in `outcome`, then writes to `ends`."""
    try:
        with _waiting_long():
            trials = _native.make_trials(str(STATION), {"address": address}, "none", None, seed, 1)
        outcome["lines"], _ = trials.run(str(algorithm), _native.parameters_text(parameters), 0, "paper", "", "soft", steps,
                                         False)
    except Exception as error:  # noqa: BLE001 (raised in the thread that asks)
        error.args = (str(error).replace("the station 'relign_loop'", "a machine in your own loop"),)
        outcome["error"] = error
    finally:
        with contextlib.suppress(OSError):
            ends.send_bytes(b"ended")  # a forked process keeps the pipe open
        ends.close()


_environment = threading.Lock()


@contextlib.contextmanager
def _waiting_long() -> Iterator[None]:
    """Stations that are loaded meanwhile may take as long for a capture as somebody's machine needs."""
    with _environment:
        before = os.environ.get(WAIT_VARIABLE)
        os.environ[WAIT_VARIABLE] = str(LONGEST_WAIT_S)
        try:
            yield
        finally:
            if before is None:
                del os.environ[WAIT_VARIABLE]
            else:
                os.environ[WAIT_VARIABLE] = before


def _close(messages: _Messages, thread: threading.Thread, folder: str, process: int) -> None:
    if process != os.getpid():  # forked: all of this is the other process's
        return
    try:
        messages.close()
        if thread.ident is not None:
            thread.join(10)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
