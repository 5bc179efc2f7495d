"""Trainings of gpu_all.py in stretches that end in time, and packs of their checkpoints from which the next stretch resumes.

    gpu_trainings.py sweep FILE --only PATTERN --work FOLDER --state FOLDER --seconds S    # of relign-train sweep
    gpu_trainings.py imitate NAME --work FOLDER --state FOLDER -- ARGUMENT...              # of relign-train imitate
    gpu_trainings.py pack --work FOLDER --out FOLDER                                       # what has been trained since
    gpu_trainings.py tidy FOLDER                                                           # keeps the latest of each run

Exit status: 0 all is trained, 75 a stretch is (run it again), 1 a training failed.

A pack is a .tar of at most 15 MB with the runs NAME/seed-K: of one under way what it resumes from (5.7 MB at 200 x 200
pixels), of a complete one its network and curves. If several packs have a run, the one with the most steps counts.
Packing needs the standard library only.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import hashlib
import io
import json
import lzma
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
from concurrent.futures import ThreadPoolExecutor

UNFINISHED = 75  # EX_TEMPFAIL of sysexits.h
CHECKPOINT = "checkpoint.pt"
RESUMED = "resumed.sha256"  # of the checkpoint that a run was resumed from
# The checkpoint last: it says that all is there.
UNDER_WAY = ("recipe.json", "curve.csv", "errors.csv", "randomisation.json", "best.pt", CHECKPOINT)
COMPLETE = ("recipe.json", "curve.csv", "errors.csv", "tuning.csv", "ppo.json", "ppo.onnx", "imitation.json", "imitation.onnx")
RECURRENT = (*COMPLETE, "best.pt")  # has no network that can be exported
LARGEST_PACK = 15_000_000  # bytes
LAST_SECONDS = 15  # of a stretch, in which trainings that should have ended are ended


# ---- packs -----------------------------------------------------------------------------------------------------------------


def squeezed(content: bytes) -> bytes:
    """Compressed by a tenth more than xz alone: first all first bytes of the floats, then all second ones, and so on."""
    return lzma.compress(b"".join(content[k::4] for k in range(4)), preset=6)


def expanded(content: bytes) -> bytes:
    """The inverse of `squeezed`."""
    planes, out, first = lzma.decompress(content), bytearray(), 0
    out[:] = bytes(len(planes))
    for k in range(4):
        size = len(range(k, len(planes), 4))
        out[k::4] = planes[first:first + size]
        first += size
    return bytes(out)


def rows_of(curve: str) -> list[dict[str, str]]:
    """The rows of a curve.csv, without a last line that is not complete."""
    return [row for row in csv.DictReader(io.StringIO(curve)) if None not in row.values()]


def progress(curve: str) -> int:
    """Steps or passes that are done."""
    rows = rows_of(curve)
    return int(rows[-1].get("steps") or rows[-1]["pass"]) if rows else 0


def text_of(path: pathlib.Path) -> str:
    """Content of a file; "" where there is none."""
    return path.read_text() if path.is_file() else ""


def complete(folder: pathlib.Path) -> bool:
    """Whether a run has ended and what is to be published of it is there."""
    if not (folder / "recipe.json").is_file():
        return False
    recipe = json.loads((folder / "recipe.json").read_text())
    if "total" not in recipe:
        return (folder / "imitation.onnx").is_file()
    ended = progress(text_of(folder / "curve.csv")) >= recipe["total"]
    return ended and (recipe["algorithm"] == "recurrent-ppo" or (folder / "ppo.onnx").is_file())


def packed(place: str, folder: pathlib.Path) -> list[tuple[str, bytes]]:
    """Members of a pack for one run."""
    names = UNDER_WAY
    if complete(folder):
        recurrent = json.loads((folder / "recipe.json").read_text()).get("algorithm") == "recurrent-ppo"
        names = RECURRENT if recurrent else COMPLETE
    return [(f"{place}/{name}.xz", squeezed((folder / name).read_bytes())) for name in names if (folder / name).is_file()]


def pack(work: pathlib.Path, out: pathlib.Path) -> list[pathlib.Path]:
    """Packs the runs below `work` that have been trained since they were unpacked; returns the files.

    Earlier packs in `out` that have no other runs are removed.
    """
    runs = {}
    for recipe in sorted(work.rglob("recipe.json")):
        folder = recipe.parent
        checkpoint = folder / CHECKPOINT
        if checkpoint.is_file() and text_of(folder / RESUMED) != hashlib.sha256(checkpoint.read_bytes()).hexdigest():
            runs[folder.relative_to(work).as_posix()] = folder
    with ThreadPoolExecutor() as pool:
        packs = list(pool.map(packed, runs, runs.values()))
    groups: list[list[tuple[str, bytes]]] = []
    size = LARGEST_PACK
    for members in packs:
        bytes_here = sum(len(content) for _, content in members)
        if size + bytes_here > LARGEST_PACK:
            groups.append([])
            size = 0
        groups[-1] += members
        size += bytes_here
    out.mkdir(parents=True, exist_ok=True)
    files: list[pathlib.Path] = []
    stamp = f"{time.time_ns() // 10**6:x}"  # of no other pack
    for number, members in enumerate(groups, 1):
        files.append(out / f"runs-{stamp}-{number}.tar")
        half = files[-1].with_suffix(".half")
        with tarfile.open(half, "w", format=tarfile.USTAR_FORMAT) as archive:
            for name, content in members:
                member = tarfile.TarInfo(name)
                member.size = len(content)
                archive.addfile(member, io.BytesIO(content))
        half.replace(files[-1])
    for file in set(out.glob("runs-*.tar")) - set(files):
        with tarfile.open(file) as archive:
            earlier = {name.rpartition("/")[0] for name in archive.getnames()}
        if earlier <= set(runs):
            file.unlink()
    return files


def unpack(state: pathlib.Path, work: pathlib.Path) -> None:
    """Puts the latest state of each run in the packs of a folder below `work`, where that has nothing later."""
    best: dict[str, tuple[int, bool, pathlib.Path]] = {}
    for file in sorted(state.glob("runs-*.tar")):
        with tarfile.open(file) as archive:
            names = archive.getnames()
            for name in names:
                if name.endswith("/curve.csv.xz"):
                    run = name.removesuffix("/curve.csv.xz")
                    member = archive.extractfile(name)
                    assert member is not None
                    done = (progress(expanded(member.read()).decode()), f"{run}/{CHECKPOINT}.xz" not in names, file)
                    best[run] = max(best.get(run, done), done)
    for run, (done, _, file) in best.items():
        folder = work / run
        if progress(text_of(folder / "curve.csv")) >= done and (complete(folder) or (folder / CHECKPOINT).is_file()):
            continue
        with tarfile.open(file) as archive:
            members = [member for member in archive if member.name.startswith(f"{run}/")]
            for member in members:
                name = pathlib.PurePosixPath(member.name).name.removesuffix(".xz")
                if not member.isfile() or ".." in member.name or name not in {*UNDER_WAY, *RECURRENT}:
                    raise ValueError(f"{file}: unexpected member '{member.name}'")
                content = archive.extractfile(member)
                assert content is not None
                folder.mkdir(parents=True, exist_ok=True)
                half = folder / (name + ".half")
                half.write_bytes(expanded(content.read()))
                half.replace(folder / name)
        if (folder / CHECKPOINT).is_file():
            (folder / RESUMED).write_text(hashlib.sha256((folder / CHECKPOINT).read_bytes()).hexdigest())


def tidy(state: pathlib.Path) -> list[pathlib.Path]:
    """Replaces the packs of a folder by packs with the latest state of each run; returns them."""
    old = sorted(state.glob("runs-*.tar"))
    with tempfile.TemporaryDirectory() as scratch:
        work = pathlib.Path(scratch) / "work"
        unpack(state, work)
        for folder in (recipe.parent for recipe in work.rglob("recipe.json")):
            (folder / RESUMED).unlink(missing_ok=True)
            (folder / CHECKPOINT).touch()  # of a complete run, so that it is packed
        files = pack(work, pathlib.Path(scratch) / "packs")
        for file in old:
            file.unlink()
        return [pathlib.Path(shutil.move(file, state / file.name)) for file in files]


# ---- stretches -------------------------------------------------------------------------------------------------------------


def row(what: str, value: str) -> None:
    """A result, which gpu_all.py keeps."""
    print(f"| {what} | {value} |", flush=True)


@contextlib.contextmanager
def several_processes(folder: pathlib.Path, wanted: bool):
    """NVIDIA's MPS, where it is installed and works: without it trainings on one GPU take turns."""
    control = shutil.which("nvidia-cuda-mps-control")
    if not wanted or not control:
        if wanted:
            print("nvidia-cuda-mps-control was not found: trainings take turns on the GPU", flush=True)
        yield
        return
    folder.mkdir(parents=True, exist_ok=True)
    os.environ.update({"CUDA_MPS_PIPE_DIRECTORY": str(folder), "CUDA_MPS_LOG_DIRECTORY": str(folder)})
    quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
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


def read_jobs(given: argparse.Namespace):
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


def describe(job) -> None:
    """Prints how far a training is."""
    rows = rows_of(text_of(job.folder / "curve.csv"))
    if not rows:
        return
    last, best = rows[-1], min(rows[job.recipe.warm_up:] or rows, key=lambda found: float(found["score"]))
    row(job.name, f"{last['steps']} of {job.recipe.total} steps, {float(last['hours']):.3f} hours, reward {last['reward'] or '-'}, "
                  f"tuning RMSE after 12 moves {last['rmse_12']}; lowest score {best['score']} after {best['steps']} steps")


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
            print(f"{job.name}: left out: the ledger has it after {steps} steps, and no pack in '{given.state}' has", flush=True)
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
    return UNFINISHED if status == -signal.SIGTERM or status == 130 else 1


def main(arguments: list[str]) -> int:
    """Runs a verb; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    path = pathlib.Path
    for name in ("sweep", "imitate", "pack"):
        made = verbs.add_parser(name)
        made.add_argument("--work", type=path, required=True, help="folder of the runs")
        if name == "pack":
            made.add_argument("--out", type=path, required=True, help="folder of the new packs")
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
    if given.verb in ("pack", "tidy"):
        print("\n".join(map(str, pack(given.work, given.out) if given.verb == "pack" else tidy(given.folder))))
        return 0
    return sweep(given) if given.verb == "sweep" else imitate(given)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
