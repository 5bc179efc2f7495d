"""The program `relign-bench` of the self-contained wheel, as a command of the Python environment, and the example files."""

from __future__ import annotations

import os
import pathlib
import shutil
import sys
from typing import NoReturn

PROGRAM = pathlib.Path(__file__).parent / "bin" / "relign-bench"


def find_program() -> str:
    """Path of the program: the package's own, else the one on PATH.

    Raises:
        FileNotFoundError: There is none.
    """
    found = str(PROGRAM) if PROGRAM.is_file() else shutil.which("relign-bench")
    if not found:
        raise FileNotFoundError("the program relign-bench is not on PATH; install the self-contained wheel or the Debian "
                                "package, or put BUILD_FOLDER/bin on PATH")
    return found


def find_example(name: str) -> pathlib.Path:
    """Path of a file or folder of `examples`, as the wheel, the Debian package and a clone have it.

    Args:
        name: Its path below `examples`, such as "lens/triplet.zmx".

    Raises:
        FileNotFoundError: This installation has no such example.
    """
    here = pathlib.Path(__file__)  # in a build folder a link to the sources
    # The wheel has share/relign-bench in the package; the Debian package and a clone have examples two folders above it.
    folders = [here.parent / "share" / "relign-bench" / "examples", here.resolve().parents[2] / "examples"]
    for folder in folders:
        if (folder / name).exists():
            return folder / name
    raise FileNotFoundError(f"no example '{name}' in {' or '.join(map(str, folders))}: install the self-contained wheel or the "
                            "Debian package, or take the file from the folder examples of a clone")


def main() -> NoReturn:
    """Replaces this process by the program in the package. Exits with a message where the package has none."""
    if not PROGRAM.is_file():
        sys.exit("relign-bench: this installation of relign_bench has no program; install the self-contained wheel, or build "
                 "from a clone")
    os.environ.setdefault("RELIGN_PYTHON", sys.executable)
    os.execv(PROGRAM, ["relign-bench", *sys.argv[1:]])
