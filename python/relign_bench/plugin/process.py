"""The process: messages to and from the host that started it (docs/process_plugins.md)."""

import json
import os
import select
import signal
import sys
import threading
import time
import traceback

from .answers import answers_of
from .manifest import imported_files, manifest_of
from .parameters import create

PROTOCOL = 1
TO_HOST_FD = "RELIGN_TO_HOST_FD"
FROM_HOST_FD = "RELIGN_FROM_HOST_FD"
SECONDS_ALONE = 5  # to tidy up, once the host is gone


class _Host:
    """Messages to and from the host, one JSON object a line."""

    def __init__(self, to_host, from_host):
        os.set_inheritable(to_host, False)
        os.set_inheritable(from_host, False)
        self._to_host = to_host
        self._from_host = open(from_host, "rb")
        self.read_line = self._from_host.readline

    def send(self, line):
        data = line.encode("utf-8")
        while data:
            data = data[os.write(self._to_host, data) :]

    def tell(self, **message):
        self.send(json.dumps(message, allow_nan=False, default=_plain) + "\n")

    def receive(self):
        line = self.read_line()
        if not line.endswith(b"\n"):  # the host is gone, or has had enough
            raise SystemExit(1)
        return json.loads(line)

    def exchange(self, line):
        self.send(line)
        return self.receive()

    def ask(self, line):
        return self.checked(self.exchange(line))

    @staticmethod
    def checked(answer):
        if answer["message"] == "refused":
            raise ValueError(answer.get("text", "the host refused the request"))
        if answer["message"] == "failed":
            raise RuntimeError(answer.get("text", "the host reports a failure"))
        return answer


def _plain(value):
    """numpy's numbers and arrays in a message."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError("%r cannot be written as JSON: its class is %s" % (value, type(value).__name__))


def _is_own(frame):
    return os.path.dirname(os.path.abspath(frame.filename)) != os.path.dirname(os.path.abspath(__file__))


def _own_traceback(error):
    """As Python prints it, without the frames of this package."""
    told = traceback.TracebackException.from_exception(error)
    told.stack[:] = [frame for frame in told.stack if _is_own(frame)] or told.stack
    return "".join(told.format())


def _sentence(error):
    """What went wrong in one line, with the place in the author's file."""
    text = "".join(traceback.format_exception_only(type(error), error)).strip().splitlines()[-1]
    if isinstance(error, SystemExit):
        text = "it called sys.exit(%r) during the trial" % (error.code,)
    own = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_own(frame)]
    if own:
        text += " (%s, line %d)" % (os.path.basename(own[-1].filename), own[-1].lineno)
    return text


def _talk_to_host(cls, host):
    hello = host.receive()
    manifest = manifest_of(cls)
    if PROTOCOL not in hello.get("protocols", []):
        host.tell(message="failed", text="it speaks protocol %d, the host %s" % (PROTOCOL, hello.get("protocols")))
        return 1
    if hello.get("needs"):
        host.tell(message="failed", text="the host needs abilities unknown to relign_bench.plugin: %s" % hello["needs"])
        return 1
    host.tell(message="hello", protocol=PROTOCOL, id=manifest["id"], needs=[], manifest=manifest)
    answers = None
    while True:
        message = host.receive()
        name = message["message"]
        if name == "bye":
            return 0
        try:
            if name == "create":
                answers = answers_of(create(cls, message["parameters"]), host)
                answer = {"message": "created"}
            else:
                asked = getattr(answers, "on_" + name, None)
                answer = asked(message) if asked else {"message": "unsupported"}
            sys.stdout.flush()
            host.tell(**answer)
        except BaseException as error:  # SystemExit and KeyboardInterrupt too: the host must hear of it
            if not isinstance(error, SystemExit):
                print(_own_traceback(error), end="", file=sys.stderr)
            sys.stdout.flush()
            sys.stderr.flush()
            host.tell(message="failed", text=_sentence(error))
            return 1


def _end_after_host(from_host):
    """Who waits for the host's next message hears that it is gone; an author's endless loop does not, and would stay."""
    gone = select.poll()
    gone.register(from_host, 0)  # a hang-up is told unasked
    gone.poll()
    time.sleep(SECONDS_ALONE)
    if os.getpgrp() == os.getpid():  # as the host starts it: with all that it has started
        os.killpg(0, signal.SIGKILL)
    os.kill(os.getpid(), signal.SIGKILL)


def serve(cls):
    """Makes this file a plugin: answers the host that started it. Call it under `if __name__ == "__main__":`."""
    to_host = os.environ.pop(TO_HOST_FD, None)
    from_host = os.environ.pop(FROM_HOST_FD, None)
    if "--manifest" in sys.argv[1:]:
        if to_host is None:
            print(json.dumps(manifest_of(cls), indent=2, allow_nan=False))
        else:
            _Host(int(to_host), int(from_host)).tell(files=imported_files(), **manifest_of(cls))
        return
    if to_host is None or from_host is None:
        script = os.path.relpath(sys.argv[0])
        print("This is a plugin of relign-bench. Run it with: relign-bench try ./%s" % script, file=sys.stderr)
        sys.exit(2)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(line_buffering=True)  # what a process that dies has printed is in its log
    threading.Thread(target=_end_after_host, args=(int(from_host),), daemon=True).start()
    try:
        status = _talk_to_host(cls, _Host(int(to_host), int(from_host)))
    except BrokenPipeError:
        status = 1
    sys.exit(status)
