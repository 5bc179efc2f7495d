"""Runs everything that is to be measured on a GPU, in order of its worth, as far as the given time suffices.

    benchmarks/gpu_bundle.sh build/release build/gpu.tar.xz dist/*.whl     # here; docs/gpu.md
    benchmarks/gpu_all.sh --seconds 540 --out OUT                          # on the machine with a GPU

First it prints what the machine has. A part that needs something else is skipped with the reason. A ledger
(gpu_ledger.json) keeps what is done, by which commit and on which card, with the results: such a part is not run again,
nor is one that failed, unless the commit is another one or --again names it. Trainings take the time that is left, and
resume from packs of their checkpoints (gpu_trainings.py). OUT gets the ledger, gpu_all.log and the packs; keep
the ledger in benchmarks/, the packs in the folder --state.

Exit status: 0, 1 if a part failed, 2 if it could not begin.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
from typing import Any

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from gpu_parts import GPU, PARTS, Part, Place
from gpu_probe import DRIVER_FOLDERS, TOOL_FOLDERS
from gpu_trainings import UNFINISHED

HERE = pathlib.Path(__file__).resolve().parent
TREE = HERE.parent
LEDGER, LOG = "gpu_ledger.json", "gpu_all.log"
KEPT = 30  # seconds of the end, in which nothing runs but packing
GRACE = 5  # seconds that a part has to end by itself after SIGTERM
LONGEST = 3  # times its estimate, after which a part that does not resume is ended
LARGEST_RESULT = 300  # characters


class Ledger:
    """What is done: gpu_ledger.json, an object `parts` by name, replaced atomically.

    Args:
        files: Where it is written; those after the first are only read, where they exist. Of a part that several have, the
            entry that is done counts, else that with the most seconds.
    """

    def __init__(self, *files: pathlib.Path) -> None:
        self.file = files[0]
        self.parts: dict[str, Any] = {}
        for file in (file for file in files if file.is_file()):
            for name, entry in json.loads(file.read_text())["parts"].items():
                self.parts[name] = max(self.parts.get(name, entry), entry,
                                       key=lambda known: (known["status"] == "done", known["seconds"]))

    def why_not(self, part: Part, commit: str) -> str:
        """Why a part is not run again; "" if it is."""
        entry = self.parts.get(part.name)
        if not entry:
            return ""
        if entry["status"] == "done":
            return f"done by {entry['commit'][:12]} on {entry['card']}"
        if entry["status"] == "failed" and entry["commit"] == commit:
            return "failed with this commit already; --again repeats it"
        return ""

    def keep(self, part: Part, status: str, about: dict[str, str], seconds: float, results: dict[str, str], last: str) -> None:
        """Adds the results of a part, and keeps those of earlier stretches that it does not replace."""
        before = self.parts.get(part.name, {})
        earlier = before if before.get("status") == "unfinished" else {}
        self.parts[part.name] = {
            "status": status, **about, "date": time.strftime("%Y-%m-%d", time.gmtime()),
            "seconds": round(earlier.get("seconds", 0) + seconds, 1), "results": {**earlier.get("results", {}), **results},
            "last_line": last}
        self.write()

    def write(self) -> None:
        """Writes the file."""
        order = {part.name: number for number, part in enumerate(PARTS)}
        parts = dict(sorted(self.parts.items(), key=lambda item: order.get(item[0], len(order))))
        half = self.file.with_name(self.file.name + ".half")
        half.write_text(json.dumps({"format": 1, "parts": parts}, indent=1) + "\n")
        half.replace(self.file)


def results_of(lines: list[str]) -> dict[str, str]:
    """The rows `| what | value |` of a part's output; of those with the same name the last."""
    found = {}
    for line in lines:
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        if line.startswith("| ") and line.endswith(" |") and len(cells) == 2 and cells[1]:
            found[cells[0]] = cells[1][:LARGEST_RESULT]
    return found


class Session:
    """One use of a machine.

    Args:
        place: Where parts run.
        ledger: What is done.
        seconds: Time from `begun` on, by time.monotonic().
        here: What the machine has (gpu_probe.py).
        missing: Why it lacks something.
        commit: Of the kit.
        parts: What to run, in this order.
        again: Names of parts that are run although the ledger has them.
    """

    def __init__(self, place: Place, ledger: Ledger, seconds: float, begun: float, here: dict[str, str],
                 missing: dict[str, str], commit: str, parts: tuple[Part, ...] = PARTS, again: tuple[str, ...] = ()) -> None:
        self.place, self.ledger, self.here, self.missing, self.commit = place, ledger, here, missing, commit
        self.parts, self.again, self.end = parts, again, begun + seconds
        self.log = open(place.out / LOG, "a", encoding="utf-8")  # noqa: SIM115 (closed by run)

    def left(self) -> float:
        """Seconds for parts."""
        return self.end - KEPT - time.monotonic()

    def say(self, text: str) -> None:
        """Prints a line, and writes it to the log."""
        print(text, flush=True)
        self.log.write(text + "\n")
        self.log.flush()

    def skipped(self, part: Part) -> str:
        """Why a part is not run now; "" if it is."""
        why = "" if part.name in self.again else self.ledger.why_not(part, self.commit)
        if why:
            return why
        for need in part.needs:
            if need not in self.here and not (self.place.small and need == "torch-gpu"):
                return f"needs {need}: {self.missing.get(need, 'not found')}"
        if self.left() < part.seconds and not self.place.small:
            return f"needs about {part.seconds} s, {max(0, self.left()):.0f} s are left"
        if self.left() <= 0:
            return "the time is over"
        return ""

    def run(self) -> bool:
        """Runs what is not done; returns whether nothing failed."""
        failed = []
        with self.log:
            self.ledger.write()  # gpu_trainings.py reads it
            for part in self.parts:
                why = self.skipped(part)
                if why:
                    self.say(f"-- {part.name}: skipped: {why}")
                elif self.run_part(part) == "failed":
                    failed.append(part.name)
            # For a second call on this machine, where OUT may be empty again.
            self.place.work.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(self.ledger.file, self.place.work / LEDGER)
            self.say(f"-- failed: {', '.join(failed)}" if failed else "-- nothing failed")
        return not failed

    def run_part(self, part: Part) -> str:
        """Runs one part and keeps what it brought; returns its status."""
        seconds = self.left() if part.resumes else min(self.left(), LONGEST * part.seconds)
        self.say(f"-- {part.name}: {part.about}; {seconds:.0f} s at most")
        begun = time.monotonic()
        status, lines = self.output_of(part.command(self.place, seconds - GRACE), seconds)
        lasted = time.monotonic() - begun
        if part.resumes:
            pack = [sys.executable, str(HERE / "gpu_trainings.py"), "pack", "--work", str(self.place.work), "--out",
                    str(self.place.out)]
            self.output_of(pack, max(GRACE, self.end - time.monotonic() - GRACE))
        last = next((line for line in reversed(lines) if line.strip()), "")[:LARGEST_RESULT]
        if status is None:
            last = f"ended after {lasted:.0f} s, without an end of its own"
        ended = ("done" if status == 0 else
                 "unfinished" if part.resumes and status in (UNFINISHED, None) else
                 "unfinished" if status is None and seconds < LONGEST * part.seconds else "failed")
        about = {"commit": self.commit, "card": self.here.get("gpu", "none"), "driver": self.here.get("driver", "unknown")}
        self.ledger.keep(part, ended, about, lasted, results_of(lines), last)
        self.say(f"-- {part.name}: {ended} after {lasted:.1f} s: {last}")
        return ended

    def output_of(self, command: list[str], seconds: float) -> tuple[int | None, list[str]]:
        """Exit status, None of a process that was ended after its time, and lines of both streams.

        The process gets a group of its own, which is ended with it.
        """
        lines: list[str] = []
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                       text=True, errors="replace", start_new_session=True, env=self.environment())
        except OSError as problem:
            self.say(f"{command[0]}: {problem}")
            return 127, [str(problem)]

        assert process.stdout is not None

        def read() -> None:
            for line in process.stdout or ():
                lines.append(line.rstrip("\n"))
                self.say(lines[-1])

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        status: int | None = None
        with contextlib.suppress(subprocess.TimeoutExpired):
            status = process.wait(seconds)
        for number, patience in ((signal.SIGTERM, GRACE), (signal.SIGKILL, GRACE)):
            if process.poll() is not None:
                break
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(patience)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # what it left behind
        reader.join(GRACE)
        if not reader.is_alive():  # a process in another group may keep the pipe
            process.stdout.close()
        return status, list(lines)

    def environment(self) -> dict[str, str]:
        """Variables of a part."""
        environment = variables(self.place.kit)
        if "nvrtc" in self.here:
            environment["RELIGN_LIBNVRTC"] = self.here["nvrtc"]
        if self.place.small:
            environment["RELIGN_EMULATED_DRIVER"] = environment.get("RELIGN_LIBCUDA", "")
        else:
            environment["RELIGN_TEST_GPU"] = "1"
        return environment


def variables(kit: pathlib.Path) -> dict[str, str]:
    """Variables with which the kit's packages, the driver and its tools are found."""
    environment = dict(os.environ, PYTHONUNBUFFERED="1")
    for name, before, after in (("PATH", (), TOOL_FOLDERS), ("LD_LIBRARY_PATH", (), DRIVER_FOLDERS),
                                ("PYTHONPATH", (str((kit / "python").resolve()),), ())):
        environment[name] = os.pathsep.join(filter(None, (*before, environment.get(name, ""), *after)))
    return environment


def probe(kit: pathlib.Path) -> tuple[dict[str, str], dict[str, str]]:
    """What the machine has, and why it lacks something."""
    try:
        done = subprocess.run([sys.executable, str(HERE / "gpu_probe.py")], capture_output=True, text=True, timeout=120,
                              check=True, env=variables(kit))
        found = json.loads(done.stdout.splitlines()[-1])
    except (OSError, subprocess.SubprocessError, ValueError, IndexError) as problem:
        return {}, {"gpu": f"gpu_probe.py did not answer: {problem}"}
    return found["here"], found["missing"]


def open_kit(given: pathlib.Path, scratch: pathlib.Path) -> pathlib.Path:
    """The folder of the kit, unpacked if it is an archive.

    Raises:
        ValueError: It is not there.
    """
    if given.is_file():
        with tarfile.open(given) as archive:
            if hasattr(tarfile, "data_filter"):  # from Python 3.12 on, and in late versions before
                archive.extraction_filter = tarfile.data_filter
            archive.extractall(scratch)
        given = next(scratch.iterdir())
    if not (given / "relign-bench-gpu").is_file():
        raise ValueError(f"'{given}' is not a kit: it has no relign-bench-gpu; make one with benchmarks/gpu_bundle.sh")
    return given


def list_of_parts(parts: tuple[Part, ...]) -> str:
    """One line for each part."""
    lines = [f"parts, with an estimate of their seconds (+: takes what is left, and resumes); all need {' and '.join(GPU)}:"]
    for part in parts:
        more = ", ".join(need for need in part.needs if need not in GPU)
        needs = f"; needs {more}" if more else ""
        lines.append(f"  {part.name:17} {part.seconds:4} s{'+' if part.resumes else ' '} {part.about}{needs}")
    return "\n".join(lines)


def main(arguments: list[str], begun: float) -> int:
    """Runs the program; returns the exit status."""
    parser = argparse.ArgumentParser(prog="gpu_all.sh", description=__doc__, epilog=list_of_parts(PARTS),
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    path = pathlib.Path
    bundled = (TREE / "relign-bench-gpu").is_file()
    parser.add_argument("--seconds", type=float, required=True, metavar="S", help="ends within S seconds, packing included")
    parser.add_argument("--out", type=path, required=True, metavar="FOLDER", help="folder of what is to be kept")
    parser.add_argument("--kit", type=path, default=TREE if bundled else TREE / "build" / "gpu.tar.xz", metavar="PATH",
                        help="what gpu_bundle.sh made, packed or not [default: build/gpu.tar.xz, or the folder of this]")
    parser.add_argument("--ledger", type=path, metavar="FILE",
                        help="what is done, besides the ledgers in OUT and --work [default: the one beside this program]")
    parser.add_argument("--state", type=path, default=TREE / "build" / "gpu_state", metavar="FOLDER",
                        help="folder of packs of trainings under way [default: build/gpu_state]")
    parser.add_argument("--work", type=path, default=TREE / "build" / "gpu_work", metavar="FOLDER",
                        help="folder of trainings [default: build/gpu_work]")
    parser.add_argument("--only", nargs="+", default=[], metavar="PART", help="no other parts")
    parser.add_argument("--again", nargs="+", default=[], metavar="PART", help="also if the ledger has them")
    parser.add_argument("--small", action="store_true",
                        help="at sizes of a test, on the emulated driver, trainings on the CPU; no ledger is read but OUT's")
    given = parser.parse_args(arguments)
    for name in (*given.only, *given.again):
        if name not in [part.name for part in PARTS]:
            parser.error(f"unknown part '{name}'; parts: {', '.join(part.name for part in PARTS)}")
    if given.ledger and not given.ledger.is_file():
        parser.error(f"--ledger '{given.ledger}' is not there")
    given.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        try:
            kit = open_kit(given.kit, path(scratch)).resolve()
        except (ValueError, OSError, tarfile.TarError) as problem:
            print(f"error: {problem}", file=sys.stderr)
            return 2
        kept = given.out / LEDGER
        earlier = () if given.small else (given.ledger or HERE / LEDGER, given.work / LEDGER)
        ledger = Ledger(kept, *earlier)
        here, missing = probe(kit)
        commit = (kit / "commit").read_text().strip() if (kit / "commit").is_file() else "unknown"
        place = Place(kit, given.work.resolve(), given.state.resolve(), given.out.resolve(), kept.resolve(), given.small,
                      here.get("compute-sanitizer", "compute-sanitizer"))
        chosen = tuple(part for part in PARTS if not given.only or part.name in given.only)
        session = Session(place, ledger, given.seconds, begun, here, missing, commit, chosen, tuple(given.again))
        session.say(f"-- commit {commit}, {time.strftime('%Y-%m-%d %H:%M:%S', time.gmtime())} UTC, {given.seconds:.0f} s")
        for what, value in here.items():
            session.say(f"   {what}: {value}")
        for what, why in missing.items():
            session.say(f"   no {what}: {why}")
        return 0 if session.run() else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], time.monotonic()))
