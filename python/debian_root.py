"""Unpacks Debian packages and what they depend on, as if nothing were installed: `debian_root.py FOLDER PACKAGE ...`.

The folder is a root file system to compile against, to run programs of another architecture in, or to chroot into. Needs apt
with a network and no rights; scripts of the packages do not run. The sources are those of this machine's apt.
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys


def run(*command, **keywords):
    """What a command prints. Raises subprocess.CalledProcessError, with its messages."""
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True, **keywords).stdout


def download(folder, packages, architecture):
    """Downloads the packages into FOLDER/debs; lists of packages, too, for another architecture than this machine's."""
    (folder / "debs" / "partial").mkdir(parents=True)
    (folder / "status").touch()
    options = [f"Dir::State::status={folder}/status", f"Dir::Cache::archives={folder}/debs", "Debug::NoLocking=1",
               "APT::Sandbox::User=", "Dir::Cache::pkgcache=", "Dir::Cache::srcpkgcache="]
    if architecture != run("dpkg", "--print-architecture").strip():
        (folder / "lists" / "partial").mkdir(parents=True)
        options += [f"APT::Architecture={architecture}", f"APT::Architectures={architecture}",
                    f"Dir::State::Lists={folder}/lists"]
    apt = ["apt-get", "--quiet", "--yes", "--no-install-recommends", *(word for one in options for word in ("-o", one))]
    if (folder / "lists").exists():
        run(*apt, "update")
    run(*apt, "--download-only", "install", *packages)


def unpack(debs, root):
    """Unpacks all packages of a folder. Absolute links become relative ones, which a cross-compiler follows inside the root."""
    for name in ("bin", "sbin", "lib", "lib64"):
        (root / "usr" / name).mkdir(parents=True)
        (root / name).symlink_to(f"usr/{name}")
    database = root / "var" / "lib" / "dpkg"
    (database / "info").mkdir(parents=True)
    for deb in sorted(debs.glob("*.deb")):
        with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", deb], stdout=subprocess.PIPE) as data:
            run("tar", "--extract", "--keep-directory-symlink", "--directory", root, stdin=data.stdout)
        if data.returncode != 0:
            raise OSError(f"{deb.name} cannot be unpacked")
        name, control = run("dpkg-deb", "--field", deb, "Package"), run("dpkg-deb", "--field", deb)
        files = re.findall(r"^\S+\s+\S+\s+\d+\s+\S+\s+\S+\s+\.(/.*?)(?: -> .*)?$", run("dpkg-deb", "--contents", deb), re.M)
        (database / "info" / f"{name.strip()}.list").write_text("".join(f"{file.rstrip('/') or '/.'}\n" for file in files))
        with (database / "status").open("a") as status:
            status.write(f"{control.rstrip()}\nStatus: install ok installed\n\n")
    for path in root.rglob("*"):
        if path.is_symlink() and os.readlink(path).startswith("/"):
            target = root / os.readlink(path).lstrip("/")
            path.unlink()
            path.symlink_to(os.path.relpath(target, path.parent))
    # As scripts of their packages choose among alternatives.
    for kind in ("blas", "lapack"):
        for path in (root / "usr" / "lib").glob(f"*/{kind}/lib{kind}.*"):
            if not (path.parent.parent / path.name).exists():
                (path.parent.parent / path.name).symlink_to(f"{kind}/{path.name}")


def make_root(folder, packages, architecture):
    """Makes FOLDER/root of these packages. Raises subprocess.CalledProcessError where apt cannot download them."""
    download(folder, packages, architecture)
    unpack(folder / "debs", folder / "root")
    return folder / "root"


def main():
    """Makes one root."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="new folder; the file system is its folder 'root'")
    parser.add_argument("packages", nargs="+")
    parser.add_argument("--architecture", default=run("dpkg", "--print-architecture").strip())
    given = parser.parse_args()
    if given.folder.exists():
        parser.error(f"'{given.folder}' exists")
    print(make_root(given.folder.resolve(), given.packages, given.architecture))


if __name__ == "__main__":
    try:
        main()
    except subprocess.CalledProcessError as failed:
        sys.exit(f"{' '.join(failed.cmd)}\n{failed.stdout}{failed.stderr}")
