"""Info dictionaries of the environments, with values that are computed when they are read."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, ItemsView, Iterator, Mapping, ValuesView

NOTHING = object()


class Later:
    """A value that the first call computes and later calls repeat."""

    def __init__(self, compute: Callable[[], Any]) -> None:
        self._compute: Callable[[], Any] | None = compute
        self._value: Any = None

    def __call__(self) -> Any:
        """The value."""
        if self._compute is not None:
            self._value, self._compute = self._compute(), None
        return self._value


class Info(dict[str, Any]):
    """A dictionary that replaces each value of class Later by what it computes, as soon as that value is read.

    Keys can be listed and tested without computing. Reading all values, as `dict(info)`, `info.items()`, `==`, `repr` and
    pickle do, computes them. Copies share the computation.
    """

    def __getitem__(self, key: str) -> Any:
        value = super().__getitem__(key)
        if isinstance(value, Later):
            value = value()
            self[key] = value
        return value

    def __iter__(self) -> Iterator[str]:
        return super().__iter__()  # because of this method dict(info) and {**info} read by __getitem__

    def all(self) -> dict[str, Any]:
        """A plain dictionary with all values."""
        return {key: self[key] for key in self}

    def get(self, key: str, default: Any = None) -> Any:
        """As of dict."""
        try:
            return self[key]
        except KeyError:
            return default

    def items(self) -> ItemsView[str, Any]:  # type: ignore[override]
        """As of dict."""
        return self.all().items()

    def values(self) -> ValuesView[Any]:  # type: ignore[override]
        """As of dict."""
        return self.all().values()

    def setdefault(self, key: str, default: Any = None) -> Any:
        """As of dict."""
        super().setdefault(key, default)
        return self[key]

    def pop(self, key: str, default: Any = NOTHING) -> Any:
        """As of dict."""
        if key not in self and default is not NOTHING:
            return default
        value = self[key]
        del self[key]
        return value

    def popitem(self) -> tuple[str, Any]:
        """As of dict."""
        key, value = super().popitem()
        return key, value() if isinstance(value, Later) else value

    def copy(self) -> Info:
        """A copy, which shares the computation."""
        return Info(super().items())

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Info:
        return Info({key: value if isinstance(value, Later) else copy.deepcopy(value, memo)
                     for key, value in super().items()})

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        return dict, (self.all(),)

    def __or__(self, other: Mapping[str, Any]) -> dict[str, Any]:  # type: ignore[override]
        return {**self, **other}

    def __ror__(self, other: Mapping[str, Any]) -> dict[str, Any]:  # type: ignore[override]
        return {**other, **self}

    def __eq__(self, other: object) -> bool:
        return self.all() == other

    def __ne__(self, other: object) -> bool:
        return self.all() != other

    __hash__ = None

    def __repr__(self) -> str:
        return repr(self.all())
