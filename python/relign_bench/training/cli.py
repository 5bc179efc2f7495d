"""relign-train: trains policies on an ordinary computer."""

from __future__ import annotations

import argparse
import contextlib
import errno
import fnmatch
import json
import os
import pathlib
import sys
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from .._errors import require_integer
from .exporting import RECURRENT, export_imitation, export_reinforcement, export_remembering, export_rewarded
from .folder import kind_of, read_recipe
from .logs import NEEDS
from .settings import kept_recipe, with_goal, with_settings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._typing import Float64Array
    from .folder import RunFolder

EXAMPLES = """examples:
  relign-train imitate -o training/imitation                       # regression, then DAgger
  relign-train imitate --randomise default -o training/randomised  # for scenes whose imaging differs
  relign-train ppo --preset tuned --warm-start training/imitation -o training/ppo
  relign-train ppo --preset paper -o training/ppo-paper            # the paper's recipe
  relign-train export training/ppo -o my_agent.onnx
  relign-train sweep study.json --jobs 15 --device cuda -o training/study

  An interrupted run resumes with the same command. To try a trained policy:
  relign-bench try imitation --parameters '{"model": "FILE.onnx"}'
"""

IMITATE = """files in the folder:
  recipe.json                      every setting of the run
  optima.npy                       optima of the pool, of a scene with a score of its own
  curve.csv                        loss after every pass over the data
  tensorboard                      TensorBoard log (--log), where tensorboard is installed
  tuning.csv                       error on tuning instances, which training never uses, step by step
  imitation.onnx, imitation.json   the network and its side file

examples:
  relign-train imitate -o training/imitation
  relign-train imitate --scene my_scene.py -o training/mine      # a scene with a score of its own
  relign-train imitate --randomise my_errors.json --set passes=60 -o training/robust
"""

PPO = """files in the folder:
  recipe.json              every setting of the run
  curve.csv                reward, success and error on tuning instances, after every training segment
  curve.png                the same as a figure, once a minute and at the end
  tensorboard              TensorBoard log (--log), where tensorboard is installed
  ppo.onnx, ppo.json       the network with the best score on tuning instances, and its side file

examples:
  relign-train ppo --preset paper --set level=0.5 -o training/ppo-paper-0.5
  relign-train ppo --preset paper --algorithm recurrent-ppo -o training/recurrent
  relign-train ppo --preset any --scene my_scene.py -o training/mine
"""

ADAPT = """files in the folder:
  recipe.json                  every setting
  curve.csv                    loss and distance of the features, step by step
  adapted.onnx, adapted.json   the network and its side file

example:
  relign-train adapt training/randomised --images captures -o training/adapted
"""

EXPORT = """example:
  relign-train export training/ppo -o my_agent.onnx
"""

SWEEP = """files in the folder:
  NAME/seed-N                      folder of each run, with the files of relign-train ppo and log.txt
  sweep.csv, sweep.md, sweep.png   curves, table and figure of all runs, written at the end and when interrupted

example:
  relign-train sweep python/recipes/paper_study.json --only 'ppo-*' --jobs 15 --device cuda --minutes 9 -o training/study
"""

HINTS = {errno.ENOENT: "; check the path",
         errno.EEXIST: "; a folder is expected here", errno.ENOTDIR: "; a folder is expected here",
         errno.EISDIR: "; a file is expected here", errno.EROFS: "; choose a folder that can be written",
         errno.EACCES: "; choose another one, or change its permissions"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs relign-train.

    Args:
        arguments: Arguments; None: those of the process.

    Returns:
        Exit status: 0, 2 after an error, 130 after an interrupt.
    """
    given = make_parser().parse_args(arguments)
    try:
        check_numbers(given)
        return {"imitate": _imitate, "ppo": _ppo, "adapt": _adapt, "export": _export, "sweep": _sweep}[given.verb](given)
    except (ValueError, OSError, ImportError, RuntimeError) as problem:  # RuntimeError: of the compiled module
        print(f"error: {sentence(problem)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        hint = "" if given.verb in ("adapt", "export") else f"; the same command resumes the run in {given.out}"
        print(f"interrupted{hint}", file=sys.stderr)
        return 130


def make_parser() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="relign-train", description="Train policies that align a lens from its images, or any scene with a score.",
        formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    def verb(name: str, help_text: str, description: str, epilog: str) -> argparse.ArgumentParser:
        made = verbs.add_parser(name, help=help_text, description=description, epilog=epilog,
                                formatter_class=argparse.RawDescriptionHelpFormatter)
        made.add_argument("--json", action="store_true", help="print the result as JSON")
        return made

    def training(made: argparse.ArgumentParser) -> None:
        made.add_argument("-o", "--out", metavar="DIR", required=True, help="folder of the run")
        made.add_argument("--scene", default="relign_od", help="id, preset or path of a scene [default: %(default)s]")
        made.add_argument("--seed", type=int, default=0,
                          help="seed of instances, poses and weights [default: %(default)s]")
        made.add_argument("--threads", type=int, metavar="N", help="threads that render and train [default: all cores]")
        made.add_argument("--set", action="append", default=[], metavar="NAME=VALUE",
                          help="set a value of the recipe, such as --set rate=3e-5; repeatable; python/README.md lists them")

    def logs(made: argparse.ArgumentParser) -> None:
        made.add_argument("--log", action="append", choices=tuple(NEEDS), metavar="NAME",
                          help="also log the learning curve to tensorboard, mlflow or wandb; repeatable [default: tensorboard, "
                               "where it is installed]")

    def devices(made: argparse.ArgumentParser) -> None:
        made.add_argument("--device", default="cpu", help="torch device that trains, cpu or cuda [default: %(default)s]")
        made.add_argument("--render", default="cpu", metavar="WHERE",
                          help="where images are rendered: cpu or cuda, where they stay on the GPU; they are the same "
                               "(transport ghost: in distribution) [default: %(default)s]")

    imitate = verb("imitate", "Train by imitation learning: regression, then DAgger",
                   "Train a policy by imitation learning: regression on images of misaligned lenses whose optimum is known, "
                   "and on those that the policy visits (DAgger).", IMITATE)
    training(imitate)
    imitate.add_argument("--randomise", metavar="FILE",
                         help="file of imaging errors, drawn for every capture (domain randomisation); 'default': the "
                              "package's own")
    devices(imitate)
    logs(imitate)
    ppo = verb("ppo", "Train by reinforcement learning: the paper's recipe, or from imitation",
               "Train a policy by reinforcement learning with Stable-Baselines3.", PPO)
    training(ppo)
    ppo.add_argument("--preset", choices=("paper", "package", "linear", "tuned", "any"), default="tuned",
                     help="paper: network of the paper's package, values of the paper's text; package: values of the package; "
                          "linear: the paper's recipe with a reward that is linear in the excess RMSE, on 100 x 100 pixels; "
                          "tuned: starts from imitation learning, covers all noise levels, with a privileged critic; "
                          "any: scenes whose score a reading measures, with a memory of poses and readings "
                          "[default: %(default)s]")
    ppo.add_argument("--warm-start", metavar="DIR",
                     help="folder of the run to start from: of relign-train imitate, required by preset tuned; or of "
                          "relign-train ppo by one of the other presets, which otherwise start from scratch")
    ppo.add_argument("--algorithm", default="ppo", choices=("ppo", "a2c", "trpo", "recurrent-ppo"),
                     help="algorithms that the paper compares; the last two need sb3-contrib [default: %(default)s]")
    devices(ppo)
    logs(ppo)
    ppo.add_argument("--minutes", type=float, metavar="M",
                     help="begin no training segment that would end later than M minutes from now")
    ppo.add_argument("--until", type=int, metavar="SEGMENTS", help="stop after this many training segments of the run")
    adapt = verb("adapt", "Adapt a policy to a station, from captures at unknown poses",
                 "Continue the training of a run of relign-train imitate with captures of a station, without labels, at poses "
                 "over the whole travel.", ADAPT)
    adapt.add_argument("folder", metavar="DIR", help="folder of a run of relign-train imitate")
    adapt.add_argument("--images", metavar="FOLDER", required=True,
                       help="captures: .npy (one or a stack, in the scene's units) or grey .png")
    adapt.add_argument("--white", type=float, metavar="GREY", help="grey value of a white pixel in .png files, 0 to 1")
    adapt.add_argument("-o", "--out", metavar="DIR", required=True, help="folder of the adapted network")
    adapt.add_argument("--seed", type=int, default=0, help="seed of instances and batches [default: %(default)s]")
    adapt.add_argument("--threads", type=int, metavar="N", help="threads that render and train [default: all cores]")
    adapt.add_argument("--set", action="append", default=[], metavar="NAME=VALUE",
                       help="set a value of the recipe, such as --set steps=800; repeatable; python/README.md lists them")
    sweep = verb("sweep", "Run the training runs of a file, side by side",
                 "Run the training runs of a file, recipes times seeds, side by side, and write a table and a figure. "
                 "Complete runs are skipped, interrupted ones resume.", SWEEP)
    sweep.add_argument("file", metavar="FILE", help="training runs as JSON (python/README.md)")
    sweep.add_argument("-o", "--out", metavar="DIR", required=True, help="folder of the sweep")
    sweep.add_argument("--jobs", type=int, default=1, metavar="N", help="runs at once [default: %(default)s]")
    sweep.add_argument("--threads", type=int, metavar="N", help="threads of each run [default: all cores, shared equally]")
    devices(sweep)
    logs(sweep)
    sweep.add_argument("--only", metavar="PATTERN", help="runs whose name, such as ppo/seed-0, matches, with * and ?")
    sweep.add_argument("--minutes", type=float, metavar="M",
                       help="begin no training segment that would end later than M minutes from now")
    sweep.add_argument("--report", action="store_true", help="write table and figure of the existing runs, and train nothing")
    export = verb("export", "Write the network of a run as ONNX, with its side file",
                  "Write the network of a run, complete or not, for relign-bench's agents.", EXPORT)
    export.add_argument("folder", metavar="DIR", help="folder of a run")
    export.add_argument("-o", "--out", metavar="FILE.onnx", required=True, help="file to write; the side file is FILE.json")
    export.add_argument("--last", action="store_true",
                        help="of a run of ppo: the network of the last checkpoint, not that with the best score on tuning "
                             "instances; a run of imitate has the last one only")
    return parser


def check_numbers(given: argparse.Namespace) -> None:
    """Checks the numbers of options, where they are given; `settings.check_value` checks seeds.

    Raises:
        ValueError: One is not allowed.
    """
    for option in ("threads", "jobs", "until"):
        if getattr(given, option, None) is not None:
            require_integer(getattr(given, option), f"--{option}", 1, 2**31 - 1)
    minutes = getattr(given, "minutes", None)
    if minutes is not None and not minutes >= 0:  # nan is refused, too
        raise ValueError(f"--minutes must be a non-negative number, not {minutes}")


def log(text: str) -> None:
    """Prints a line of progress."""
    print(text, file=sys.stderr, flush=True)


def chosen_loggers(names: Sequence[str] | None) -> list[str]:
    """Names of the logs that --log chooses, each once; by default TensorBoard's, where it is installed."""
    if names is not None:
        return list(dict.fromkeys(names))
    if find_spec("tensorboard"):
        return ["tensorboard"]
    log("no TensorBoard log is written; for one: pip install tensorboard")
    return []


def require(module: str, package: str) -> None:
    """Checks that a module can be imported.

    Raises:
        ImportError: It cannot; the message has the package to install.
    """
    try:
        __import__(module)
    except ImportError as problem:
        raise ImportError(f"training needs {package}: pip install {package} ({problem})") from None


def require_learner(contributed: bool) -> None:
    """Checks that reinforcement learning can run; `contributed`: with an algorithm of sb3-contrib.

    Raises:
        ImportError: It cannot; the message has the package to install.
    """
    require("torch", "torch")
    require("onnx", "onnx")  # torch would report it only at the end
    require("stable_baselines3", "stable-baselines3")
    require("matplotlib", "matplotlib")
    if contributed:
        require("sb3_contrib", "sb3-contrib")


def sentence(problem: BaseException) -> str:
    """The message of an error, in one line."""
    if type(problem).__name__ == "OutOfMemoryError":  # of torch, whose text is a page
        return ("the GPU has too little memory left for this training; run fewer at once (--jobs), or set a smaller size, "
                "batch or environments; the same command resumes")
    if isinstance(problem, OSError) and problem.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return (f"cannot write '{problem.filename or 'a file of the run'}': {problem.strerror}; the last checkpoint is kept, "
                "and the same command resumes")
    if isinstance(problem, OSError) and problem.filename is not None and problem.strerror:
        hint = HINTS.get(problem.errno or 0, "")
        return f"cannot use '{problem.filename}': {problem.strerror.lower()}{hint}"
    return " ".join(str(problem).split())


def _imitate(given: argparse.Namespace) -> int:
    require("torch", "torch")
    require("onnx", "onnx")  # torch would report it only at the end
    if declares_score(given.scene):
        return _imitate_remembering(given)
    from .imitate import Recipe, Training

    recipe = with_settings(Recipe(scene=given.scene, seed=given.seed), given.set)
    if given.randomise is not None and not given.randomise.strip():
        raise ValueError("--randomise: expected a file of imaging errors or 'default', found ''")
    randomise = pathlib.Path(__file__).with_name("randomisation.json") if given.randomise == "default" else given.randomise
    training = Training(recipe, given.out, given.threads, log, randomise, given.device, given.render,
                        chosen_loggers(given.log))
    training.run()
    rmse = training.tuning_rmse()
    medians = write_tuning(training.folder, recipe.levels, rmse)
    return show(given, export_imitation(training, pathlib.Path(given.out) / "imitation"),
                {"median_rmse_after_12": medians})


def declares_score(scene: str) -> bool:
    """Whether a scene declares a score of its own, for which policies remember what they have seen (remember.py)."""
    from ..batch import Batch

    return "score" in Batch(1, scene, "none", threads=1).description


def _imitate_remembering(given: argparse.Namespace) -> int:
    import numpy as np

    from .remember import Recipe, Training

    if given.randomise is not None or given.render != "cpu":
        raise ValueError(f"--randomise and --render are for scenes of lenses; scene '{given.scene}' declares a score")
    recipe = with_settings(Recipe(scene=given.scene, seed=given.seed), given.set)
    training = Training(recipe, given.out, given.threads, log, given.device, chosen_loggers(given.log))
    training.run()
    scores, pool = training.tuning(), training.pool
    lines = ["step,n,median,q25,q75"]
    for step in range(scores.shape[1]):
        q25, median, q75 = np.quantile(scores[:, step], [0.25, 0.5, 0.75])
        lines.append(f"{step},{len(scores)},{median:.6g},{q25:.6g},{q75:.6g}")
    training.folder.keep_text("tuning.csv", "\n".join(lines) + "\n")
    log(f"{pool.score.label} on {len(scores)} tuning instances after {recipe.tuning_steps} moves: "
        f"median {np.median(scores[:, -1]):.4g}, at the start {np.median(scores[:, 0]):.4g}")
    return show(given, export_remembering(training, pathlib.Path(given.out) / "imitation"),
                {"median_score": float(np.median(scores[:, -1]))})


def _ppo(given: argparse.Namespace) -> int:
    require_learner(given.algorithm in ("trpo", "recurrent-ppo"))
    if given.preset == "any":
        return _ppo_any(given)
    from .recipe import preset_recipe
    from .reinforce import Reinforcement

    recipe = preset_recipe(given.preset, given.algorithm, given.scene, given.seed)
    recipe = with_goal(with_settings(recipe, given.set), given.set)
    training = Reinforcement(recipe, given.out, given.warm_start, given.threads, log, device=given.device,
                             render=given.render, loggers=chosen_loggers(given.log))
    training.run(given.until, given.minutes)
    why = RECURRENT if training.recurrent else training.untrained()
    if why:
        log(f"not exported: {why}")
        return 0
    return show(given, export_reinforcement(training, pathlib.Path(given.out) / "ppo"), {"score": training.best})


def _ppo_any(given: argparse.Namespace) -> int:
    from .rewarded import Recipe, Training

    if given.algorithm != "ppo" or given.warm_start is not None or given.render != "cpu":
        raise ValueError("preset 'any' has no other --algorithm, --warm-start or --render")
    recipe = with_settings(Recipe(scene=given.scene, seed=given.seed), given.set)
    training = Training(recipe, given.out, given.threads, log, given.device, chosen_loggers(given.log))
    training.run(given.until, given.minutes)
    return show(given, export_rewarded(training, pathlib.Path(given.out) / "ppo"), {"score": training.best})


def _sweep(given: argparse.Namespace) -> int:
    from . import sweep, sweep_report

    out = pathlib.Path(given.out)
    jobs = sweep.read_sweep(given.file, out)
    if given.only is not None:
        jobs = [job for job in jobs if fnmatch.fnmatchcase(job.name, given.only)]
        if not jobs:
            raise ValueError(f"--only '{given.only}' matches no training of {given.file}")
    require("matplotlib", "matplotlib")
    try:
        if not given.report:
            require_learner(any(job.recipe.algorithm in ("trpo", "recurrent-ppo") for job in jobs))
            from .devices import check_device

            check_device(given.device, given.render)
            if given.jobs > 1 and given.device != "cpu" and not pathlib.Path(
                    os.environ.get("CUDA_MPS_PIPE_DIRECTORY", "/tmp/nvidia-mps"), "control").exists():
                log("runs on one GPU take turns unless NVIDIA's MPS runs (nvidia-cuda-mps-control -d); fifteen then took "
                    "five times as long")
            failures = sweep.Sweep(jobs, given.jobs, given.threads, given.device, given.minutes, log,
                                   render=given.render, loggers=given.log).run()
            if failures:
                name, reason = next(iter(failures.items()))
                raise ValueError(f"{len(failures)} of {len(jobs)} runs failed, first {name}: {reason}")
    except BaseException:
        with contextlib.suppress(ValueError, OSError):  # what hinders the report shall not hide why the sweep ended
            sweep_report.write(jobs, out)
        raise
    return show(given, sweep_report.write(jobs, out), {"complete": sum(job.complete() for job in jobs), "trainings": len(jobs)})


def _export(given: argparse.Namespace) -> int:
    require("torch", "torch")
    require("onnx", "onnx")  # torch would report it only at the end
    folder, out = pathlib.Path(given.folder), pathlib.Path(given.out)
    kind = kind_of(read_recipe(folder, "imitate", "ppo"))
    if out.suffix != ".onnx":
        raise ValueError(f"--out '{out}' must end with .onnx")
    if kind == "ppo":
        require("stable_baselines3", "stable-baselines3")
        if read_recipe(folder)["preset"] == "any":
            from .rewarded import Training as Rewarded

            return show(given, export_rewarded(Rewarded.open(folder), out, given.last), {})
        from .recipe import Recipe as PpoRecipe
        from .reinforce import Reinforcement

        run = Reinforcement.open(kept_recipe(PpoRecipe, folder), folder, log=lambda _: None)
        return show(given, export_reinforcement(run, out, given.last), {})
    if "pool" in read_recipe(folder):
        from .remember import Training as Remembering

        return show(given, export_remembering(Remembering.open(folder), out), {})
    from .imitate import Training

    return show(given, export_imitation(Training.open(folder), out), {})


def _adapt(given: argparse.Namespace) -> int:
    require("torch", "torch")
    require("onnx", "onnx")  # torch would report it only at the end
    from ..conventions import to_bytes
    from . import adapt
    from .imitate import Recipe as ImitateRecipe
    from .instances import InstanceSet

    recipe = kept_recipe(ImitateRecipe, given.folder)
    scene = InstanceSet(recipe.scene, recipe.levels[:1], 1, recipe.size)
    captures = adapt.read_captures(given.images, given.white, recipe.size, scene.white)
    adapt.check_captures(captures, to_bytes(scene.reference, scene.white), f"'{given.images}'")
    adaptation = adapt.Adaptation(given.folder, captures, given.out, with_settings(adapt.Recipe(seed=given.seed), given.set),
                                  given.threads, log)
    return show(given, export_imitation(adaptation.run(), pathlib.Path(given.out) / "adapted", adaptation.cost()),
                {"captures": len(captures)})


def show(given: argparse.Namespace, files: list[pathlib.Path], results: dict[str, Any]) -> int:
    """Prints files and results, as JSON if --json was given; returns the exit status."""
    if given.json:
        print(json.dumps({"files": [str(path) for path in files], **results}))
    else:
        print("\n".join(map(str, files)))
    return 0


def write_tuning(folder: RunFolder, levels: Sequence[float], rmse: Float64Array) -> list[float]:
    """Writes tuning.csv: median and quartiles of the noise-free RMSE, one row per level and step.

    Args:
        folder: Folder of the run.
        levels: Noise levels N.
        rmse: Shape (levels, instances, steps + 1).

    Returns:
        The medians after the last step, by level.
    """
    import numpy as np

    lines = ["level,step,n,median,q25,q75"]
    for level, instances in zip(levels, rmse):
        for step in range(instances.shape[1]):
            q25, median, q75 = np.quantile(instances[:, step], [0.25, 0.5, 0.75])
            lines.append(f"{level},{step},{len(instances)},{median:.6f},{q25:.6f},{q75:.6f}")
    folder.keep_text("tuning.csv", "\n".join(lines) + "\n")
    return [float(np.median(instances[:, -1])) for instances in rmse]


if __name__ == "__main__":
    sys.exit(main())
