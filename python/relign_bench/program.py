"""The program `relign-bench` of the self-contained wheel, as a command of the Python environment."""

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


def main() -> NoReturn:
    """Replaces this process by the program in the package. Exits with a message where the package has none."""
    if not PROGRAM.is_file():
        sys.exit("relign-bench: this installation of relign_bench has no program; install the self-contained wheel, or build "
                 "from a clone")
    os.environ.setdefault("RELIGN_PYTHON", sys.executable)
    os.execv(PROGRAM, ["relign-bench", *sys.argv[1:]])
