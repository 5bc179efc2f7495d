"""A Bluesky plan that aligns with a method of the benchmark. See README.md."""
import argparse
import json
import os
import signal
import sys

import bluesky.plan_stubs as bps
import bluesky.preprocessors as bpp
from bluesky import RunEngine
from bluesky.utils import RunEngineInterrupted
from ophyd_devices import connect

import relign_bench


def align(method, motors, detectors, key, md=None):
    """Plan: moves to the poses that a method asks for, until it ends, and then to its recommendation.

    Stream `primary` has an event for each pose, stream `recommended` one for the last. The method is closed at the end,
    whatever ended the plan; its `best` stays.

    Args:
        method: A relign_bench.Method whose axes are named as the motors.
        motors: Of ophyd, or whatever else has set, stop and read.
        detectors: Triggered and read at each pose.
        key: Name of the reading that the method gets: a number, smaller is better, or an image.
        md: Metadata for the start document.

    Returns:
        (pose, value) of the lowest value.
    """
    motors, everything = {motor.name: motor for motor in motors}, [*detectors, *motors]
    metadata = {"plan_name": "align", "motors": list(motors), "detectors": [detector.name for detector in detectors],
                **(md or {})}

    def measure(pose, stream):
        if set(pose) != set(motors):
            raise ValueError(f"the method has the axes {', '.join(pose)}, the motors are {', '.join(motors)}")
        yield from bps.checkpoint()
        yield from bps.mv(*(item for name, target in pose.items() for item in (motors[name], target)))
        reading = yield from bps.trigger_and_read(everything, name=stream)
        yield from bps.checkpoint()  # a pause from now on must not repeat the event
        return reading

    @bpp.stage_decorator(everything)
    @bpp.run_decorator(md=metadata)
    def run():
        while (pose := method.ask()) is not None:
            reading = yield from measure(pose, "primary")
            method.tell(reading[key]["value"])
        yield from measure(method.recommended, "recommended")
        return method.best

    def close():
        method.close()
        yield from bps.null()

    return (yield from bpp.finalize_wrapper(run(), close))


def run(plan, *callbacks, **by_name):
    """Runs a plan in a new RunEngine. Ctrl+C and SIGTERM abort it; this and every failure ends the program in one sentence.

    Args:
        callbacks: Get all documents.
        by_name: Get documents of one name, such as `event`.
    """
    engine = RunEngine(context_managers=[])  # without Bluesky's own Ctrl+C, which waits for a checkpoint
    for callback in callbacks:
        engine.subscribe(callback)
    for name, callback in by_name.items():
        engine.subscribe(callback, name)

    def interrupt(*_):
        if engine.state == "idle":
            sys.exit("interrupted before the plan began")
        if engine.state == "running":
            engine.request_pause()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupt)
    try:
        engine(plan)
    except RunEngineInterrupted:
        engine.abort()
        sys.exit("the plan was aborted, and the motors were stopped")
    except Exception as error:  # noqa: BLE001 (the engine has stopped what the plan had moved)
        sys.exit(f"the plan failed: {error.__cause__ or error}")


def arguments(description):
    """A parser of what `devices` needs, and of `--steps`."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--layout", default="station.json", help="axes, box and camera [default: %(default)s]")
    parser.add_argument("--golden", default="golden.npy", help="image of a perfect lens [default: %(default)s]")
    parser.add_argument("--prefix", default="RELIGN:", help="replaces $(P) in the layout [default: %(default)s]")
    parser.add_argument("--timeout", type=float, default=5.0, metavar="S",
                        help="limit for connections, answers and images [default: %(default)s]")
    parser.add_argument("--move-timeout", type=float, default=20.0, metavar="S", help="limit for a move [default: %(default)s]")
    parser.add_argument("--steps", type=int, default=30, help="poses to measure [default: %(default)s]")
    return parser


def devices(options):
    """(motors, camera, box) of parsed arguments."""
    try:
        return connect(options.layout, options.golden, options.prefix, options.timeout, options.move_timeout)
    except (OSError, ValueError) as error:  # TimeoutError is an OSError
        sys.exit(f"{error}; nothing was moved")


def main():
    parser = arguments("Align the layout's lens with a method of the benchmark, in a Bluesky plan.")
    parser.add_argument("algorithm", nargs="?", default="nlopt-sbplx", help="id, preset or path [default: %(default)s]")
    parser.add_argument("--documents", metavar="FILE", help="append the run's documents to this file, one JSON array a line")
    options = parser.parse_args()
    motors, camera, box = devices(options)
    method = relign_bench.Method(options.algorithm, box, options.steps)
    with open(options.documents or os.devnull, "a", encoding="utf-8") as file:

        def record(name, document):
            print(json.dumps([name, document], default=lambda value: value.tolist()), file=file, flush=True)

        def show(_, event):
            print(f"{event['seq_num']:4d}  {event['data'][camera.error.name]:.6f}", flush=True)

        run(align(method, motors, [camera], camera.error.name, {"algorithm": options.algorithm}), record, event=show)
    pose, error = method.best
    print(f"best: {error:.6f} at", ", ".join(f"{name} {value:.4f}" for name, value in pose.items()))


if __name__ == "__main__":
    main()
