#!/usr/bin/env python3
"""dpkg-shlibdeps for another architecture: finds libraries in a root that debian_root.py made, not in this machine's.

cpack calls it in the place of dpkg-shlibdeps (./quickstart aarch64); RELIGN_DEBIAN_ROOT is the folder that debian_root.py made.
dpkg-shlibdeps looks up the full path of a library in dpkg's database, so it gets a database with the paths inside the root, and
with the packages' symbols files, which have the versions that are needed.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile


def write_database(folder, database):
    """Writes what dpkg-shlibdeps reads of dpkg's database, for the packages in FOLDER/debs, unpacked in FOLDER/root."""
    root = folder / "root"
    installed = root / "var" / "lib" / "dpkg"
    (database / "info").mkdir(parents=True)
    shutil.copy(installed / "status", database / "status")
    for listed in (installed / "info").glob("*.list"):
        # In the root, /lib is a link to /usr/lib.
        files = re.sub(r"^/(?=(?:lib|bin|sbin)(?:/|$))", "/usr/", listed.read_text(), flags=re.MULTILINE)
        (database / "info" / listed.name).write_text(re.sub(r"^(?=/)", str(root), files, flags=re.MULTILINE))
    for deb in sorted((folder / "debs").glob("*.deb")):
        control = database / "control"
        subprocess.run(["dpkg-deb", "--control", deb, control], check=True)
        name = re.search(r"^Package: (\S+)", (control / "control").read_text(), re.MULTILINE)[1]
        for kind in ("symbols", "shlibs"):
            if (control / kind).exists():
                shutil.copy(control / kind, database / "info" / f"{name}.{kind}")
        shutil.rmtree(control)


def main(words):
    """Runs dpkg-shlibdeps; returns its exit status."""
    if {"--help", "--version"} & set(words):
        return subprocess.run(["dpkg-shlibdeps", *words], check=False).returncode
    folder = pathlib.Path(os.environ["RELIGN_DEBIAN_ROOT"]).resolve()
    with tempfile.TemporaryDirectory() as scratch:
        write_database(folder, pathlib.Path(scratch) / "dpkg")
        folders = [f"-l{path}" for path in sorted((folder / "root" / "usr" / "lib").glob("*-linux-gnu"))]
        return subprocess.run(["dpkg-shlibdeps", f"--admindir={scratch}/dpkg", *folders, *words], check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
