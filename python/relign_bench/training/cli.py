"""relign-train: trains agents on an ordinary computer."""

import argparse
import dataclasses
import json
import math
import os
import pathlib
import sys

EXAMPLE = """examples:
  relign-train imitate -o training/imitation                       # regression, then DAgger; an agent of its own
  relign-train ppo --preset tuned --warm-start training/imitation -o training/ppo
  relign-train ppo --preset paper -o training/ppo-paper            # the paper's recipe
  relign-train export training/ppo -o my_agent.onnx

  The same command goes on where a run was stopped or killed. What was trained is tried by
  relign-bench try imitation --parameters '{"model": "FILE.onnx"}'
"""

IMITATE = """The folder then holds recipe.json, curve.csv (loss after every pass), tuning.csv (error on lenses that training never
saw), imitation.onnx and imitation.json.

example:
  relign-train imitate -o training/imitation
"""

PPO = """The folder then holds recipe.json, curve.csv and curve.png (reward, success and error on tuning lenses against steps), a
TensorBoard log where tensorboard is installed, and the network as ppo.onnx with ppo.json: of the stretch that did best on
tuning lenses.

examples:
  relign-train ppo --preset paper --set level=0.5 -o training/ppo-paper-0.5
  relign-train ppo --preset paper --algorithm recurrent-ppo -o training/recurrent
"""

EXPORT = """example:
  relign-train export training/ppo -o my_agent.onnx
"""


NO_MEMORY = "its network has a memory, and relign-bench's agents have none"


def main(arguments=None):
    given = make_parser().parse_args(arguments)
    try:
        return {"imitate": _imitate, "ppo": _ppo, "export": _export}[given.verb](given)
    except (ValueError, OSError, ImportError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"Stopped. The same command goes on after what is whole in {given.out}.", file=sys.stderr)
        return 130


def make_parser():
    parser = argparse.ArgumentParser(
        prog="relign-train", description="Train agents that align lenses from their images.",
        formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLE)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    def verb(name, help_text, description, epilog):
        made = verbs.add_parser(name, help=help_text, description=description, epilog=epilog,
                                formatter_class=argparse.RawDescriptionHelpFormatter)
        made.add_argument("--json", action="store_true", help="print the result as JSON")
        return made

    def training(made):
        made.add_argument("-o", "--out", metavar="DIR", required=True, help="folder of the run")
        made.add_argument("--scene", default="relign_od", help="id, preset or path of a scene [default: %(default)s]")
        made.add_argument("--seed", type=int, default=0,
                          help="decides lenses, poses and weights [default: %(default)s]")
        made.add_argument("--threads", type=int, metavar="N", help="[default: all cores]")
        made.add_argument("--set", action="append", default=[], metavar="NAME=VALUE",
                          help="another value of the recipe, such as --set rate=3e-5; python/README.md lists them; repeatable")

    training(verb("imitate", "regression on simulated misalignments, then rounds on what the policy meets",
                  "Learn from pictures of misaligned lenses where the optimum is; then from what the policy meets.",
                  IMITATE))
    ppo = verb("ppo", "reinforcement learning: the paper's recipe, or one that begins with imitation",
               "Learn from rewards, with Stable-Baselines3.", PPO)
    training(ppo)
    ppo.add_argument("--preset", choices=("paper", "tuned"), default="tuned",
                     help="paper: the package's network and settings; tuned: begins with what imitation learnt, for all "
                          "levels, with a critic that is told the truth [default: %(default)s]")
    ppo.add_argument("--warm-start", metavar="DIR", help="folder of relign-train imitate; preset tuned needs one")
    ppo.add_argument("--algorithm", default="ppo", choices=("ppo", "a2c", "trpo", "recurrent-ppo"),
                     help="what the paper compared; the last two need sb3-contrib [default: %(default)s]")
    ppo.add_argument("--until", type=int, metavar="STRETCHES", help="stop after so many stretches of the recipe")
    export = verb("export", "writes a training's network as ONNX, with its side file",
                  "Write the network of a training, as far as it has come, for relign-bench's agents.", EXPORT)
    export.add_argument("folder", metavar="DIR", help="folder of a run")
    export.add_argument("-o", "--out", metavar="FILE.onnx", required=True)
    return parser


def tell(text):
    print(text, file=sys.stderr, flush=True)


def need(module, package):
    """Raises ImportError that says what to install."""
    try:
        __import__(module)
    except ImportError as problem:
        raise ImportError(f"training needs {package}, from the Python index: pip install {package} ({problem})") from None


def _imitate(given):
    need("torch", "torch")
    need("onnx", "onnx")  # torch asks for it at the end only
    from .imitate import Recipe, Training, tuning_rmse

    recipe = changed(Recipe(scene=given.scene, seed=given.seed), given.set)
    training = Training(recipe, given.out, given.threads, tell)
    training.run()
    rmse = tuning_rmse(recipe, training.net, given.threads)
    medians = write_tuning(training.folder, recipe.levels, rmse)
    return show(given, export_imitation(training, pathlib.Path(given.out) / "imitation"),
                {"median_rmse_after_12": medians})


def _ppo(given):
    need("torch", "torch")
    need("onnx", "onnx")  # torch asks for it at the end only
    need("stable_baselines3", "stable-baselines3")
    from .reinforce import PRESETS, Reinforcement

    recipe = dataclasses.replace(PRESETS[given.preset], scene=given.scene, seed=given.seed, algorithm=given.algorithm)
    training = Reinforcement(with_goal(changed(recipe, given.set), given.set), given.out, given.warm_start, given.threads, tell)
    training.run(given.until)
    if training.recurrent:
        tell(f"Not exported: {NO_MEMORY}.")
        return 0
    return show(given, export_reinforcement(training, pathlib.Path(given.out) / "ppo"), {"score": training.best})


def _export(given):
    need("torch", "torch")
    need("onnx", "onnx")  # torch asks for it at the end only
    folder, out = pathlib.Path(given.folder), pathlib.Path(given.out)
    kept = folder / "recipe.json"
    if not kept.is_file():
        raise ValueError(f"{folder} holds no training: it has no recipe.json")
    if out.suffix != ".onnx":
        raise ValueError(f"--out {out}: expected a name that ends with .onnx")
    out.parent.mkdir(parents=True, exist_ok=True)
    recipe = json.loads(kept.read_text())
    if "preset" in recipe:
        need("stable_baselines3", "stable-baselines3")
        from .reinforce import Recipe, Reinforcement

        training = Reinforcement.opened(Recipe(**recipe), folder, tell=lambda _: None)  # nothing goes on
        return show(given, export_reinforcement(training, out), {})
    from .imitate import Recipe, Training

    recipe["levels"] = tuple(recipe["levels"])
    training = Training(Recipe(**recipe), folder, None, lambda _: None)
    training.load()
    return show(given, export_imitation(training, out), {})


def export_imitation(training, path):
    from . import export

    recipe = training.recipe
    return export.write(training.net, path, recipe.scene, recipe.size, 1, "way",
                        trained_of(recipe, training.seconds, training.threads, None),
                        f"relign-train imitate --scene {recipe.scene} -o FOLDER")


def export_reinforcement(training, path):
    from . import export

    if training.recurrent:
        raise ValueError(f"{training.folder.path} cannot be exported: {NO_MEMORY}")
    recipe = training.recipe
    steps = training.load_best()
    trained = trained_of(recipe, training.seconds, training.threads, steps)
    if training.warm_seconds > 0:
        trained["warm_start"] = {"hours": round(training.warm_seconds / 3600, 3)}
    if recipe.preset == "tuned":
        return export.write(training.model.policy.net, path, recipe.scene, recipe.size, 1, "way", trained,
                            f"relign-train ppo --scene {recipe.scene} --warm-start FOLDER_OF_IMITATE -o FOLDER")
    return export.write(export.Actor(training.model.policy), path, recipe.scene, recipe.size, recipe.frames, "move",
                        trained, f"relign-train ppo --preset paper --scene {recipe.scene} -o FOLDER")


def trained_of(recipe, seconds, threads, steps):
    told = {"recipe": dataclasses.asdict(recipe), "hours": round(seconds / 3600, 3), "threads": threads or os.cpu_count()}
    return told if steps is None else {**told, "steps": steps}


def show(given, files, told):
    if given.json:
        print(json.dumps({"files": [str(path) for path in files], **told}))
    else:
        print("\n".join(map(str, files)))
    return 0


def changed(recipe, settings):
    """The recipe with NAME=VALUE texts applied. Raises ValueError that says what there is."""
    fields = {field.name: field for field in dataclasses.fields(recipe)}
    values = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals or name not in fields:
            raise ValueError(f"--set {setting}: allowed: NAME=VALUE with a name of {', '.join(fields)}")
        kind = type(getattr(recipe, name))
        try:
            values[name] = tuple(float(part) for part in text.split(",")) if kind is tuple else kind(text)
        except ValueError:
            what = {tuple: "no list of numbers with commas, such as 0,0.25", int: "no whole number", float: "no number"}
            raise ValueError(f"--set {setting}: '{text}' is {what.get(kind, 'no ' + kind.__name__)}") from None
        check_value(setting, name, values[name])
    return dataclasses.replace(recipe, **values)


def with_goal(recipe, settings):
    """The recipe with the package's goal for its noise level, where one is wanted and none was set. Raises ValueError at
    levels that the package has no goal for."""
    from .reinforce import GOALS, PRESETS

    if recipe.goal == 0 or recipe.level == PRESETS[recipe.preset].level or any(text.startswith("goal=") for text in settings):
        return recipe
    if recipe.level not in GOALS:
        raise ValueError(f"--set level={recipe.level:g}: the package has goals for {', '.join(f'{level:g}' for level in GOALS)} "
                         "alone; add --set goal=SCORE, below which an episode ends (0: never)")
    return dataclasses.replace(recipe, goal=GOALS[recipe.level])


MAY_BE_ZERO = ("seed", "warm_up", "rounds", "level", "levels", "goal", "entropy", "target_kl", "last_rate", "near", "gamma",
               "gae_lambda")
MAY_BE_NEGATIVE = ("first_log_std",)
SHARES = ("near", "gamma", "gae_lambda")


def check_value(setting, name, value):
    """Raises ValueError for numbers with which no training can go on. The recipe's own classes know the rest."""
    for number in value if isinstance(value, tuple) else (value,):
        if isinstance(number, str) or name in MAY_BE_NEGATIVE:
            continue
        if not math.isfinite(number) or number < 0 or (number == 0 and name not in MAY_BE_ZERO):
            allowed = "0 or more" if name in MAY_BE_ZERO else "more than 0"
            raise ValueError(f"--set {setting}: allowed: {allowed}")
        if name in SHARES and number > 1:
            raise ValueError(f"--set {setting}: allowed: 0 to 1")


def write_tuning(folder, levels, rmse):
    """tuning.csv, a row per level and step: median and quartiles of the noise-free RMSE. Returns the medians after the
    last step."""
    import numpy as np

    lines = ["level,step,n,median,q25,q75"]
    for level, lenses in zip(levels, rmse):
        for step in range(lenses.shape[1]):
            q25, median, q75 = np.quantile(lenses[:, step], [0.25, 0.5, 0.75])
            lines.append(f"{level},{step},{len(lenses)},{median:.6f},{q25:.6f},{q75:.6f}")
    folder.keep_text("tuning.csv", "\n".join(lines) + "\n")
    return [float(np.median(lenses[:, -1])) for lenses in rmse]


if __name__ == "__main__":
    sys.exit(main())
