"""Runs as a data archive of COCO, for cocopp.

The layout is that of the logger bbob of COCO 2.8, data format bbob-new2 (https://github.com/numbbo/coco-experiment): a folder
per algorithm; in it, per function, an .info file and two tables: .dat with the improvements, .tdat with all evaluations.
cocopp processes only suites that it knows, so that functions are numbered as those of the suite bbob, which ends at 24.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .runs import file_names, new_folder, readme

if TYPE_CHECKING:
    import os
    import pathlib

    from .runs import Function, Run, Study

LARGEST_FUNCTION = 24
DIMENSIONS = (2, 3, 5, 10, 20, 40)  # of the suite bbob
SMALLEST = 9.99e-9  # cocopp's last target is 1e-8, and it draws logarithms

README = """Runs of the suite '{suite}' of relign-bench in the format of COCO.

Function evaluation 1 is the capture at the start pose. The function value is the {meaning} (--error {error}),
at least {smallest}; the optimum is taken as 0. cocopp's targets are therefore RMSE from 100 to 1e-8; those above the error
of the start are met at once, those below the error of an instance's best pose never. Instance k is instance k - 1 of the
suite. Left out: {left_out} failed trials.

cocopp's pages call the functions f1, f2, ... by the names of the suite bbob (f1 Sphere, ...), which they are not. They are:

function  scene, noise level
"""
COLUMNS = ("% f evaluations | g evaluations | best noise-free fitness - Fopt (0.000000000000e+00) + sum g_i+ | measured fitness"
           " | best measured fitness or single-digit g-values | x1 | x2...\n")


def write_coco(study: Study, folder: str | os.PathLike[str]) -> None:
    """Writes runs as a data archive of COCO.

    Args:
        study: The runs.
        folder: Folder to create; it has a folder per method, each an argument of cocopp, and a README.txt.

    Raises:
        FileExistsError: The folder exists and is not empty.
        ValueError: The suite has too many functions, or a scene has a number of axes that the suite bbob does not have.
    """
    last = study.functions[-1]
    if last.number > LARGEST_FUNCTION:
        raise ValueError(f"'{last.name}' would be function {last.number}: COCO's suite bbob, as which cocopp reads the data, "
                         f"has {LARGEST_FUNCTION}; export the results of a suite with fewer scenes and noise levels")
    for (_, function), runs in study.runs.items():
        if len(runs[0].poses[0]) not in DIMENSIONS:
            raise ValueError(f"scene '{function.scene}' has {len(runs[0].poses[0])} axes: COCO's suite bbob, as which cocopp "
                             f"reads the data, has {', '.join(map(str, DIMENSIONS))}; leave it out with --only scene=NAME")
    with new_folder(folder) as new:
        for algorithm, place in file_names(study.algorithms).items():
            for function, runs in study.of(algorithm):
                _write_function(algorithm, function, runs, new / place)
        (new / "README.txt").write_text(readme(study, README, "f", smallest=SMALLEST), encoding="utf-8")


def _write_function(algorithm: str, function: Function, runs: list[Run], place: pathlib.Path) -> None:
    axes = len(runs[0].poses[0])
    stem = f"data_f{function.number}/bbobexp_f{function.number}_DIM{axes}"
    (place / stem).parent.mkdir(parents=True)
    with open(place / f"{stem}.dat", "w") as improvements, open(place / f"{stem}.tdat", "w") as every:
        for run in runs:
            improvements.write(COLUMNS)
            every.write(COLUMNS)
            best = float("inf")
            for number, (error, pose) in enumerate(zip(run.errors, run.poses), 1):
                value = max(SMALLEST, error)
                better, best = value < best, min(value, best)
                shares = " ".join(f"{share:+.4e}" for share in pose)
                line = f"{number} 0 {best:+.9e} {value:+.9e} {best:+.9e} {shares}\n"
                every.write(line)
                if better or number == len(run.errors):
                    improvements.write(line)
    quoted = algorithm.replace("'", "’")  # the format has no escapes
    header = (f"suite = 'bbob', funcId = {function.number}, DIM = {axes}, Precision = 1.000e-08, algId = '{quoted}', "
              "coco_version = '2.8.2', logger = 'bbob', data_format = 'bbob-new2'\n% relign-bench\n")
    ends = [f"{run.instance + 1}:{len(run.errors)}|{max(SMALLEST, run.errors[run.best]):.1e}" for run in runs]
    (place / f"bbobexp_f{function.number}.info").write_text(
        header + ", ".join([f"{stem}.dat", *ends]) + "\n", encoding="utf-8")
