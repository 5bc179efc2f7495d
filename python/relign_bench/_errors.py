"""Error messages that several modules share."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


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
