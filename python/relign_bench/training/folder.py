"""The folder of one training: files that are there whole or not at all, and a recipe that stays."""

import json
import os
import pathlib
from dataclasses import asdict


class RunFolder:
    """Raises ValueError when the folder holds a training by another recipe (a dataclass). The numbers in may_grow may be larger
    than in the recipe that is there, which is then the new one."""

    def __init__(self, path, recipe, may_grow=()):
        self.path = pathlib.Path(path)
        self.path.mkdir(parents=True, exist_ok=True)
        wanted = json.loads(json.dumps(asdict(recipe)))
        kept = self.path / "recipe.json"
        if kept.is_file():
            there = _read(kept)
            other = [name for name in {**there, **wanted} if there.get(name) != wanted.get(name)]
            if not all(name in may_grow and _grew(there.get(name), wanted.get(name)) for name in other):
                raise ValueError(f"{path} holds a training by another recipe{_told(other, there, wanted)}; give another "
                                 "folder, or remove it")
        self.keep_text("recipe.json", json.dumps(wanted, indent=1) + "\n")

    def __truediv__(self, name):
        return self.path / name

    def keep(self, name, write):
        """write(binary file) makes the file's content; a crash leaves the one before."""
        half = self.path / (name + ".half")
        with open(half, "wb") as out:
            write(out)
            out.flush()
            os.fsync(out.fileno())
        os.replace(half, self.path / name)

    def keep_text(self, name, text):
        self.keep(name, lambda out: out.write(text.encode()))


def _read(kept):
    """The recipe; an empty one where it cannot be read."""
    try:
        there = json.loads(kept.read_text())
    except ValueError:
        return {}
    return there if isinstance(there, dict) else {}


def _grew(before, now):
    return isinstance(before, int) and isinstance(now, int) and before < now


def _told(names, there, wanted):
    """" (rate 0.0001 there, 0.0003 here)"; nothing where what is there could not be read."""
    if not there:
        return ""
    return " (" + ", ".join(f"{name} {there.get(name)!r} there, {wanted.get(name)!r} here" for name in names) + ")"
