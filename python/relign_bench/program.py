"""The program `relign-bench` of the self-contained wheel, as a command of the Python environment."""

from __future__ import annotations

import os
import pathlib
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Replaces this process by the program in the package. Exits with a message where the package has none."""
    program = pathlib.Path(__file__).parent / "bin" / "relign-bench"
    if not program.is_file():
        sys.exit("relign-bench: this installation of relign_bench has no program; install the self-contained wheel, or build "
                 "from a clone")
    os.environ.setdefault("RELIGN_PYTHON", sys.executable)
    os.execv(program, ["relign-bench", *sys.argv[1:]])
