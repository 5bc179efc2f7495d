"""Packs of trainings for gpu_trainings.py: what a run resumes from, or what is published of it. Standard library only.

A pack is a .tar of at most 15 MB with the runs NAME/seed-K: of one under way what it resumes from (5.7 MB at 200 x 200
pixels), of a complete one its network and curves. If several packs have a run, the one with the most steps counts.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import lzma
import pathlib
import shutil
import tarfile
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

CHECKPOINT = "checkpoint.pt"
RESUMED = "resumed.sha256"  # of the checkpoint that a run was resumed from
# The checkpoint last: it says that all is there.
UNDER_WAY = ("recipe.json", "curve.csv", "errors.csv", "randomisation.json", "best.pt", CHECKPOINT)
COMPLETE = ("recipe.json", "curve.csv", "errors.csv", "tuning.csv", "ppo.json", "ppo.onnx", "imitation.json", "imitation.onnx")
RECURRENT = (*COMPLETE, "best.pt")  # has no network that can be exported
LARGEST_PACK = 15_000_000  # bytes


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
    names: tuple[str, ...] = UNDER_WAY
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


def latest(state: pathlib.Path) -> dict[str, tuple[int, bool, pathlib.Path]]:
    """Of each run in the packs of a folder its steps, whether it is complete, and the pack that has most of it."""
    found: dict[str, tuple[int, bool, pathlib.Path]] = {}
    for file in sorted(state.glob("runs-*.tar")):
        with tarfile.open(file) as archive:
            names = archive.getnames()
            for name in names:
                run, _, last = name.rpartition("/")
                if last == "curve.csv.xz":
                    done = progress(expanded(content_of(archive, name)).decode())
                    here = (done, f"{run}/{CHECKPOINT}.xz" not in names, file)
                    found[run] = max(found.get(run, here), here)
    return found


def content_of(archive: tarfile.TarFile, name: str) -> bytes:
    """Content of a member."""
    file = archive.extractfile(name)
    assert file is not None
    return file.read()


def unpack(state: pathlib.Path, work: pathlib.Path) -> None:
    """Puts the latest state of each run in the packs of a folder below `work`, where that has nothing later.

    Raises:
        ValueError: A pack has something else.
    """
    for run, (steps, _, file) in latest(state).items():
        folder = work / run
        if progress(text_of(folder / "curve.csv")) >= steps and (complete(folder) or (folder / CHECKPOINT).is_file()):
            continue
        with tarfile.open(file) as archive:
            for member in archive:
                if not member.name.startswith(f"{run}/"):
                    continue
                name = member.name.rpartition("/")[2].removesuffix(".xz")
                if not member.isfile() or ".." in member.name or name not in {*UNDER_WAY, *RECURRENT}:
                    raise ValueError(f"{file}: unexpected member '{member.name}'")
                folder.mkdir(parents=True, exist_ok=True)
                half = folder / (name + ".half")
                half.write_bytes(expanded(content_of(archive, member.name)))
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
