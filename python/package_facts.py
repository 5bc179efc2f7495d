"""Writes what packages contain and were made of: `python3 python/package_facts.py [--root ROOT] FILE.whl FILE.deb ...`.

Beside each file: FILE.cdx.json, a bill of materials in CycloneDX 1.5, and FILE.provenance.json, an unsigned in-toto statement
with SLSA provenance 1.0 about source, compiler and Debian packages. Equal files from equal sources give equal bytes. Run it on
the machine that made the package: versions are those of the Debian packages installed there, or in a root for another
architecture (debian_root.py).
"""

import email
import hashlib
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import uuid
import zipfile
from datetime import datetime, timezone

TREE = pathlib.Path(__file__).resolve().parent.parent
# Debian packages (patterns) whose headers are compiled into the program, or whose static libraries are linked.
EMBEDDED = tuple((TREE / "cmake" / "embedded_packages.txt").read_text().split())
OWN = {"librelign_no_jbig.so"}  # libraries of a wheel that are of this tree
HERE = pathlib.Path("/")
TOOLS = ("g++", "cmake", "ninja-build", "binutils", "dpkg-dev")


def output(*command):
    """What a command prints; empty if it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else ""


def query(root, *words):
    """What dpkg-query prints about the packages of a root."""
    return output("dpkg-query", f"--admindir={root / 'var/lib/dpkg'}", *words)


def installed(packages, root=HERE):
    """Versions of the Debian packages that are installed in a root, by name; names may be patterns."""
    versions = {}
    for pattern in sorted(set(packages)):
        for line in query(root, "-W", "-f", "${db:Status-Status} ${Package} ${Version}\n", pattern).splitlines():
            if line.startswith("installed "):
                name, version = line.split()[1:]
                versions[name] = version
    return versions


def debian_url(name, version):
    """The package URL of a Debian package."""
    system = platform.freedesktop_os_release()
    return (f"pkg:deb/{system['ID']}/{name.replace('+', '%2B')}@{version.replace('+', '%2B').replace(':', '%3A')}"
            f"?distro={system['ID']}-{system.get('VERSION_ID', 'unknown')}")


def debian_component(name, version, scope, note):
    """A component of a bill of materials for a Debian package; `note`: how it is used."""
    url = debian_url(name, version)
    return {"type": "library", "bom-ref": url, "name": name, "version": version, "scope": scope, "purl": url,
            "properties": [{"name": "relign-bench:use", "value": note}]}


def owners(library, root=HERE):
    """Debian packages that installed a library of this file name in a root."""
    name = re.sub(r"-[0-9a-f]{8}(?=\.)", "", library)  # auditwheel adds a hash
    return {line.split(":")[0] for line in query(root, "-S", f"*/{name}").splitlines()}


def metadata_of(file):
    """The metadata of a wheel."""
    with zipfile.ZipFile(file) as wheel:
        return email.message_from_bytes(wheel.read(next(n for n in wheel.namelist() if n.endswith(".dist-info/METADATA"))))


def requires_python(file):
    """The versions of Python that a wheel is for; empty: any."""
    return metadata_of(file)["Requires-Python"] or ""


def of_wheel(file, root):
    """(name, version, package URL, components) of a wheel.

    Raises:
        ValueError: A bundled library belongs to no Debian package.
    """
    components, files, about = [], {}, metadata_of(file)
    with zipfile.ZipFile(file) as wheel:
        for path in sorted(wheel.namelist()):
            folder, _, library = path.partition("/")
            if not folder.endswith(".libs") or not library or library in OWN:
                continue
            packages = owners(library, root)
            if not packages:
                raise ValueError(f"{file}: '{path}' belongs to no Debian package that is installed here; run this program "
                                 "on the machine that made the wheel")
            for package in packages:
                files.setdefault(package, []).append((path, hashlib.sha256(wheel.read(path)).hexdigest()))
    for name, version in installed(files, root).items():
        component = debian_component(name, version, "required", "a copy in the wheel")
        component["components"] = [{"type": "file", "name": path, "hashes": [{"alg": "SHA-256", "content": digest}]}
                                   for path, digest in files[name]]
        components.append(component)
    for need in about.get_all("Requires-Dist", []):
        name = re.match(r"[\w.-]+", need)[0]
        scope = "optional" if "extra ==" in need else "required"
        if not any(one["name"] == name for one in components):
            components.append({"type": "library", "bom-ref": f"pkg:pypi/{name}", "name": name, "scope": scope,
                               "purl": f"pkg:pypi/{name}",
                               "properties": [{"name": "relign-bench:use", "value": f"not in the wheel: {need}"}]})
    return about["Name"], about["Version"], f"pkg:pypi/{about['Name']}@{about['Version']}", components


def of_debian_package(file, root):
    """(name, version, package URL, components) of a Debian package."""
    name, version, depends = (output("dpkg-deb", "-f", file, key).strip() for key in ("Package", "Version", "Depends"))
    if not name:
        raise ValueError(f"'{file}' is not a Debian package")
    needs = {re.match(r"[\w.+-]+", one.strip())[0]: one.strip() for one in depends.split(",") if one.strip()}
    components = [debian_component(need, found, "required", f"not in the package: {needs[need]}")
                  for need, found in installed(needs, root).items()]
    return name, version, f"pkg:deb/{name}@{version}", components


def source_time():
    """Seconds since 1970: SOURCE_DATE_EPOCH, otherwise of the commit."""
    return int(os.environ.get("SOURCE_DATE_EPOCH") or output("git", "-C", TREE, "log", "-1", "--format=%ct").strip() or 0)


def bill_of_materials(file, root):
    """The bill of materials of a package, as CycloneDX 1.5."""
    name, version, url, components = (of_wheel if file.suffix == ".whl" else of_debian_package)(file, root)
    components += [debian_component(one, found, "required", "headers or static libraries, compiled into the program")
                   for one, found in installed(EMBEDDED, root).items()]
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    return {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
            "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, f'sha256:{digest}')}",
            "metadata": {"timestamp": datetime.fromtimestamp(source_time(), timezone.utc).isoformat().replace("+00:00", "Z"),
                         "component": {"type": "application", "bom-ref": url, "name": name, "version": version, "purl": url,
                                       "licenses": [{"license": {"id": "Apache-2.0"}}],
                                       "hashes": [{"alg": "SHA-256", "content": digest}]}},
            "components": components,
            "dependencies": [{"ref": url, "dependsOn": [one["bom-ref"] for one in components]}]}


def provenance(file, materials):
    """An in-toto statement with SLSA provenance about a package."""
    commit = output("git", "-C", TREE, "rev-parse", "HEAD").strip()
    changed = bool(output("git", "-C", TREE, "status", "--porcelain", "--untracked-files=no").strip())
    source = {"name": "relign-bench", "annotations": {"changedAfterCommit": changed}}
    if commit:
        source["digest"] = {"gitCommit": commit}
    packages = [{"uri": one["purl"], "name": one["name"]} for one in materials["components"]
                if one["purl"].startswith("pkg:deb/")]
    packages += [{"uri": debian_url(name, version), "name": name} for name, version in installed(TOOLS).items()]
    return {"_type": "https://in-toto.io/Statement/v1",
            "subject": [{"name": file.name, "digest": {"sha256": materials["metadata"]["component"]["hashes"][0]["content"]}}],
            "predicateType": "https://slsa.dev/provenance/v1",
            "predicate": {"buildDefinition": {
                "buildType": "urn:relign-bench:quickstart",
                "externalParameters": {"step": "wheel" if file.suffix == ".whl" else "package"},
                "internalParameters": {"compiler": output("c++", "--version").partition("\n")[0],
                                       "sourceDateEpoch": source_time()},
                "resolvedDependencies": [source, *packages]},
                "runDetails": {"builder": {"id": "urn:relign-bench:unattested"}}}}


def main(files, root=HERE):
    """Writes both files beside each package."""
    for file in map(pathlib.Path, files):
        materials = bill_of_materials(file, root)
        for suffix, content in (("cdx", materials), ("provenance", provenance(file, materials))):
            beside = file.with_name(f"{file.name}.{suffix}.json")
            beside.write_text(json.dumps(content, indent=2) + "\n")
            print(beside)


if __name__ == "__main__":
    try:
        words = sys.argv[1:]
        place = pathlib.Path(words[1]) if words[:1] == ["--root"] and len(words) > 1 else HERE
        words = words[2:] if place != HERE else words
        if not words:
            raise ValueError("expected a .whl or .deb file")
        main(words, place)
    except (ValueError, OSError, zipfile.BadZipFile) as problem:
        sys.exit(f"error: {problem}")
