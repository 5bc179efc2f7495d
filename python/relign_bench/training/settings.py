"""Settings of recipes as texts of the form NAME=VALUE, and recipes from recipe.json."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from .._errors import unknown_name
from .folder import kind_of, read_recipe
from .recipe import GOALS, PRESETS, setting_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeVar

    from .folder import Path
    from .recipe import Recipe

    AnyRecipe = TypeVar("AnyRecipe")

MAY_BE_ZERO = ("seed", "weight", "captures", "warm_up", "level", "levels", "goal", "entropy", "target_kl", "last_rate", "near",
               "visited", "gamma", "gae_lambda", "probes", "best", "columns")
MAY_BE_NEGATIVE = ("first_log_std",)
AT_LEAST = {"optimum_samples": 16}
AT_MOST = {"seed": 2**29 - 1,  # numbers of instances, below 2**63, are multiples of seeds
           **dict.fromkeys(("levels", "largest_move", "near", "visited", "gamma", "gae_lambda"), 1)}
INTEGERS = ("heads", "hidden")  # tuples of integers; other tuples have floats
MAY_BE_EMPTY = ("heads",)
OPTIONS = {"preset": "--preset", "algorithm": "--algorithm", "warm_start": "--warm-start", "randomise": "--randomise",
           "trained": "DIR", "images": "--images", "captures": "--images"}
"""What a recipe has from options of the command line."""
FOLLOWS = {"last_rate": "rate", "goal": "level"}
"""Settings that change with another one unless they are given, too."""


def with_settings(recipe: AnyRecipe, settings: Sequence[str]) -> AnyRecipe:
    """A recipe with settings of the form NAME=VALUE applied.

    Where the learning rate of the recipe is constant, `rate` without `last_rate` keeps it so.

    Raises:
        ValueError: A name is unknown, or a value of the recipe is not valid.
    """
    names = _names(recipe)
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise ValueError(f"--set {setting}: expected NAME=VALUE")
        if name in OPTIONS and hasattr(recipe, name):
            raise ValueError(f"--set {setting}: '{name}' is not a setting; use {OPTIONS[name]}")
        if name not in names:
            raise ValueError(f"--set {setting}: {unknown_name('setting', name, names)}")
        values[name] = _parsed(setting, name, text, type(getattr(recipe, name)))
    given = dataclasses.asdict(recipe)  # type: ignore[call-overload]
    if "rate" in values and "last_rate" in given and given["last_rate"] == given["rate"]:
        values.setdefault("last_rate", values["rate"])
    for name, value in {**given, **values}.items():
        check_value(name, value)
    return dataclasses.replace(recipe, **values)  # type: ignore[type-var]


def changed_settings(recipe: AnyRecipe, usual: AnyRecipe) -> list[str]:
    """The settings with which `with_settings` and `with_goal` make `recipe` of `usual`."""
    names = _names(recipe)
    changed = {name for name in names if getattr(recipe, name) != getattr(usual, name)}
    changed |= {name for name in names if FOLLOWS.get(name) in changed}
    values = {name: getattr(recipe, name) for name in names if name in changed}
    return [f"{name}={setting_text(value)}" for name, value in values.items()]


def _names(recipe: AnyRecipe) -> list[str]:
    return [field.name for field in dataclasses.fields(recipe) if field.name not in OPTIONS]  # type: ignore[arg-type]


def kept_recipe(kind: type[AnyRecipe], path: Path) -> AnyRecipe:
    """The recipe of the run in a folder.

    Args:
        kind: Class of the recipe.
        path: The folder.

    Raises:
        ValueError: The folder has no run, one of another verb, or its recipe is of another version or not valid.
    """
    usual = kind()
    types = {name: type(value) for name, value in vars(usual).items()}
    verb = kind_of(vars(usual))
    values = read_recipe(path, verb)
    if values.keys() != types.keys():
        raise ValueError(f"'{path}/recipe.json' is not a recipe of this version of relign-train {verb}: "
                         f"{', '.join(sorted(types.keys() ^ values.keys()))} missing or unknown")
    for name, value in values.items():
        allowed = {tuple: (list,), float: (int, float)}.get(types[name], (types[name],))
        parts = value if isinstance(value, list) else [value]
        if type(value) not in allowed or (types[name] is tuple and any(type(part) not in (int, float) for part in parts)) or (
                value == [] and name not in MAY_BE_EMPTY):
            raise ValueError(f"'{path}/recipe.json': {name} cannot be {value!r}")
        try:
            check_value(name, tuple(value) if isinstance(value, list) else value)
        except ValueError as problem:
            raise ValueError(f"'{path}/recipe.json': {problem}") from None
    return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})


def _parsed(setting: str, name: str, text: str, kind: type) -> Any:
    try:
        if kind is not tuple:
            return kind(text)
        if not text and name in MAY_BE_EMPTY:
            return ()
        return tuple((int if name in INTEGERS else float)(part) for part in text.split(","))
    except ValueError:
        numbers = "integers separated by commas, such as 64,64" if name in INTEGERS else (
            "numbers separated by commas, such as 0,0.25")
        expected = {tuple: numbers, int: "an integer", float: "a number"}
        raise ValueError(f"--set {setting}: '{text}' must be {expected.get(kind, kind.__name__)}") from None


def with_goal(recipe: Recipe, settings: Sequence[str]) -> Recipe:
    """A recipe with the package's goal for its noise level, unless the preset has no goal or a setting changed it.

    Raises:
        ValueError: The package has no goal for the level.
    """
    if recipe.goal == 0 or recipe.level == PRESETS[recipe.preset].level or any(text.startswith("goal=") for text in settings):
        return recipe
    if recipe.level not in GOALS:
        raise ValueError(f"--set level={recipe.level:g}: the package has no goal for this level, only for "
                         f"{', '.join(f'{level:g}' for level in GOALS)}; add --set goal=SCORE, the score below which an "
                         "episode ends (0: never)")
    return dataclasses.replace(recipe, goal=GOALS[recipe.level])


def check_value(name: str, value: Any) -> None:
    """Checks the range of a setting; the classes of the runs check what depends on other settings.

    Raises:
        ValueError: The value is out of range.
    """
    least, most = AT_LEAST.get(name, 0), AT_MOST.get(name, math.inf)
    for number in value if isinstance(value, tuple) else (value,):
        if isinstance(number, str):
            continue
        if not -math.inf < number < math.inf:
            raise ValueError(f"{name} must be a finite number, not {number}")
        if name in MAY_BE_NEGATIVE:
            continue
        if number < 0 or (number == 0 and name not in MAY_BE_ZERO):
            expected = "a non-negative number" if name in MAY_BE_ZERO else "a positive number"
            raise ValueError(f"{name} must be {expected}, not {number}")
        if number < least:
            raise ValueError(f"{name} must be at least {least}, not {number}")
        if number > most:
            raise ValueError(f"{name} must be from {least} to {most}, not {number}")
