"""Runs every lens file of a folder through import, first-order values, images and checks; writes one row per file.

    python tests/peers/corpus.py FOLDER [--sample N --seed S] [--jobs J] [--output DIR] [--program PATH] [--stage STAGE]

Writes DIR/corpus.csv and DIR/corpus.md. A second call resumes: rows of the same program are kept. tests/peers/README.md
lists the checks.
"""

import argparse
import csv
import hashlib
import math
import random
import re
import shutil
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from corpus_examination import COLUMNS, STAGES, Examination


def lens_files(folder):
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".zmx", ".seq") and path.is_file())


def hash_of(program):
    """Hash of the program and of the libraries that make its images."""
    digest = hashlib.sha256(program.read_bytes())
    plugins = program.resolve().parent.parent / "lib/relign-bench/plugins/lens_system"
    for file in sorted(plugins.rglob("*.so")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def examine(file, name, program, program_hash, stage):
    with tempfile.TemporaryDirectory(prefix="relign-corpus-") as work:
        return Examination(file, name, program, program_hash, Path(work), stage).run()


def stored_rows(table, program_hash, stage):
    """Rows of the same program whose stage is at least the requested one."""
    if not table.is_file():
        return {}
    with table.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["program"] == program_hash]
    enough = STAGES[STAGES.index(stage) :]
    done = [row for row in rows if row["verdict"] == "refused" or row.get("stage") in enough]
    return {row["file"]: row for row in done if row["verdict"] != "script error"}


def write_rows(table, rows):
    draft = table.with_suffix(".draft")
    with draft.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows[name] for name in sorted(rows))
    shutil.move(draft, table)


def number_in(row, column):
    return float(row[column]) if row.get(column) not in (None, "") else -math.inf


def summary(rows, program_hash):
    """The results as Markdown."""
    verdicts = Counter(row["verdict"] for row in rows)
    order = ("right", "accepted", "refused", "wrong", "script error")
    counted = ", ".join(f"{verdicts[name]} {name}" for name in order if verdicts[name])
    text = f"# Corpus\n\n{len(rows)} files, program {program_hash}: {counted}.\n"

    def table(title, heads, lines):
        if not lines:
            return ""
        cells = [heads, ["---"] * len(heads), *lines]
        escaped = [[str(cell).replace("|", "\\|") for cell in line] for line in cells]
        return f"\n## {title}\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in escaped) + "\n"

    refused = Counter(row["kind"] for row in rows if row["verdict"] == "refused")
    example = {row["kind"]: row["file"] for row in reversed(rows)}
    text += table("Refused", ["files", "kind", "for example"], [[n, k, example[k]] for k, n in refused.most_common()])
    wrong = [row for row in rows if row["verdict"] in ("wrong", "script error")]
    failed = [{part.split(":")[0] for part in row["failed"].split("; ") if part} for row in wrong]
    checks = Counter(check for each in failed for check in each)
    text += table("Checks failed", ["files", "check"], [[n, check] for check, n in checks.most_common()])
    text += table("Wrong", ["file", "what"], [[row["file"], row["failed"] or row["reason"]] for row in wrong])
    measures = [("Slowest", "seconds"), ("Most memory", "memory_mb"), ("Slowest first capture", "capture_seconds")]
    for title, column in measures:
        largest = sorted((row for row in rows if row[column]), key=lambda row: -number_in(row, column))[:10]
        heads = ["file", column, "cpu_seconds", "faces", "aspheres", "f_number"]
        text += table(title, heads, [[row[head] for head in heads] for row in largest])
    measured = ("first_order_error", "image_point_error", "asymmetry", "ring_error", "irradiance_error")
    sound = [row for row in rows if row["verdict"] == "right"]
    lines = []
    for column in measured:
        values = sorted(abs(float(row[column])) for row in sound if row[column])
        if values:
            lines.append([column, f"{values[len(values) // 2]:.2g}", f"{values[-1]:.2g}"])
    return text + table("Files that are right", ["figure", "median", "largest"], lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="searched with its subfolders")
    parser.add_argument("--sample", type=int, help="number of files, drawn at random [default: all]")
    parser.add_argument("--seed", type=int, default=1, help="seed of --sample [default: 1]")
    parser.add_argument("--jobs", type=int, default=1, help="parallel files [default: 1]")
    parser.add_argument("--output", type=Path, default=Path("results/corpus"), help="results [default: results/corpus]")
    parser.add_argument("--program", type=Path, help="path of relign-bench [default: RELIGN_BENCH, or build/release/bin]")
    parser.add_argument(
        "--stage", choices=STAGES, default="images",
        help="last stage: refusals only, import without images, or images [default: images]",
    )
    parser.add_argument("--match", default="", help="only files whose path matches this regular expression")
    arguments = parser.parse_args()
    program = arguments.program
    if program is None:
        import program as installed

        program = installed.path()
    if program is None or not program.is_file():
        sys.exit("relign-bench is not built; build it (./quickstart build) or name it with --program")
    folder = arguments.folder
    files = [file for file in lens_files(folder) if re.search(arguments.match, str(file.relative_to(folder)))]
    if arguments.sample:
        files = sorted(random.Random(arguments.seed).sample(files, min(arguments.sample, len(files))))
    if not files:
        sys.exit(f"no .zmx or .seq files under {arguments.folder}")
    arguments.output.mkdir(parents=True, exist_ok=True)
    table, program_hash = arguments.output / "corpus.csv", hash_of(program)
    rows = stored_rows(table, program_hash, arguments.stage)
    names = {str(file.relative_to(arguments.folder)): file for file in files}
    left = [name for name in names if name not in rows]
    print(f"{len(files)} files, {len(files) - len(left)} of them done, program {program_hash}", flush=True)
    begin, pool = time.monotonic(), ProcessPoolExecutor(arguments.jobs)
    try:
        running = {
            pool.submit(examine, names[name].resolve(), name, program.resolve(), program_hash, arguments.stage): name
            for name in left
        }
        for done, future in enumerate(as_completed(running), 1):
            row = future.result()
            rows[row["file"]] = row
            write_rows(table, rows)
            minutes = (time.monotonic() - begin) / done * (len(left) - done) / 60
            what = row["failed"] or row["kind"] or row["reason"]
            line = f"{done}/{len(left)} ({minutes:.0f} min left) {row['verdict']}: {row['file']} {what}"
            print(line[:200], flush=True)
        pool.shutdown()
    except KeyboardInterrupt:
        print("interrupted; the same command resumes", flush=True)
        pool.shutdown(wait=False, cancel_futures=True)
    report = arguments.output / "corpus.md"
    report.write_text(summary([rows[name] for name in sorted(rows) if name in names], program_hash))
    print(f"{table}, {report}")


if __name__ == "__main__":
    main()
