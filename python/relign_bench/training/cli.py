"""relign-train: trains agents on an ordinary computer."""

import argparse
import dataclasses
import pathlib
import sys

EXAMPLE = """example:
  relign-train imitate -o training/imitation

  The same command goes on where a run was stopped or killed. The folder then holds recipe.json, curve.csv (loss after
  every pass), tuning.csv (error on lenses that training never saw), imitation.onnx and imitation.json.
"""


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="relign-train", description="Train agents that align lenses from their images.",
        formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLE)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    imitate = verbs.add_parser(
        "imitate", help="regression on simulated misalignments, then rounds on what the policy meets",
        description="Learn from pictures of misaligned lenses where the optimum is; then from what the policy meets.",
        formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLE)
    imitate.add_argument("-o", "--out", metavar="DIR", required=True, help="folder of the run")
    imitate.add_argument("--scene", default="relign_od", help="id, preset or path of a scene [default: %(default)s]")
    imitate.add_argument("--seed", type=int, default=0, help="decides lenses, poses and weights [default: %(default)s]")
    imitate.add_argument("--threads", type=int, metavar="N", help="[default: all cores]")
    imitate.add_argument("--set", action="append", default=[], metavar="NAME=VALUE",
                         help="another value of the recipe, such as --set lenses=400; recipe.json lists them; repeatable")
    imitate.add_argument("--json", action="store_true", help="print the result as JSON")
    given = parser.parse_args(arguments)
    try:
        return _imitate(given)
    except (ValueError, OSError, ImportError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"Stopped. The same command goes on after the last whole pass in {given.out}.", file=sys.stderr)
        return 130


def _imitate(given):
    try:
        import torch  # noqa: F401
    except ImportError as problem:
        raise ImportError(f"training needs torch, from the Python index: pip install torch ({problem})") from problem
    from . import export
    from .imitate import Recipe, Training, excess

    recipe = changed(Recipe(scene=given.scene, seed=given.seed), given.set)
    training = Training(recipe, given.out, given.threads, tell=lambda text: print(text, file=sys.stderr, flush=True))
    net = training.run()
    rmse = excess(recipe, net, given.threads)
    folder = pathlib.Path(given.out)
    medians = write_tuning(folder / "tuning.csv", recipe.levels, rmse)
    files = export.write(net, folder / "imitation", training)
    if given.json:
        import json

        print(json.dumps({"files": [str(path) for path in files], "median_rmse_after_12": medians}))
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
            raise ValueError(f"--set {setting}: '{text}' is no {kind.__name__}") from None
    return dataclasses.replace(recipe, **values)


def write_tuning(path, levels, rmse):
    """A row per level and step: median and quartiles of the noise-free RMSE. Returns the medians after the last step."""
    import numpy as np

    with open(path, "w") as out:
        out.write("level,step,n,median,q25,q75\n")
        for level, lenses in zip(levels, rmse):
            for step in range(lenses.shape[1]):
                q25, median, q75 = np.quantile(lenses[:, step], [0.25, 0.5, 0.75])
                out.write(f"{level},{step},{len(lenses)},{median:.6f},{q25:.6f},{q75:.6f}\n")
    return [float(np.median(lenses[:, -1])) for lenses in rmse]


if __name__ == "__main__":
    sys.exit(main())
