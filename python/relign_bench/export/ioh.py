"""Runs in the format of IOHprofiler, for IOHanalyzer and iohinspector.

The layout is that of the Analyzer logger of IOHexperimenter 0.3.3 to 0.4.2 (https://github.com/IOHprofiler/IOHexperimenter,
include/ioh/logger/analyzer.hpp): a folder per algorithm; in it, per function, a JSON file with one entry per run and a
table with one row per evaluation, in which the header begins each run.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from .runs import file_names, meaning_of, new_folder, readme

if TYPE_CHECKING:
    import os
    import pathlib

    from .runs import Function, Run, Study

LARGEST_INSTANCE = 65535  # iohinspector keeps instances in 16 bits

README = """Runs of the suite '{suite}' of relign-bench in the format of IOHprofiler.

evaluations      1 is the capture at the start pose
raw_y            {meaning} (--error {error})
machine_seconds  simulated seconds until the evaluation was done
x0, x1, ...      {pose} pose, shares of the travel
instance         number of the instance in the suite
left out         {left_out} failed trials

IOHanalyzer and iohinspector show the lowest raw_y so far, also where a later recommendation is worse.

function  scene, noise level
"""


def write_ioh(study: Study, folder: str | os.PathLike[str]) -> None:
    """Writes runs as data of IOHprofiler.

    Args:
        study: The runs.
        folder: Folder to create; it has a folder per method and a README.txt.

    Raises:
        FileExistsError: The folder exists and is not empty.
        ValueError: An instance has a number above LARGEST_INSTANCE.
    """
    largest = max(run.instance for runs in study.runs.values() for run in runs)
    if largest > LARGEST_INSTANCE:
        raise ValueError(f"instance {largest} is above {LARGEST_INSTANCE}, the largest number that iohinspector reads")
    places, stems = file_names(study.algorithms), file_names([function.name for function in study.functions])
    with new_folder(folder) as new:
        for algorithm, place in places.items():
            (new / place).mkdir()
            for function, runs in study.of(algorithm):
                _write_function(study, algorithm, function, runs, new / place, stems[function.name])
        pose = "recommended" if study.error == "recommended" else "commanded"
        (new / "README.txt").write_text(readme(study, README, pose=pose), encoding="utf-8")


def _write_function(study: Study, algorithm: str, function: Function, runs: list[Run], place: pathlib.Path,
                    stem: str) -> None:
    axes = len(runs[0].poses[0])
    header = " ".join(["evaluations", "raw_y", "machine_seconds", *(f"x{axis}" for axis in range(axes))])
    data = place / f"data_f{function.number}_{stem}" / f"IOHprofiler_f{function.number}_DIM{axes}.dat"
    data.parent.mkdir()
    with data.open("w", encoding="utf-8") as out:
        for run in runs:
            out.write(header + "\n")
            for number, row in enumerate(zip(run.errors, run.seconds, run.poses), 1):
                out.write(" ".join([str(number), repr(row[0]), repr(row[1]), *map(repr, row[2])]) + "\n")
    described = dict(
        version="0.4.2",
        suite=study.suite,
        function_id=function.number,
        function_name=function.name,
        maximization=False,
        algorithm={"name": algorithm, "info": "relign-bench"},
        # Texts of ours alone, without the scene's name of its score: iohinspector evaluates these values as Python.
        experiment_attributes=[{"relign_error": study.error}, {"relign_raw_y": meaning_of(study.error)}],
        attributes=["evaluations", "raw_y", "machine_seconds"],
        scenarios=[{"dimension": axes, "path": data.relative_to(place).as_posix(), "runs": [
            {"instance": run.instance, "evals": len(run.errors),
             "best": {"evals": run.best + 1, "y": run.errors[run.best], "x": run.poses[run.best]}} for run in runs]}])
    text = json.dumps(described, indent=1, ensure_ascii=False)
    (place / f"IOHprofiler_f{function.number}_{stem}.json").write_text(text + "\n", encoding="utf-8")
