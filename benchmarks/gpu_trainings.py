"""Trainings of gpu_all.py in stretches that end in time, and packs of their checkpoints from which the next stretch resumes.

    gpu_trainings.py sweep FILE --only PATTERN --work FOLDER --state FOLDER --seconds S    # of relign-train sweep
    gpu_trainings.py imitate NAME --work FOLDER --state FOLDER -- ARGUMENT...              # of relign-train imitate
    gpu_trainings.py pack --work FOLDER --out FOLDER                                       # what has been trained since
    gpu_trainings.py unpack FOLDER --work FOLDER     # the runs as folders, such as for relign-train sweep --report
    gpu_trainings.py tidy FOLDER                                                           # keeps the latest of each run

Exit status: 0 all is trained, 75 a stretch is (run it again), 1 a training failed.

gpu_packs.py describes the packs. Packing needs the standard library only.
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
import threading
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from relign_bench.training.sweep import Job

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from gpu_packs import complete, pack, progress, rows_of, text_of, tidy, unpack

UNFINISHED = 75  # EX_TEMPFAIL of sysexits.h
LAST_SECONDS = 15  # of a stretch, in which trainings that should have ended are ended


def row(what: str, value: str) -> None:
    """A result, which gpu_all.py keeps."""
    print(f"| {what} | {value} |", flush=True)


@contextlib.contextmanager
def several_processes(folder: pathlib.Path, wanted: bool) -> Iterator[None]:
    """NVIDIA's MPS, where it is installed and works: without it trainings on one GPU take turns."""
    control = shutil.which("nvidia-cuda-mps-control")
    if not wanted or not control:
        if wanted:
            print("nvidia-cuda-mps-control was not found: trainings take turns on the GPU", flush=True)
        yield
        return
    folder.mkdir(parents=True, exist_ok=True)
    os.environ.update({"CUDA_MPS_PIPE_DIRECTORY": str(folder), "CUDA_MPS_LOG_DIRECTORY": str(folder)})
    quiet: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    works = [sys.executable, "-c", "import torch; torch.zeros(1, device='cuda').cpu()"]
    try:
        for command in ([control, "-d"], works):
            subprocess.run(command, check=True, timeout=60, **quiet)
    except (OSError, subprocess.SubprocessError) as problem:
        print(f"MPS does not work ({problem}): trainings take turns on the GPU", flush=True)
        stop_several_processes(folder)
    try:
        yield
    finally:
        stop_several_processes(folder)


def stop_several_processes(folder: pathlib.Path) -> None:
    """Ends MPS, if it was started with this folder."""
    control = shutil.which("nvidia-cuda-mps-control")
    if control and folder.is_dir():
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            subprocess.run([control], input="quit\n", text=True, check=False, timeout=20, stdout=subprocess.DEVNULL,
                           env={**os.environ, "CUDA_MPS_PIPE_DIRECTORY": str(folder), "CUDA_MPS_LOG_DIRECTORY": str(folder)})
        shutil.rmtree(folder, ignore_errors=True)
    for name in ("CUDA_MPS_PIPE_DIRECTORY", "CUDA_MPS_LOG_DIRECTORY"):
        if os.environ.get(name) == str(folder):
            del os.environ[name]


def end_in_time(seconds: float) -> None:
    """Lets a training that does not end be ended as by a user, in so many seconds."""
    timer = threading.Timer(max(1.0, seconds), os.kill, (os.getpid(), signal.SIGTERM))
    timer.daemon = True
    timer.start()


def read_jobs(given: argparse.Namespace) -> list[Job]:
    """The trainings of the file that the pattern chooses, with the settings of --set."""
    import fnmatch

    from relign_bench.training.sweep import read_sweep

    content = json.loads(given.file.read_text())
    for training in content["trainings"]:
        training["settings"] = {**training.get("settings", {}), **json.loads(given.settings)}
    given.work.mkdir(parents=True, exist_ok=True)
    file = given.work / "sweep.json"
    file.write_text(json.dumps(content))
    jobs = [job for job in read_sweep(file, given.work) if fnmatch.fnmatchcase(job.name, given.only)]
    if not jobs:
        raise ValueError(f"--only '{given.only}' matches no training of {given.file}")
    return jobs[:given.count]


def begun_elsewhere(ledger: pathlib.Path | None) -> dict[str, int]:
    """Steps of each training in the ledger."""
    if ledger is None or not ledger.is_file():
        return {}
    steps = {}
    for part in json.loads(ledger.read_text())["parts"].values():
        for what, value in part["results"].items():
            with contextlib.suppress(ValueError, IndexError):
                if " steps" in value and "/seed-" in what:
                    steps[what] = int(value.split()[0])
    return steps


def describe(job: Job) -> None:
    """Prints how far a training is."""
    rows = rows_of(text_of(job.folder / "curve.csv"))
    if not rows:
        return
    last, best = rows[-1], min(rows[job.recipe.warm_up:] or rows, key=lambda found: float(found["score"]))
    row(job.name, f"{last['steps']} of {job.recipe.total} steps, {float(last['hours']):.3f} hours, "
                  f"reward {last['reward'] or '-'}, tuning RMSE after 12 moves {last['rmse_12']}; "
                  f"lowest score {best['score']} after {best['steps']} steps")


def sweep(given: argparse.Namespace) -> int:
    """A stretch of trainings side by side."""
    from relign_bench.training.sweep import Sweep

    end = time.monotonic() + given.seconds
    unpack(given.state, given.work)
    known, jobs, missing, elsewhere = begun_elsewhere(given.ledger), [], [], []
    for job in read_jobs(given):
        steps = known.get(job.name, 0)
        if steps > progress(text_of(job.folder / "curve.csv")):
            elsewhere.append(steps >= job.recipe.total)
            print(f"{job.name}: left out: the ledger has it after {steps} steps, and no pack in '{given.state}' has",
                  flush=True)
            continue
        jobs.append(job)
        if not job.complete():
            missing.append(job)
    failures: dict[str, str] = {}
    try:
        with several_processes(given.work.parent / "mps", given.jobs > 1 and given.device != "cpu"):
            end_in_time(end - time.monotonic() - LAST_SECONDS)
            minutes = max(0.0, end - time.monotonic() - 2 * LAST_SECONDS) / 60
            if missing:
                failures = Sweep(missing, given.jobs, 1, given.device, minutes, lambda line: print(line, flush=True),
                                 render=given.render).run()
    except KeyboardInterrupt:
        print("ended, since the time is over", flush=True)
    for job in jobs:
        describe(job)
    for name, reason in failures.items():
        print(f"{name} failed: {reason}", flush=True)
    if failures:
        return 1
    return 0 if all(elsewhere) and all(job.complete() for job in jobs) else UNFINISHED


def imitate(given: argparse.Namespace) -> int:
    """A stretch of a training by imitation; a pass is lost where it ends."""
    folder = given.work / given.name
    unpack(given.state, given.work)
    if complete(folder):
        return 0
    begun = time.monotonic()
    before = progress(text_of(folder / "curve.csv"))
    command = [sys.executable, "-m", "relign_bench.training", "imitate", "--json", "-o", str(folder), *given.arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            printed = process.communicate(timeout=max(1.0, given.seconds - LAST_SECONDS))[0]
        except subprocess.TimeoutExpired:
            process.terminate()
            printed = process.communicate()[0]
        status = process.returncode
    recipe = json.loads(text_of(folder / "recipe.json") or '{"passes": 0}')
    done = progress(text_of(folder / "curve.csv"))
    row(given.name, f"{done} of {recipe['passes']} passes, {done - before} of them in {time.monotonic() - begun:.0f} s")
    if status == 0:
        for level, error in zip(recipe["levels"], json.loads(printed.splitlines()[-1])["median_rmse_after_12"]):
            row(f"{given.name}: median noise-free RMSE after twelve images, N = {level}", f"{error:.5f}")
        return 0
    return UNFINISHED if status == -signal.SIGTERM else 1


def main(arguments: list[str]) -> int:
    """Runs a verb; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    path = pathlib.Path
    for name in ("sweep", "imitate", "pack", "unpack"):
        made = verbs.add_parser(name)
        made.add_argument("--work", type=path, required=True, help="folder of the runs")
        if name == "pack":
            made.add_argument("--out", type=path, required=True, help="folder of the new packs")
            continue
        if name == "unpack":
            made.add_argument("folder", type=path, help="folder of packs")
            continue
        made.add_argument("--state", type=path, required=True, help="folder of the packs of earlier stretches")
        made.add_argument("--seconds", type=float, required=True, help="length of the stretch")
        if name == "imitate":
            made.add_argument("name", help="of the run; after -- follow arguments of relign-train imitate")
            continue
        made.add_argument("file", type=path, help="trainings as JSON, as for relign-train sweep")
        made.add_argument("--only", default="*", help="trainings whose name matches")
        made.add_argument("--count", type=int, help="so many of them at most")
        made.add_argument("--jobs", type=int, default=1, help="trainings that run at once")
        made.add_argument("--device", default="cpu")
        made.add_argument("--render", default="cpu")
        made.add_argument("--settings", default="{}", help="settings of all, as JSON")
        made.add_argument("--ledger", type=path, help="trainings that it has begun, and whose pack is missing, are left out")
    verbs.add_parser("tidy").add_argument("folder", type=path)
    end = arguments.index("--") if "--" in arguments else len(arguments)
    given = parser.parse_args(arguments[:end])
    given.arguments = arguments[end + 1:]
    if given.verb == "pack":
        stop_several_processes(given.work.parent / "mps")
    if given.verb == "unpack":
        unpack(given.folder, given.work)
        return 0
    if given.verb in ("pack", "tidy"):
        print("\n".join(map(str, pack(given.work, given.out) if given.verb == "pack" else tidy(given.folder))))
        return 0
    return sweep(given) if given.verb == "sweep" else imitate(given)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
