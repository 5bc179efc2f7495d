"""relign-export: writes results folders for other programs."""

from __future__ import annotations

import argparse
import os
import sys
from typing import TYPE_CHECKING

from .archive import write_archive
from .coco import write_coco
from .dataset import write_minari
from .figures import write_figures
from .ioh import write_ioh
from .runs import ERRORS, ONLY_KEYS, meaning_of, read_study

if TYPE_CHECKING:
    from collections.abc import Sequence

EXAMPLES = """examples:
  relign-export results/quick --ioh quick-ioh       # for IOHanalyzer and iohinspector
  relign-export results/quick --coco quick-coco     # then: python3 -m cocopp quick-coco/*/
  relign-export results/quick --figures figures     # PDF and SVG, medians with intervals
  relign-export results/quick --minari datasets     # trials with images, for MINARI_DATASETS_PATH
  relign-export recipe.json --minari datasets       # a dataset again, bit for bit
  relign-export results/quick --ioh quick-ioh --error commanded --only noise_level=rho0.25
  relign-export results/mine --archive mine --plugin my_method --wheel dist/relign_bench-*.whl numpy-*.whl

  The shards of a plan are merged first: relign-bench merge results/quick -o results/quick-merged
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs relign-export.

    Args:
        arguments: Arguments; None: those of the process.

    Returns:
        Exit status: 0, or 2 after an error.
    """
    parser = make_parser()
    given = parser.parse_args(arguments)
    folders = (given.ioh, given.coco, given.figures, given.minari, given.archive)
    if not any(folders):
        parser.error("nothing to write; give --ioh DIR, --coco DIR, --figures DIR, --minari DIR or --archive DIR")
    targets = [os.path.realpath(folder) for folder in folders if folder]
    if len(set(targets)) < len(targets):
        parser.error("every format needs a folder of its own")
    try:
        if given.ioh or given.coco:
            _write_runs(given)
        if given.figures:
            count = write_figures(given.results, given.figures, given.error, given.only)
            print(f"{count} figures as PDF and SVG; {given.error}: {meaning_of(given.error)}")
        if given.archive:
            count, others = write_archive(given.results, given.archive, given.plugin, given.wheel, given.suite_folder)
            print(f"{count} files; {given.archive}/verify replays the results without a network")
            if others:
                print(f"left out of --suite-folder, as results or wheels: {', '.join(others)}", file=sys.stderr)
        if given.minari:
            datasets, left_out = write_minari(given.results, given.minari, given.only)
            for name, episodes in datasets.items():
                print(f"{name}: {episodes} episodes")
            if left_out:
                print(f"left out: {left_out} trials that failed, have no action or no complete record", file=sys.stderr)
    except (ValueError, OSError, ImportError, RuntimeError) as problem:  # RuntimeError: of the compiled module
        if isinstance(problem, OSError) and problem.filename and problem.strerror:
            problem = OSError(f"cannot use '{problem.filename}': {problem.strerror.lower()}; choose another folder")
        print(f"error: {problem}", file=sys.stderr)
        return 2
    return 0


def _write_runs(given: argparse.Namespace) -> None:
    study = read_study(given.results, given.error, given.only)
    for write, folder in ((write_ioh, given.ioh), (write_coco, given.coco)):
        if folder:
            write(study, folder)
    runs = sum(map(len, study.runs.values()))
    print(f"{runs} runs of {len(study.algorithms)} methods on {len(study.functions)} functions; "
          f"{given.error}: {meaning_of(given.error, study.score)}")
    if study.left_out:
        print(f"left out: {study.left_out} failed trials", file=sys.stderr)
    if study.missing:
        print(f"not complete: {study.missing} trials of the suite have no complete record; relign-bench run resumes an "
              "interrupted run", file=sys.stderr)


def make_parser() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="relign-export", description="Write a results folder in the formats of other programs.",
        formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES)
    parser.add_argument("results", metavar="RESULTS",
                        help="results folder of relign-bench run or merge; for --minari also the recipe.json of a dataset")
    parser.add_argument("--ioh", metavar="DIR", help="write data of IOHprofiler, for IOHanalyzer and iohinspector")
    parser.add_argument("--coco", metavar="DIR", help="write a data archive of COCO, for cocopp")
    parser.add_argument("--figures", metavar="DIR",
                        help="write the error after every capture as PDF and SVG for papers; needs matplotlib and relign-bench")
    parser.add_argument("--minari", metavar="DIR",
                        help="write the trials with their images as Minari datasets, with Croissant metadata and a recipe; "
                             "needs minari")
    parser.add_argument("--archive", metavar="DIR",
                        help="copy the results with plugins and wheels, so that they can be replayed without a network")
    parser.add_argument("--plugin", metavar="PATH", action="append", default=[],
                        help="for --archive: a plugin that is not part of relign-bench; repeatable")
    parser.add_argument("--wheel", metavar="FILE", nargs="+", action="extend", default=[],
                        help="for --archive: wheels to install for the replay, with their dependencies")
    parser.add_argument("--suite-folder", metavar="DIR", help="for --archive: folder with the files that the suite names")
    parser.add_argument("--error", choices=tuple(ERRORS), default="recommended",
                        help="; ".join(f"{name}: {meaning_of(name)}" for name in ERRORS) + " [default: %(default)s]")
    parser.add_argument("--only", metavar="KEY=VALUE", action="append", default=[],
                        help=f"export only these trials; keys: {', '.join(ONLY_KEYS)}; repeatable")
    return parser
