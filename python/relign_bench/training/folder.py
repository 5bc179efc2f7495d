"""The folder of a training run: atomic file writes, and a recipe that must not change."""

from __future__ import annotations

import contextlib
import fcntl
import io
import json
import os
import pathlib
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, BinaryIO, Union

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    Path = Union[str, os.PathLike[str]]


def check_same(path: Path, recipe: Any, may_grow: Collection[str] = (), ignored: Collection[str] = ()) -> None:
    """Checks that a folder has no run with another recipe.

    Args:
        path: The folder.
        recipe: The recipe, a dataclass.
        may_grow: Names of integers that may be larger than in the recipe that is already there.
        ignored: Names of settings that are not compared.

    Raises:
        ValueError: It has.
    """
    file = pathlib.Path(path) / "recipe.json"
    if not file.is_file():
        return
    kept, wanted = _read(file), _as_json(recipe)
    changed = [name for name in {**kept, **wanted} if kept.get(name) != wanted.get(name) and name not in ignored]
    if not all(name in may_grow and _grew(kept.get(name), wanted.get(name)) for name in changed):
        raise ValueError(f"'{path}' has a run with another recipe{_difference(changed, kept, wanted)}; choose another folder, "
                         "or remove this one")


class RunFolder:
    """The folder of a run; it is created, and the recipe is written to recipe.json.

    Args:
        path: The folder.
        recipe: The recipe, a dataclass.
        may_grow: Names of integers that may be larger than in the recipe that is already there, which is then replaced.

    Raises:
        ValueError: The folder has a run with another recipe.
    """

    def __init__(self, path: Path, recipe: Any, may_grow: Collection[str] = ()) -> None:
        self.path = pathlib.Path(path)
        self.path.mkdir(parents=True, exist_ok=True)
        check_same(path, recipe, may_grow)
        self.keep_text("recipe.json", json.dumps(_as_json(recipe), indent=1) + "\n")

    def __truediv__(self, name: str) -> pathlib.Path:
        return self.path / name

    def keep(self, name: str, write: Callable[[BinaryIO], object]) -> None:
        """Replaces a file atomically: after a crash it has its old content or the new one.

        Args:
            name: Name of the file.
            write: Writes the content to a binary file.
        """
        content = io.BytesIO()  # writers report a full disk in words of their own, files as OSError
        write(content)
        half = self.path / (name + ".half")
        try:
            with open(half, "wb") as out:
                out.write(content.getbuffer())
                out.flush()
                os.fsync(out.fileno())
            os.replace(half, self.path / name)
        except OSError:
            half.unlink(missing_ok=True)
            raise

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Keeps other processes from training in the folder.

        Raises:
            ValueError: One does.
        """
        with open(self.path / "lock", "wb") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise ValueError(f"another process trains in '{self.path}'; wait for it, or end it") from None
            yield

    def keep_text(self, name: str, text: str) -> None:
        """As `keep`, for a text in UTF-8."""
        self.keep(name, lambda out: out.write(text.encode()))


def _as_json(recipe: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(json.dumps(asdict(recipe)))
    return found


def _read(file: pathlib.Path) -> dict[str, Any]:
    """The recipe; {} if it cannot be read."""
    try:
        recipe = json.loads(file.read_text())
    except ValueError:
        return {}
    return recipe if isinstance(recipe, dict) else {}


def _grew(before: object, now: object) -> bool:
    return isinstance(before, int) and isinstance(now, int) and before < now


def _difference(names: list[str], kept: dict[str, Any], wanted: dict[str, Any]) -> str:
    """" (rate: 0.0001 in the folder, 0.0003 given)"; "" if the recipe in the folder could not be read."""
    if not kept:
        return ""
    return " (" + ", ".join(f"{name}: {kept.get(name)!r} in the folder, {wanted.get(name)!r} given" for name in names) + ")"
