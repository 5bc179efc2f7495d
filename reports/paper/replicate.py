"""Trains what replication.md plans, one training after the other on one core, and publishes small results:

    PYTHONPATH=build/release/python python3 reports/paper/replicate.py --work FOLDER           # trains what is missing
    python3 reports/paper/replicate.py --work FOLDER --pack                                    # to carry on elsewhere

The trainings are those of replication.json, in its order: the first round's for each seed, then the next round's. Each is a
command of relign-train with a folder FOLDER/NAME/seed-K of its own, and after it has been killed the same command resumes it:
a pass or a training segment is lost at most. What has been published is not trained again. Results, by default in
reports/paper/trainings/replication/NAME:

    seed-K-last.onnx, seed-K-best.onnx   networks of the last checkpoint and of that with the lowest error on tuning instances,
                                         as far as the plan evaluates them, with their side files
    seed-K-curve.csv, -errors.csv        learning curve and errors on tuning instances, as relign-train writes them; of
    or -tuning.csv                       imitation the latter at the end only
    seed-K.json                          command, versions of the program that trained, SHA-256 of the networks; written last

--pack writes in-flight/NAME-seed-K.tar.xz of every training that is under way, and of every complete one that another still
has to start from, and removes the others. Training begins with what is packed where FOLDER has nothing. Interrupted by
SIGTERM or SIGINT, it ends its training first.

Needs what relign-train needs; --pack the standard library only.
"""

import argparse
import contextlib
import hashlib
import io
import json
import os
import pathlib
import shlex
import shutil
import signal
import subprocess
import sys
import tarfile
from dataclasses import dataclass

HERE = pathlib.Path(__file__).resolve().parent
TREE = HERE.parents[1]
CHECKPOINT = "checkpoint.pt"
VERSIONS = "versions.txt"
# The checkpoint first: should training continue meanwhile, the other files are of a later segment, which is then repeated.
CARRIED = (CHECKPOINT, "best.pt", "recipe.json", "curve.csv", "errors.csv", "randomisation.json", VERSIONS)
PUBLISHED = ("curve.csv", "errors.csv", "tuning.csv")
LARGEST_PACK = 20_000_000  # bytes
TRAINER = (sys.executable, "-m", "relign_bench.training")


@dataclass(frozen=True)
class Job:
    """One training: its condition, the seed of the plan, and what relign-train is given."""

    name: str
    seed: int
    arguments: tuple[str, ...]
    networks: tuple[str, ...]  # "last" and "best", as far as they are published
    start: str  # condition whose training with the same seed this one continues; "": from nothing

    @property
    def place(self):
        """Folder of the run, relative to the folder of all runs."""
        return pathlib.Path(self.name, f"seed-{self.seed}")


def read_plan(path):
    """The trainings of a plan, in their order."""
    jobs = []
    for number, wave in enumerate(json.loads(path.read_text())["rounds"], 1):
        for seed in wave["seeds"]:
            for training in wave["trainings"]:
                arguments = (*training["arguments"], "--seed", str(training.get("first_seed", 0) + seed), "--threads", "1")
                job = Job(training["name"], seed, arguments, tuple(training["networks"]), training.get("from", ""))
                if any(job.place == other.place for other in jobs):
                    raise ValueError(f"{path}: {job.place} is there twice, again in round {number}")
                if job.start and not any((other.name, other.seed) == (job.start, seed) for other in jobs):
                    raise ValueError(f"{path}: {job.place} starts from '{job.start}', of which no training with this seed is "
                                     "before it")
                jobs.append(job)
    return jobs


class Study:
    """The trainings of a plan: runs in the folder `work`, results in `results`."""

    def __init__(self, jobs, work, results):
        self.jobs, self.work, self.results = jobs, work, results

    def run(self, count=None):
        """Trains and publishes what is missing, at most `count` trainings."""
        missing = [job for job in self.jobs if not self.complete(job)]
        log(f"{len(self.jobs) - len(missing)} of {len(self.jobs)} trainings are complete")
        for job in missing[:count]:
            log(f"{job.place}: {shlex.join(('relign-train', *self.arguments(job, self.work)))}")
            self.train(job)
            self.publish(job)
            log(f"{job.place}: complete")

    def record(self, job):
        """The file that says that a training is complete."""
        return self.results / job.name / f"seed-{job.seed}.json"

    def complete(self, job):
        """Whether the results of a training are published."""
        return self.record(job).is_file()

    def pack_of(self, job):
        """The file that a training is packed into."""
        return self.results / "in-flight" / f"{job.name}-seed-{job.seed}.tar.xz"

    def source(self, job):
        """The training that this one continues, or None."""
        return next((other for other in self.jobs if (other.name, other.seed) == (job.start, job.seed)), None)

    def begun(self, job):
        """Whether a training has a checkpoint, in its folder or packed."""
        return (self.work / job.place / CHECKPOINT).is_file() or self.pack_of(job).is_file()

    def unpack(self, job):
        """The folder of a training, from its pack if it is not there."""
        folder = self.work / job.place
        if not (folder / CHECKPOINT).is_file() and self.pack_of(job).is_file():
            folder.mkdir(parents=True, exist_ok=True)
            with tarfile.open(self.pack_of(job)) as pack:
                for member in sorted(pack, key=lambda member: member.name == CHECKPOINT):  # last: it says that all is there
                    if member.name not in CARRIED or not member.isfile():
                        raise ValueError(f"{self.pack_of(job)}: unexpected member '{member.name}'")
                    replace(folder / member.name, pack.extractfile(member).read())
        return folder

    def arguments(self, job, base, fresh=True):
        """What relign-train is given; fresh: for a run that has no checkpoint of its own yet."""
        source = self.source(job)
        start = ("--warm-start", str(base / source.place)) if source and fresh else ()
        return (*job.arguments, *start, "-o", str(base / job.place))

    def train(self, job):
        """Trains to the end."""
        folder, source = self.unpack(job), self.source(job)
        fresh = not (folder / CHECKPOINT).is_file()
        if source and fresh and not (self.complete(source) and (self.unpack(source) / CHECKPOINT).is_file()):
            raise ValueError(f"{job.place} starts from {source.place}, whose checkpoint is not in '{self.work}'; copy its "
                             f"folder, or remove '{self.record(source)}' to train it again")
        folder.mkdir(parents=True, exist_ok=True)
        note_version(folder / VERSIONS)
        relign_train(*self.arguments(job, self.work, fresh))

    def publish(self, job):
        """Writes the results of a training that has ended."""
        folder, out = self.work / job.place, self.results / job.name
        out.mkdir(parents=True, exist_ok=True)
        digests = {}
        for kind in job.networks:
            network = out / f"seed-{job.seed}-{kind}.onnx"
            relign_train("export", *(("--last",) if kind == "last" else ()), str(folder), "-o", str(network))
            digests[network.name] = hashlib.sha256(network.read_bytes()).hexdigest()
        for name in PUBLISHED:
            if (folder / name).is_file():
                shutil.copyfile(folder / name, out / f"seed-{job.seed}-{name}")
        record = {"command": shlex.join(["relign-train", *self.arguments(job, pathlib.Path())]),
                  "versions": (folder / VERSIONS).read_text().splitlines(), "networks": digests}
        replace(self.record(job), (json.dumps(record, indent=1) + "\n").encode())

    def pack(self):
        """Packs what a later run continues from; returns the files."""
        wanted = []
        for job in self.jobs:
            awaited = any(self.source(other) == job and not self.complete(other) and not self.begun(other)
                          for other in self.jobs)
            if self.begun(job) and (awaited or not self.complete(job)):
                wanted.append(job)
        folder = self.results / "in-flight"
        folder.mkdir(parents=True, exist_ok=True)
        for job in wanted:
            if (self.work / job.place / CHECKPOINT).is_file():  # else what is packed is the latest
                content = packed(self.work / job.place)
                if len(content) > LARGEST_PACK:
                    raise ValueError(f"{job.place} has {len(content)} bytes packed; more than {LARGEST_PACK} are not kept")
                self.pack_of(job).write_bytes(content)
        files = [self.pack_of(job) for job in wanted]
        for file in folder.iterdir():
            if file not in files:
                file.unlink()
        if not files:
            folder.rmdir()
        return files


def packed(folder):
    """The files that a run resumes from, as an archive whose bytes depend on theirs alone."""
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w:xz", format=tarfile.USTAR_FORMAT) as pack:
        for name in CARRIED:
            with contextlib.suppress(FileNotFoundError):
                data = (folder / name).read_bytes()
                member = tarfile.TarInfo(name)
                member.size = len(data)
                pack.addfile(member, io.BytesIO(data))
    return content.getvalue()


def replace(path, content):
    """Writes a file, so that it has its old content or the new one at any time."""
    half = path.with_name(path.name + ".half")
    half.write_bytes(content)
    half.replace(path)


def note_version(path):
    """Adds the commit of the source tree to a file, unless it is the last one there."""
    def git(*arguments):
        return subprocess.run(["git", "-C", str(TREE), *arguments], capture_output=True, text=True, check=False)

    found = git("rev-parse", "HEAD").stdout.strip() or "unknown"
    changed = git("diff", "--quiet", "HEAD", "--", "core", "plugins", "python").returncode
    line = f"{found}{' with changes' if changed else ''}"
    lines = path.read_text().splitlines() if path.is_file() else []
    if lines[-1:] != [line]:
        path.write_text("\n".join([*lines, line]) + "\n")


def relign_train(*arguments):
    """Runs relign-train; it is ended with this process."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with subprocess.Popen([*TRAINER, *arguments], stdout=subprocess.DEVNULL, env=environment) as process:
        try:
            status = process.wait()
        except BaseException:
            process.terminate()
            raise
    if status != 0:
        raise ValueError(f"relign-train {shlex.join(arguments)} ended with status {status}, for the reason above")


def interrupt(*_):
    raise KeyboardInterrupt


def log(text):
    print(text, file=sys.stderr, flush=True)


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0].rstrip(":"))
    parser.add_argument("--work", required=True, type=pathlib.Path, metavar="FOLDER", help="folder of the runs")
    parser.add_argument("--plan", type=pathlib.Path, default=HERE / "replication.json", metavar="FILE")
    parser.add_argument("--results", type=pathlib.Path, default=HERE / "trainings" / "replication", metavar="FOLDER")
    parser.add_argument("--count", type=int, metavar="N", help="train N at most")
    parser.add_argument("--pack", action="store_true", help="train nothing, and pack what is under way")
    given = parser.parse_args(arguments)
    signal.signal(signal.SIGTERM, interrupt)
    try:
        study = Study(read_plan(given.plan), given.work.resolve(), given.results.resolve())
        if given.pack:
            print("\n".join(map(str, study.pack())))
        else:
            study.run(given.count)
    except (ValueError, OSError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; the same command resumes", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
