"""What a message about an optional ability of an assembly contains, and what a method returned, checked."""

from __future__ import annotations

import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

PIXELS = "pixels"
IMAGES = "pixels of axes + 1 + 5 elements images"


class Ability:
    """One ability.

    Args:
        arguments: The kind of each argument, by name.
        results: The kind of each result, by name, in the order in which the method returns them.
        each: The argument that has one row of results for each of its values; "" for one row.
        offered: The scene's attribute that says beforehand whether its assemblies have it; "" for none.
    """

    def __init__(self, arguments: dict[str, str], results: dict[str, str], each: str = "", offered: str = "") -> None:
        self.arguments = arguments
        self.results = results
        self.each = each
        self.offered = offered

    def given(self, message: dict[str, Any]) -> list[Any]:
        """The arguments of the method."""
        values = []
        for name, kind in self.arguments.items():
            value = message[name]
            if kind == "numbers":
                value = pose_of(value)
            elif kind == "regions":
                value = [tuple(region) for region in value]
            values.append(value)
        return values

    def answer(self, returned: Any, message: dict[str, Any], giver: str,
               called: dict[str, str]) -> tuple[dict[str, Any], list[Any]]:
        """The members of the answer, and the images.

        Args:
            returned: What the method returned.
            message: The request.
            giver: The method.
            called: What errors call a result, by its name; others by their own.
        """
        if self.each:
            count = len(message[self.each])
            rows = values_of(returned, giver, [f"row {i}" for i in range(count)])
            table = [self._row(row, giver, called)[0] for row in rows]
            return {name: [row[name] for row in table] for name in self.results}, []
        answer, images = self._row(returned, giver, called)
        if IMAGES in self.results.values():
            named = {kind: message[name] for name, kind in self.arguments.items()}
            slopes = range(len(named["numbers"]) + 5 * len(named["counts"]))
            images = values_of(images[0], giver, ["image", *(f"slope {number}" for number in slopes)])
        return answer, list(images)

    def _row(self, returned: Any, giver: str, called: dict[str, str]) -> tuple[dict[str, Any], list[Any]]:
        names = [called.get(name, name) for name in self.results]
        values = [returned] if len(names) == 1 else values_of(returned, giver, names)
        members: dict[str, Any] = {}
        images = []
        for value, (name, kind) in zip(values, self.results.items()):
            what = f"the {called.get(name, name)} of {giver}"
            if kind in (PIXELS, IMAGES):
                images.append(value)
            elif kind == "pose":
                members[name] = [number_of(part, what) for part in value]
            elif kind == "integer":
                members[name] = int(value)
            elif kind == "number" and _is_nan(value):
                members[name] = None
            else:
                members[name] = number_of(value, what)
        return members, images


def pose_of(values: list[float | None]) -> tuple[float, ...]:
    """A pose of a message."""
    return tuple(math.nan if value is None else float(value) for value in values)


def values_of(returned: Any, giver: str, names: Sequence[str]) -> list[Any]:
    """As many values as names.

    Raises:
        TypeError: The method returned something else.
    """
    numbers = {2: "two", 3: "three", 4: "four"}
    values = list(returned) if hasattr(returned, "__iter__") and not isinstance(returned, (bytes, str)) else None
    if values is None or len(values) != len(names):
        found = type(returned).__name__ + ("" if values is None else f" of {len(values)}")
        expected = f"{numbers.get(len(names), len(names))} values ({', '.join(names)})"
        raise TypeError(f"{giver} returned {found}, expected {expected}")
    return values


def number_of(value: Any, what: str) -> float:
    """A finite number.

    Raises:
        TypeError: It is not a number.
        ValueError: It is not finite.
    """
    try:
        if isinstance(value, (bool, str, bytes)):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{what} is {value!r}, expected a number") from None
    if not math.isfinite(number):
        raise ValueError(f"{what} is {value!r}, expected a finite number")
    return number


def _is_nan(value: Any) -> bool:
    try:
        return math.isnan(value)
    except TypeError:
        return False
