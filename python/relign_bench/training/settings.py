"""Settings of recipes as texts of the form NAME=VALUE."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from .._errors import unknown_name
from .recipe import GOALS, PRESETS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeVar

    from .recipe import Recipe

    AnyRecipe = TypeVar("AnyRecipe")

MAY_BE_ZERO = ("seed", "weight", "captures", "warm_up", "level", "levels", "goal", "entropy", "target_kl", "last_rate", "near",
               "visited", "gamma", "gae_lambda")
MAY_BE_NEGATIVE = ("first_log_std",)
AT_LEAST = {"optimum_samples": 16}
SHARES = ("levels", "near", "visited", "gamma", "gae_lambda")
INTEGERS = ("heads",)  # tuples of integers; other tuples have floats
MAY_BE_EMPTY = ("heads",)


def with_settings(recipe: AnyRecipe, settings: Sequence[str]) -> AnyRecipe:
    """A recipe with settings of the form NAME=VALUE applied.

    Where the learning rate of the recipe is constant, `rate` without `last_rate` keeps it so.

    Raises:
        ValueError: A name is unknown, or a value is not valid.
    """
    names = [field.name for field in dataclasses.fields(recipe)]  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise ValueError(f"--set {setting}: expected NAME=VALUE")
        if name not in names:
            raise ValueError(f"--set {setting}: {unknown_name('setting', name, names)}")
        values[name] = _parsed(setting, name, text, type(getattr(recipe, name)))
        check_value(setting, name, values[name])
    given = dataclasses.asdict(recipe)  # type: ignore[call-overload]
    if "rate" in values and "last_rate" in given and given["last_rate"] == given["rate"]:
        values.setdefault("last_rate", values["rate"])
    return dataclasses.replace(recipe, **values)  # type: ignore[type-var]


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


def check_value(setting: str, name: str, value: Any) -> None:
    """Checks the range of a setting; the classes of the runs check what depends on other settings.

    Raises:
        ValueError: The value is out of range.
    """
    for number in value if isinstance(value, tuple) else (value,):
        if isinstance(number, str) or name in MAY_BE_NEGATIVE:
            continue
        if not math.isfinite(number) or number < 0 or (number == 0 and name not in MAY_BE_ZERO):
            expected = "a non-negative number" if name in MAY_BE_ZERO else "a positive number"
            raise ValueError(f"--set {setting}: {name} must be {expected}")
        if number < AT_LEAST.get(name, 0):
            raise ValueError(f"--set {setting}: {name} must be at least {AT_LEAST[name]}")
        if name in SHARES and number > 1:
            raise ValueError(f"--set {setting}: {name} must be from 0 to 1")
