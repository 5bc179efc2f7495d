"""The networks of runs as ONNX files: what the side file says of their training."""

from __future__ import annotations

import dataclasses
import shlex
from typing import TYPE_CHECKING, Any

from .settings import changed_settings

if TYPE_CHECKING:
    import pathlib

    from .imitate import Training
    from .reinforce import Reinforcement
    from .remember import Training as Remembering
    from .rewarded import Training as Rewarded

RECURRENT = "relign-bench's agents do not run recurrent networks"


def export_imitation(training: Training, path: pathlib.Path, further: dict[str, Any] | None = None) -> list[pathlib.Path]:
    """Writes the network of an imitation run; returns the files. `further` is added to what the side file says of it."""
    from . import export

    recipe = training.recipe
    usual = type(recipe)(scene=recipe.scene, seed=recipe.seed)
    return export.write(training.net, path, recipe.scene, recipe.size, 1, "way",
                        {**cost_of(recipe, training), **(further or {})},
                        command_of(training, usual, "imitate", *(("--randomise", "FILE") if recipe.randomise else ())),
                        doubt=training.doubt)


def export_remembering(training: Remembering, path: pathlib.Path) -> list[pathlib.Path]:
    """Writes the network of an imitation run on a scene with a score of its own; returns the files."""
    from . import export

    usual = type(training.recipe)(scene=training.recipe.scene, seed=training.recipe.seed)
    return export.write_remembering(training.net, path, training, cost_of(training.recipe, training),
                                    command_of(training, usual, "imitate"))


def export_rewarded(training: Rewarded, path: pathlib.Path, last: bool = False) -> list[pathlib.Path]:
    """Writes a network of a run with preset "any", the one with the best score or the last; returns the files."""
    from . import export
    from .rewarded import Actor

    recipe = training.recipe
    steps = training.model.num_timesteps if last else training.load_best()
    usual = type(recipe)(scene=recipe.scene, seed=recipe.seed)
    return export.write_remembering(Actor(training.model.policy, recipe.largest_move), path, training,
                                    cost_of(recipe, training, steps), command_of(training, usual, "ppo", "--preset", "any"),
                                    "move", "none" if last else "tuning")


def export_reinforcement(training: Reinforcement, path: pathlib.Path, last: bool = False) -> list[pathlib.Path]:
    """Writes a network of a reinforcement run, the one with the best score or the last; returns the files.

    Raises:
        ValueError: The policy is recurrent.
    """
    from . import export
    from .recipe import preset_recipe

    if training.recurrent:
        raise ValueError(f"'{training.folder.path}' cannot be exported: {RECURRENT}")
    recipe = training.recipe
    if training.untrained():
        raise ValueError(training.untrained())
    steps = training.model.num_timesteps if last else training.load_best()
    trained = cost_of(recipe, training, steps)
    if training.warm_seconds > 0:
        trained["warm_start"] = {"hours": round(training.warm_seconds / 3600, 3)}
    chosen_on = "none" if last else "tuning"
    usual = preset_recipe(recipe.preset, recipe.algorithm, recipe.scene, recipe.seed)
    words = ["ppo", "--preset", recipe.preset, *(("--algorithm", recipe.algorithm) if recipe.algorithm != "ppo" else ()),
             *(("--warm-start", f"FOLDER_OF_{'IMITATE' if recipe.preset == 'tuned' else 'PPO'}") if recipe.warm_start else ())]
    if recipe.preset == "tuned":
        return export.write(training.model.policy.net, path, recipe.scene, recipe.size, 1, "way", trained,
                            command_of(training, usual, *words), chosen_on=chosen_on)
    return export.write(export.Actor(training.model.policy, recipe.input), path, recipe.scene, recipe.size, recipe.frames,
                        "move", trained, command_of(training, usual, *words), values=export.VALUES[recipe.input],
                        chosen_on=chosen_on)


def command_of(training: Training | Reinforcement | Remembering | Rewarded, usual: Any, *words: str) -> str:
    """The command that repeats a run whose options `words` make the recipe `usual`."""
    recipe = training.recipe
    options = [word for name in ("threads", "device", "render") if training.trained_on.get(name)
               for word in (f"--{name}", str(training.trained_on[name]))]
    settings = [word for setting in changed_settings(recipe, usual) for word in ("--set", setting)]
    return shlex.join(["relign-train", *words, "--scene", recipe.scene, "--seed", str(recipe.seed), *settings,
                       *options, "-o", "FOLDER"])


def cost_of(recipe: Any, training: Training | Reinforcement | Remembering | Rewarded,
            steps: int | None = None) -> dict[str, Any]:
    """Recipe and cost of a run, as the side file has them."""
    cost = {"recipe": dataclasses.asdict(recipe), "hours": round(training.seconds / 3600, 3), **training.trained_on}
    if steps is not None:
        cost["steps"] = steps
    return cost
