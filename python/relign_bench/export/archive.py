"""Archives of results that can be replayed without a network: the results, the plugins and the wheels that made them."""

from __future__ import annotations

import hashlib
import pathlib
import shutil
from typing import TYPE_CHECKING

from .runs import new_folder

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

VERIFY = """#!/bin/sh
# Installs the wheels of this archive in a new environment and replays its results, without a network. Needs Python with
# venv, for which the wheels were built. Arguments are those of relign-bench verify, such as --sample 20.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
environment=${RELIGN_ENVIRONMENT:-$(mktemp -d)/environment}
(cd "$here" && sha256sum --quiet --check SHA256SUMS)
python3 -m venv "$environment"
"$environment/bin/python" -m pip install --quiet --no-index --no-deps "$here"/wheels/*.whl
cp -r "$here/results" "$environment/results" # verify writes what it found
exec "$environment/bin/relign-bench" verify "$environment/results" --suite-folder "$here/suite"PLUGINS "$@"
"""


def write_archive(results: str | os.PathLike[str], folder: str | os.PathLike[str],
                  plugins: Sequence[str | os.PathLike[str]] = (), wheels: Sequence[str | os.PathLike[str]] = (),
                  suite_folder: str | os.PathLike[str] | None = None) -> int:
    """Writes an archive with a script `verify`, which replays the results in a bare system with Python.

    Args:
        results: A results folder.
        folder: Folder to create.
        plugins: Folders or scripts of the methods, scenes and noise levels that are not in the wheel of relign-bench.
        wheels: The wheel of relign-bench and those that the plugins need, for one version of Python.
        suite_folder: Folder with the files that the suite names.

    Returns:
        Number of files.

    Raises:
        ValueError: There is no wheel of relign-bench, two plugins have the same name, or `folder` is inside a folder to copy.
        OSError: A file cannot be read or written.
    """
    if not any(pathlib.Path(wheel).name.startswith("relign_bench-") for wheel in wheels):
        raise ValueError("an archive needs the wheel of relign-bench (./quickstart wheel); give --wheel FILE")
    names = [pathlib.Path(plugin).resolve().name for plugin in plugins]
    if len(set(names)) < len(names):
        raise ValueError("two plugins of an archive have the same name; rename the folder of one")
    for source in (results, *plugins, *([] if suite_folder is None else [suite_folder])):
        if pathlib.Path(folder).resolve().is_relative_to(pathlib.Path(source).resolve()):
            raise ValueError(f"an archive cannot be inside '{source}', which it copies; choose another folder")
    with new_folder(folder) as target:
        ignored = shutil.ignore_patterns("__pycache__", "verify.json")
        shutil.copytree(results, target / "results", ignore=ignored)
        (target / "suite").mkdir()
        if suite_folder is not None:
            shutil.copytree(suite_folder, target / "suite", ignore=ignored, dirs_exist_ok=True)
        for kind, sources in (("plugins", plugins), ("wheels", wheels)):
            (target / kind).mkdir()
            for source in map(pathlib.Path, sources):
                place = target / kind / source.resolve().name
                if source.is_dir():
                    shutil.copytree(source, place, ignore=ignored)
                else:
                    shutil.copy2(source, place)
        script = target / "verify"
        script.write_text(VERIFY.replace("PLUGINS", "".join(f' --plugin "$here/plugins/{name}"' for name in names)))
        script.chmod(0o755)
        files = sorted(path for path in target.rglob("*") if path.is_file())
        (target / "SHA256SUMS").write_text("".join(
            f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(target).as_posix()}\n" for path in files))
    return len(files)
