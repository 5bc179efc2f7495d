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

from .._json import unique_keys

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    Path = Union[str, os.PathLike[str]]

KINDS = {"algorithm": "ppo", "lenses": "imitate", "pool": "imitate", "trained": "adapt"}
"""Verbs by a setting that only their recipes have."""


def kind_of(recipe: dict[str, Any]) -> str:
    """The verb of relign-train that a recipe is of; "" if it is of none."""
    return next((verb for name, verb in KINDS.items() if name in recipe), "")


def read_recipe(path: Path, *kinds: str) -> dict[str, Any]:
    """The recipe of the run in a folder.

    Args:
        path: The folder.
        kinds: Verbs of relign-train, one of which the run must be of; none: any.

    Raises:
        ValueError: The folder has no run, one of another verb, or a recipe.json that cannot be read.
    """
    file = pathlib.Path(path) / "recipe.json"
    if not file.is_file():
        raise ValueError(f"'{path}' is not the folder of a run: it has no recipe.json")
    try:
        recipe = json.loads(file.read_text(), object_pairs_hook=unique_keys)
        if not isinstance(recipe, dict) or not kind_of(recipe):
            raise ValueError("not a recipe of relign-train")
    except ValueError as problem:
        raise ValueError(f"'{file}' cannot be read: {problem}; restore it from a copy, or choose another folder") from None
    if kinds and kind_of(recipe) not in kinds:
        raise ValueError(f"'{path}' is the folder of a run of relign-train {kind_of(recipe)}; expected one of relign-train "
                         f"{' or '.join(kinds)}")
    return recipe


def check_same(path: Path, recipe: Any, may_grow: Collection[str] = (), ignored: Collection[str] = ()) -> None:
    """Checks that a folder has no run with another recipe.

    Args:
        path: The folder.
        recipe: The recipe, a dataclass.
        may_grow: Names of integers that may be larger than in the recipe that is already there.
        ignored: Names of settings that are not compared.

    Raises:
        ValueError: It has, or its recipe cannot be read.
    """
    if not (pathlib.Path(path) / "recipe.json").is_file():
        return
    wanted = _as_json(recipe)
    kept = read_recipe(path, kind_of(wanted))
    changed = [name for name in {**kept, **wanted} if kept.get(name) != wanted.get(name) and name not in ignored]
    if not all(name in may_grow and _grew(kept.get(name), wanted.get(name)) for name in changed):
        difference = ", ".join(f"{name}: {kept.get(name)!r} in the folder, {wanted.get(name)!r} given" for name in changed)
        raise ValueError(f"'{path}' has a run with another recipe ({difference}); choose another folder, or remove this one")


@contextlib.contextmanager
def reading(path: Path) -> Iterator[None]:
    """While a checkpoint is read: reports one that is damaged or of another run.

    Raises:
        ValueError: It is.
    """
    try:
        yield
    except (OSError, MemoryError):
        raise
    except Exception as problem:  # torch reports damaged files by exceptions of many kinds
        if type(problem).__name__ == "OutOfMemoryError":  # of torch
            raise
        raise ValueError(f"'{path}' is damaged or of another run ({type(problem).__name__}); restore it from a copy, or choose "
                         "another folder") from None


class RunFolder:
    """The folder of a run; `alone` creates it.

    Args:
        path: The folder.
        recipe: The recipe, a dataclass.
        may_grow: Names of integers that may be larger than in the recipe that is already there, which is then replaced.

    Raises:
        ValueError: The folder has a run with another recipe.
    """

    def __init__(self, path: Path, recipe: Any, may_grow: Collection[str] = ()) -> None:
        self.path = pathlib.Path(path)
        self._recipe, self._may_grow = recipe, may_grow
        self._checkpoint = self._version()
        check_same(path, recipe, may_grow)

    def __truediv__(self, name: str) -> pathlib.Path:
        return self.path / name

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Keeps other processes from training in the folder, and writes recipe.json.

        What can fail without training is done before, so that a mistake can be corrected with the same folder.

        Raises:
            ValueError: Another process trains there, or has trained since this folder was opened, or it has a run with
                another recipe by now.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        with open(self.path / "lock", "wb") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise ValueError(f"another process trains in '{self.path}'; wait for it, or end it") from None
            if self._version() != self._checkpoint:
                raise ValueError(f"another process has trained in '{self.path}' meanwhile; run the same command again")
            check_same(self.path, self._recipe, self._may_grow)
            self.keep_text("recipe.json", json.dumps(_as_json(self._recipe), indent=1) + "\n")
            try:
                yield
            finally:
                self._checkpoint = self._version()

    def _version(self) -> tuple[int, int]:
        try:
            file = (self.path / "checkpoint.pt").stat()
        except OSError:
            return 0, 0
        return file.st_ino, file.st_mtime_ns

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

    def keep_text(self, name: str, text: str) -> None:
        """As `keep`, for a text in UTF-8."""
        self.keep(name, lambda out: out.write(text.encode()))


def _as_json(recipe: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(json.dumps(asdict(recipe)))
    return found


def _grew(before: object, now: object) -> bool:
    return isinstance(before, int) and isinstance(now, int) and before < now
