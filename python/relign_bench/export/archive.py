"""Archives of results that can be replayed without a network: the results, the plugins and the wheels that made them."""

from __future__ import annotations

import hashlib
import pathlib
import shlex
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
# This archive's packages and plugins alone, whatever the caller works with.
unset PYTHONPATH PYTHONHOME RELIGN_PYTHON RELIGN_PLUGIN_PATH
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
                  suite_folder: str | os.PathLike[str] | None = None) -> tuple[int, list[str]]:
    """Writes an archive with a script `verify`, which replays the results in a bare system with Python.

    Args:
        results: A results folder.
        folder: Folder to create.
        plugins: Folders or scripts of the methods, scenes and noise levels that are not in the wheel of relign-bench; those in
            `suite_folder` are copied with it alone.
        wheels: The wheel of relign-bench and those that the plugins need, for one version of Python.
        suite_folder: Folder with the files that the suite names. Results folders and wheels in it are left out.

    Returns:
        Number of files, and what was left out of `suite_folder`.

    Raises:
        ValueError: The wheel of relign-bench is missing, two plugins have one name, or `folder` is inside a folder to copy.
        OSError: A file cannot be read or written.
    """
    if not any(pathlib.Path(wheel).name.startswith("relign_bench-") for wheel in wheels):
        raise ValueError("an archive needs the wheel of relign-bench (./quickstart wheel); give --wheel FILE")
    suite = None if suite_folder is None else pathlib.Path(suite_folder).resolve()
    places = {}  # of plugins in the archive
    for plugin in (pathlib.Path(plugin).resolve() for plugin in plugins):
        inside = suite is not None and plugin.is_relative_to(suite)
        places[plugin] = f"suite/{plugin.relative_to(suite).as_posix()}" if suite and inside else f"plugins/{plugin.name}"
    if len(set(places.values())) < len(plugins):
        raise ValueError("two plugins of an archive have the same name; rename the folder of one")
    for source in (results, *plugins, *([] if suite_folder is None else [suite_folder])):
        if pathlib.Path(folder).resolve().is_relative_to(pathlib.Path(source).resolve()):
            raise ValueError(f"an archive cannot be inside '{source}', which it copies; choose another folder")
    left_out: list[str] = []

    def ignored_of_suite(directory: str, names: list[str]) -> set[str]:
        others = {name for name in names if name.endswith(".whl") or _is_results(pathlib.Path(directory, name))}
        left_out.extend(sorted(str(pathlib.Path(directory, name)) for name in others))
        return others | ignored(directory, names)

    with new_folder(folder) as target:
        ignored = shutil.ignore_patterns("__pycache__", "verify.json")
        shutil.copytree(results, target / "results", ignore=ignored)
        (target / "suite").mkdir()
        if suite_folder is not None:
            shutil.copytree(suite_folder, target / "suite", ignore=ignored_of_suite, dirs_exist_ok=True)
        (target / "plugins").mkdir()
        (target / "wheels").mkdir()
        for source, place in [*places.items(), *((wheel, f"wheels/{wheel.name}") for wheel in map(pathlib.Path, wheels))]:
            if place.startswith("suite/"):
                continue
            if source.is_dir():
                shutil.copytree(source, target / place, ignore=ignored)
            else:
                shutil.copy2(source, target / place)
        script = target / "verify"
        options = "".join(f' --plugin "$here"/{shlex.quote(place)}' for place in places.values())
        script.write_text(VERIFY.replace("PLUGINS", options), encoding="utf-8")
        script.chmod(0o755)
        files = sorted(path for path in target.rglob("*") if path.is_file())
        (target / "SHA256SUMS").write_text("".join(
            f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(target).as_posix()}\n" for path in files))
    return len(files), left_out


def _is_results(folder: pathlib.Path) -> bool:
    return (folder / "manifest.json").is_file() and (folder / "trials").is_dir()
