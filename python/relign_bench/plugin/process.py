"""The plugin's process: messages to and from the host that started it (docs/process_plugins.md)."""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import threading
import time
import traceback

from .handlers import handler_of
from .manifest import ManifestError, imported_files, manifest_of
from .parameters import create

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .base import Plugin

PROTOCOL = 1
TO_HOST_FD = "RELIGN_TO_HOST_FD"
FROM_HOST_FD = "RELIGN_FROM_HOST_FD"
GRACE_SECONDS = 5  # for a plugin to clean up once the host is gone


class Host:
    """The connection to the host: one JSON object per line.

    Args:
        to_host: Descriptor that messages are written to.
        from_host: Descriptor that messages are read from.

    Attributes:
        awaits_answer: Whether the plugin is handling a request.
    """

    def __init__(self, to_host: int, from_host: int) -> None:
        os.set_inheritable(to_host, False)
        os.set_inheritable(from_host, False)
        self._to_host = to_host
        self._from_host = open(from_host, "rb")  # noqa: SIM115 (open until the process ends)
        self._read_line = self._from_host.readline
        self.awaits_answer = False

    def send_line(self, line: str) -> None:
        """Sends one line, which ends with a newline."""
        data = line.encode("utf-8")
        while data:
            data = data[os.write(self._to_host, data) :]

    def send(self, **message: Any) -> None:
        """Sends a message."""
        self.send_line(json.dumps(message, allow_nan=False, default=_plain) + "\n")

    def receive(self) -> dict[str, Any]:
        """Waits for the next message. Ends the process when the host has closed the connection."""
        line = self._read_line()
        if not line.endswith(b"\n"):
            raise SystemExit(1)
        return json.loads(line)

    def exchange(self, line: str) -> dict[str, Any]:
        """Sends one line and waits for the answer."""
        self.send_line(line)
        return self.receive()

    def ask(self, line: str) -> dict[str, Any]:
        """As `exchange`, but refusals and failures are raised; see `checked`."""
        return self.checked(self.exchange(line))

    @staticmethod
    def checked(answer: dict[str, Any]) -> dict[str, Any]:
        """The answer.

        Raises:
            ValueError: The host refused the request.
            RuntimeError: The request failed.
        """
        if answer["message"] == "refused":
            raise ValueError(answer.get("text", "the host refused the request"))
        if answer["message"] == "failed":
            raise RuntimeError(answer.get("text", "the host reports a failure"))
        return answer


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy as JSON takes them."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{value!r} cannot be written as JSON: its class is {type(value).__name__}")


def _is_authors(frame: traceback.FrameSummary) -> bool:
    return os.path.dirname(os.path.abspath(frame.filename)) != os.path.dirname(os.path.abspath(__file__))


def _authors_traceback(error: BaseException) -> str:
    """The traceback as Python prints it, without the frames of this package."""
    full = traceback.TracebackException.from_exception(error)
    full.stack[:] = [frame for frame in full.stack if _is_authors(frame)] or full.stack
    return "".join(full.format())


def _one_line(error: BaseException) -> str:
    """The error in one line, with its place in the author's file."""
    text = "".join(traceback.format_exception_only(type(error), error)).strip().splitlines()[-1]
    if isinstance(error, SystemExit):
        text = f"it called sys.exit({error.code!r}) during the trial"
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_authors(frame)]
    if frames:
        text += f" ({os.path.basename(frames[-1].filename)}, line {frames[-1].lineno})"
    return text


def _serve_host(cls: type[Plugin], host: Host) -> int:
    """Answers the host's messages until it says bye. Returns the exit status of the process."""
    hello = host.receive()
    manifest = manifest_of(cls)
    if PROTOCOL not in hello.get("protocols", []):
        host.send(message="failed", text=f"relign_bench.plugin has protocol {PROTOCOL}, the host {hello.get('protocols')}")
        return 1
    if hello.get("needs"):
        host.send(message="failed", text=f"the host needs abilities unknown to relign_bench.plugin: {hello['needs']}")
        return 1
    host.send(message="hello", protocol=PROTOCOL, id=manifest["id"], needs=[], manifest=manifest)
    handler: Any = None
    while True:
        message = host.receive()
        name = message["message"]
        if name == "bye":
            return 0
        host.awaits_answer = True
        try:
            if name == "create":
                handler = handler_of(create(cls, message["parameters"]), host)
                answer = {"message": "created"}
            else:
                handle = getattr(handler, "on_" + name, None)
                answer = handle(message) if handle else {"message": "unsupported"}
            sys.stdout.flush()
            host.awaits_answer = False
            host.send(**answer)
        except BaseException as error:  # SystemExit and KeyboardInterrupt too: the host must get an answer
            host.awaits_answer = False
            if not isinstance(error, (SystemExit, ModuleNotFoundError)):  # of which the host says it all
                print(_authors_traceback(error), end="", file=sys.stderr)
            sys.stdout.flush()
            sys.stderr.flush()
            host.send(message="failed", text=_one_line(error))
            return 1


def _end_after_host(from_host: int, host: Host) -> None:
    """Kills this process some seconds after the host is gone. A handler of SIGTERM runs at once, so that stations stop.

    A plugin that waits for a message sees the end of the connection by itself; one in an endless loop does not.
    """
    gone = select.poll()
    gone.register(from_host, 0)  # POLLHUP is reported without being requested
    gone.poll()
    if host.awaits_answer and callable(signal.getsignal(signal.SIGTERM)):
        os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE_SECONDS)
    if os.getpgrp() == os.getpid():  # as the host starts it: the group has all processes that the plugin started
        os.killpg(0, signal.SIGKILL)
    os.kill(os.getpid(), signal.SIGKILL)


def serve(cls: type[Plugin]) -> None:
    """Makes a file a plugin: answers the host that started it. Call it under `if __name__ == "__main__":`.

    With --manifest among the arguments it prints the manifest instead.

    Args:
        cls: The plugin's class.
    """
    to_host = os.environ.pop(TO_HOST_FD, None)
    from_host = os.environ.pop(FROM_HOST_FD, None)
    if "--manifest" in sys.argv[1:]:
        try:
            manifest = manifest_of(cls)
        except ManifestError as error:
            sys.exit(str(error))
        if to_host is None or from_host is None:
            print(json.dumps(manifest, indent=2, allow_nan=False))
        else:
            Host(int(to_host), int(from_host)).send(files=imported_files(), **manifest)
        return
    if to_host is None or from_host is None:
        import shlex  # here alone: plugins start faster without it

        script = shlex.quote("./" + os.path.relpath(sys.argv[0]))
        print(f"this is a plugin of relign-bench; run it with: relign-bench try {script}", file=sys.stderr)
        sys.exit(2)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(line_buffering=True)  # type: ignore[union-attr]  # the log of a process that dies is complete
    host = Host(int(to_host), int(from_host))
    threading.Thread(target=_end_after_host, args=(int(from_host), host), daemon=True).start()
    try:
        status = _serve_host(cls, host)
    except BrokenPipeError:
        status = 1
    sys.exit(status)
