"""The folder of one training: files that are there whole or not at all, and a recipe that stays."""

import json
import os
import pathlib
from dataclasses import asdict


class RunFolder:
    """Raises ValueError when the folder holds a training by another recipe (a dataclass)."""

    def __init__(self, path, recipe):
        self.path = pathlib.Path(path)
        self.path.mkdir(parents=True, exist_ok=True)
        text = json.dumps(asdict(recipe), indent=1) + "\n"
        kept = self.path / "recipe.json"
        if kept.is_file() and kept.read_text() != text:
            raise ValueError(f"{path} holds a training by another recipe{_differences(kept, json.loads(text))}; give "
                             "another folder, or remove it")
        kept.write_text(text)

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


def _differences(kept, wanted):
    """" (rate 0.0001 there, 0.0003 here)"; nothing where what is there cannot be read."""
    try:
        there = json.loads(kept.read_text())
    except ValueError:
        return ""
    if not isinstance(there, dict):
        return ""
    names = [name for name in {**there, **wanted} if there.get(name) != wanted.get(name)]
    return " (" + ", ".join(f"{name} {there.get(name)!r} there, {wanted.get(name)!r} here" for name in names) + ")"
