"""Error messages that several modules share."""

from __future__ import annotations

import difflib
import math
import operator
from collections.abc import Iterable
from typing import Any

LARGEST_INTEGER = 2**63 - 1
LARGEST_SEED = 2**64 - 1


def unknown_name(what: str, name: object, allowed: Iterable[str]) -> str:
    """The message for a name that is not among those allowed, with the closest one as a suggestion.

    Args:
        what: Kind of the name, singular, such as "reward".
        name: The name that was given.
        allowed: The names that exist.

    Returns:
        One sentence: "unknown reward 'papper'; did you mean 'paper'? rewards: paper, score".
    """
    names = list(allowed)
    close = difflib.get_close_matches(str(name), names, 1)
    hint = f" did you mean '{close[0]}'?" if close else ""
    return f"unknown {what} '{name}';{hint} {what}s: {', '.join(names)}"


def check_name(name: str, allowed: Iterable[str], what: str) -> None:
    """Raises ValueError when `name` is not among the names allowed; see `unknown_name`."""
    names = list(allowed)
    if name not in names:
        raise ValueError(unknown_name(what, name, names))


def require_integer(number: Any, name: str, least: int, most: int = LARGEST_INTEGER) -> int:
    """`number` as an int.

    Args:
        number: What was given.
        name: Its name, for the message.
        least: The smallest number allowed, 0 or 1.
        most: The largest number allowed.

    Raises:
        ValueError: It is not an integer, or out of range.
    """
    try:
        value = least - 1 if isinstance(number, bool) else operator.index(number)
    except TypeError:
        value = least - 1
    if not least <= value <= most:
        allowed = f"an integer from {least} to {most}" if value > most else (
            "a positive integer" if least else "a non-negative integer")
        raise ValueError(f"{name} must be {allowed}, not {number!r}")
    return value


def require_seeds(seeds: Iterable[Any]) -> list[int]:
    """Seeds of captures or rays as a list of int.

    Raises:
        ValueError: One is not an integer from 0 to 2**64 - 1.
    """
    return [require_integer(seed, "seed", 0, LARGEST_SEED) for seed in seeds]


def require_number(number: Any, name: str) -> float:
    """`number` as a float.

    Raises:
        ValueError: It is a text, a bool or something else that does not convert to a float, or it is not finite.
    """
    try:
        value = math.nan if isinstance(number, (str, bytes, bytearray, bool)) else float(number)
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{name} must be a finite number, not {number!r}")
    return value


def require_flag(flag: Any, name: str) -> bool:
    """`flag` as a bool.

    Raises:
        ValueError: It is neither True nor False (or 1 or 0); the message has its name.
    """
    if flag not in (True, False):
        raise ValueError(f"{name} must be True or False, not {flag!r}")
    return bool(flag)
