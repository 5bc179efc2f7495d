"""What plugins of every kind share: the class is the manifest, parameters are class attributes."""

from __future__ import annotations

from .parameters import set_parameters

TYPE_CHECKING = False  # as typing.TYPE_CHECKING, without the time that importing typing takes
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any, ClassVar


class Plugin:
    """Base of all plugins. Derive from Optimizer, Agent, Scene, Station or NoiseLevel instead.

    Args:
        **given: Parameters by name. Those that are not given keep the value that is already set, else get their default.
            A class may have an `__init__` without arguments instead; its parameters are set before it is called.

    Raises:
        TypeError: A parameter is not declared.
    """

    kind: ClassVar[str] = ""
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {}

    def __init__(self, **given: Any) -> None:
        set_parameters(self, given)

    def _missing(self, method: str) -> NotImplementedError:
        return NotImplementedError(f"{type(self).__name__} has no {method}")
