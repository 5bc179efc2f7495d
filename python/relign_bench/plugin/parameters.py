"""Parameters of a plugin: class attributes that the manifest declares and a trial sets."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any, TypeVar

    Made = TypeVar("Made")

KEYS = ("default", "minimum", "maximum", "allowed", "unit", "description")
TYPE_OF_CLASS = {bool: "boolean", int: "integer", float: "number", str: "text", list: "json", dict: "json"}


class Parameter:
    """Declaration of a parameter; the attribute of the same name of an object has the value.

    Args:
        default: Default value; None where the user must give one.
        type: "number", "integer", "boolean", "text", "json", "file" or "algorithm".
        minimum: Smallest value allowed.
        maximum: Largest value allowed.
        allowed: The values allowed.
        unit: Unit, for documentation.
        description: One phrase, for documentation.
    """

    def __init__(self, default: Any, type: str, minimum: float | None, maximum: float | None,
                 allowed: Sequence[str] | None, unit: str | None, description: str | None) -> None:
        self.default = default
        self.type = type
        self.minimum = minimum
        self.maximum = maximum
        self.allowed = allowed
        self.unit = unit
        self.description = description

    def declaration(self) -> dict[str, Any]:
        """The parameter as it is in the manifest."""
        entry = {"type": self.type}
        for key in KEYS:
            value = getattr(self, key)
            if value is not None:
                entry[key] = value
        return entry

    def convert(self, value: Any) -> Any:
        """A value from JSON as the plugin gets it: numbers as float."""
        return float(value) if self.type == "number" else value


def parameter(default: Any = None, *, minimum: float | None = None, maximum: float | None = None,
              allowed: Sequence[str] | None = None, unit: str | None = None, description: str | None = None,
              type: str | None = None) -> Any:
    """Declares a parameter as a class attribute.

    Args:
        default: Default value. Without one the user must give a value, and `type` is needed.
        minimum: Smallest value allowed.
        maximum: Largest value allowed.
        allowed: The values allowed.
        unit: Unit, for documentation.
        description: One phrase, for documentation.
        type: "number", "integer", "boolean", "text", "json", "file" (an absolute path) or "algorithm". By default it follows
            from the class of the default: float, int, bool, str; list and dict are "json".

    Returns:
        A Parameter. Objects of the class have its value under the same name.

    Raises:
        TypeError: The type does not follow from the default.
    """
    if type is None:
        if default is None:
            raise TypeError('a parameter without a default needs a type: type="number" (or integer, boolean, text, file, '
                            'algorithm, json)')
        type = TYPE_OF_CLASS.get(default.__class__)
        if type is None:
            raise TypeError(f"the default's class '{default.__class__.__name__}' does not imply a type: add type=...")
    return Parameter(default, type, minimum, maximum, allowed, unit, description)


def parameters_of(cls: type) -> dict[str, Parameter]:
    """The parameters that a class and its bases declare, by name."""
    found = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, Parameter):
                found[name] = value
    return found


def set_parameters(made: object, given: Mapping[str, Any]) -> None:
    """Sets the parameters of an object: those given, else what is already set, else the defaults.

    Raises:
        TypeError: A parameter is not declared.
    """
    declared = parameters_of(type(made))
    for name in given:
        if name not in declared:
            raise TypeError(f"{type(made).__name__} declares no parameter '{name}'")
    for name, entry in declared.items():
        if name in given:
            setattr(made, name, entry.convert(given[name]))
        elif name not in vars(made):
            setattr(made, name, entry.default)


def create(cls: type[Made], given: Mapping[str, Any]) -> Made:
    """An object of a plugin class; its parameters are set before `__init__` is called without arguments."""
    made = cls.__new__(cls)
    set_parameters(made, given)
    made.__init__()  # type: ignore[misc]
    return made
