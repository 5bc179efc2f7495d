"""The self-contained wheel in a bare root: what a base image of the distribution has, and Python.

The root is made of freshly downloaded packages in a temporary folder, so that no library of this machine can help, and has no
network. Needs root (chroot), apt with a package index, and auditwheel."""

import ctypes
import ctypes.util
import importlib.util
import json
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

TREE = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("RELIGN_BUILD", TREE / "build" / "release"))
MODULE_PYTHON = os.environ.get("RELIGN_MODULE_PYTHON", "/usr/bin/python3")
MOST_MEGABYTES = 40
PACKAGES = ["apt", "base-files", "bash", "coreutils", "libc-bin", "python3", "python3-venv"]
SUITE = {"name": "archived", "scenes": ["gaussian_spot"], "noise_levels": ["rho0"], "algorithms": ["compass"],
         "instances": 2, "steps": 5}
LZW, JBIG = 5, 34661  # compressions of TIFF
# Reads the only strip of a TIFF of 16 x 2 pixels with the libtiff of the given path; prints the number of bytes, -1 for none.
READ_STRIP = """
import ctypes, sys
tiff = ctypes.CDLL(sys.argv[1])
tiff.TIFFOpen.restype = ctypes.c_void_p
tiff.TIFFReadEncodedStrip.restype = ctypes.c_ssize_t
handle = ctypes.c_void_p(tiff.TIFFOpen(sys.argv[2].encode(), b"r"))
room = ctypes.create_string_buffer(32)
print(tiff.TIFFReadEncodedStrip(handle, ctypes.c_uint32(0), room, ctypes.c_ssize_t(-1)), flush=True)
"""

sys.path.insert(0, str(TREE / "python"))
import debian_root  # noqa: E402


def run(*command, **keywords):
    """The output of a command; the failure carries what it printed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **keywords)
    if done.returncode != 0:
        raise AssertionError(f"{command} exited with {done.returncode}:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done.stdout


def bare_root(folder):
    """PACKAGES and what they depend on, as if nothing were installed. Skips the test where apt cannot."""
    try:
        debian_root.download(folder, PACKAGES, debian_root.run("dpkg", "--print-architecture").strip())
    except subprocess.CalledProcessError as failed:
        raise unittest.SkipTest("apt cannot download packages: " + failed.stderr.strip().splitlines()[-1]) from None
    root = folder / "root"
    debian_root.unpack(folder / "debs", root)
    for node in ("null", "urandom"):
        (root / "dev").mkdir(exist_ok=True)
        run("mknod", "-m", "666", root / "dev" / node, "c", "1", {"null": "3", "urandom": "9"}[node])
    for name in ("proc", "tmp"):
        (root / name).mkdir(exist_ok=True)
    return root


def write_tiff(path, compression, bits):
    """Writes a grey TIFF of 16 x 2 pixels with this machine's libtiff."""
    tiff = ctypes.CDLL(ctypes.util.find_library("tiff"))
    tiff.TIFFOpen.restype = ctypes.c_void_p
    tiff.TIFFWriteEncodedStrip.restype = ctypes.c_ssize_t
    handle = ctypes.c_void_p(tiff.TIFFOpen(str(path).encode(), b"w"))
    for tag, value in ((256, 16), (257, 2), (258, bits), (277, 1), (259, compression), (262, 1), (278, 2)):
        tiff.TIFFSetField(handle, ctypes.c_uint32(tag), ctypes.c_int(value))
    data = bytes(range(4 * bits))
    assert tiff.TIFFWriteEncodedStrip(handle, ctypes.c_uint32(0), data, ctypes.c_ssize_t(len(data))) == len(data)
    tiff.TIFFClose(handle)


@unittest.skipUnless(platform.machine() == "x86_64", "the wheel is for x86-64")
@unittest.skipUnless(os.geteuid() == 0, "a chroot needs root")
@unittest.skipUnless(shutil.which("apt-get") and shutil.which("dpkg-deb"), "no apt")
@unittest.skipUnless(importlib.util.find_spec("auditwheel"), "no auditwheel (tests/wheel/requirements.txt)")
class Wheel(unittest.TestCase):
    def test_runs_where_nothing_else_is_installed(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            root = bare_root(folder)
            wheels = root / "wheels"
            run(sys.executable, TREE / "python" / "build_wheel.py", BUILD, "-o", wheels, "--python", MODULE_PYTHON,
                "--built-module")
            [wheel] = wheels.glob("relign_bench-*.whl")
            self.assertLess(wheel.stat().st_size / 1e6, MOST_MEGABYTES)

            version = run(MODULE_PYTHON, "-c", "import sys; print('%d.%d' % sys.version_info[:2])").strip()
            there = run("chroot", root, "/usr/bin/python3", "-c", "import sys; print('%d.%d' % sys.version_info[:2])").strip()
            if there != version:
                self.skipTest(f"the bare root has Python {there}, the module is for {version}")
            download = subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", "--only-binary", ":all:",
                                       "--python-version", version, "--dest", wheels, "numpy", "gymnasium"],
                                      capture_output=True, text=True, check=False)
            if download.returncode != 0:
                self.skipTest("pip cannot download: " + download.stderr.strip().splitlines()[-1])

            # In a mount namespace of its own with /proc, as a container has it: programs find their libraries by it.
            def inside(*command):
                return run("unshare", "--mount", "--net", "sh", "-c", 'mount -t proc proc "$0/proc" && exec chroot "$0" "$@"',
                           root, *command, env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/tmp"})

            inside("/usr/bin/python3", "-m", "venv", "/venv")
            inside("/venv/bin/python", "-m", "pip", "install", "--no-index", "--find-links", "/wheels",
                "/wheels/" + wheel.name, "gymnasium")
            said = inside("/venv/bin/python", "-c",
                       "import gymnasium, relign_bench\n"
                       "env = gymnasium.make('relign_bench/Alignment-v0', scene='relign_l2', noise_level='rho0.25')\n"
                       "observation, info = env.reset(seed=1)\n"
                       "print(env.step(env.action_space.sample())[1] is not None)")
            self.assertEqual(said.strip(), "True")
            inside("/bin/bash", "-c", "cd /tmp && /venv/bin/relign-bench run quick")
            self.assertTrue(list((root / "tmp").glob("results/*/report.html")), "the run wrote no report")
            self.check_jbig(wheel, folder / "unpacked", inside, root)
            self.check_nlopt(inside, root)
            self.check_extras(inside, root)
            self.check_archive(inside, root)

    def check_jbig(self, wheel, unpacked, inside, root):
        """No code of libjbig, which is under the GPL, is in the wheel, so that JBIG is refused, and other TIFFs are read."""
        mark, theirs = b"JBIG-KIT", next(pathlib.Path("/usr/lib").glob("*/libjbig.so.0"))
        self.assertIn(mark, theirs.read_bytes())
        with zipfile.ZipFile(wheel) as files:
            files.extractall(unpacked)
        self.assertEqual([file.name for file in unpacked.rglob("*") if "libjbig" in file.name or
                          file.is_file() and mark in file.read_bytes()], [])
        self.assertNotIn("libjbig", wheel.with_name(f"{wheel.name}.cdx.json").read_text())
        write_tiff(root / "tmp" / "jbig.tiff", JBIG, 1)
        write_tiff(root / "tmp" / "lzw.tiff", LZW, 8)
        [ours] = (unpacked / "relign_bench.libs").glob("libtiff-*")
        for library, file, read in ((ctypes.util.find_library("tiff"), "jbig", 4), (ours, "jbig", -1), (ours, "lzw", 32)):
            done = subprocess.run([sys.executable, "-c", READ_STRIP, library, root / "tmp" / f"{file}.tiff"],
                                  capture_output=True, text=True, check=True)
            self.assertEqual(int(done.stdout), read, done.stderr)
            self.assertEqual("JBIG compression is not supported" in done.stderr, read < 0, done.stderr)
        inside("/venv/bin/relign-bench", "render", "--target", "/tmp/lzw.tiff", "-o", "/tmp/lzw.png")
        with self.assertRaisesRegex(AssertionError, "jbig.tiff: .*its compression, JBIG, is not supported"):
            inside("/venv/bin/relign-bench", "render", "--target", "/tmp/jbig.tiff", "-o", "/tmp/jbig.png")

    def check_nlopt(self, inside, root):
        """NLopt, which is under the LGPL, can be replaced by another build of it: here, Debian's."""
        [library] = (root / "venv").rglob("relign_bench.libs/libnlopt-*")
        for content, works in ((b"", False), (next(pathlib.Path("/usr/lib").glob("*/libnlopt.so.0")).read_bytes(), True)):
            library.write_bytes(content)
            try:
                inside("/venv/bin/relign-bench", "try", "nlopt-sbplx", "--steps", "2")
            except AssertionError as failed:
                self.assertFalse(works, failed)
            else:
                self.assertTrue(works, "the program did not open the replaced library")

    def check_extras(self, inside, root):
        """The second wheel adds meshes to the first."""
        def mesh():
            inside("/bin/bash", "-c", "cd /tmp && /venv/bin/relign-bench lens export-mesh -o /tmp/meshes --pitch 0.5 && "
                   "/venv/bin/relign-bench lens fit-mesh meshes/L1.ply")

        self.assertNotIn("lens_mesh", inside("/venv/bin/relign-bench", "list", "--json"))
        with self.assertRaisesRegex(AssertionError, "lacks the optional part 'mesh_import'"):
            mesh()
        inside("/bin/bash", "-c", "/venv/bin/python -m pip install --no-index --no-deps /wheels/relign_bench_extras-*.whl")
        self.assertIn("lens_mesh", inside("/venv/bin/relign-bench", "list", "--json"))
        shutil.rmtree(root / "tmp" / "meshes")
        mesh()

    def check_archive(self, inside, root):
        """An archive of results, with its method in Python, replays in an environment that has nothing else."""
        shutil.copytree(TREE / "examples" / "compass_python", root / "tmp" / "compass_python")
        (root / "tmp" / "suite.json").write_text(json.dumps(SUITE))
        inside("/bin/bash", "-c", "cd /tmp && "
               "/venv/bin/relign-bench --plugin compass_python/compass.py run suite.json -o mine && "
               "/venv/bin/relign-export mine --archive archive --plugin compass_python/compass.py --wheel /wheels/*.whl")
        for made in ("venv", "wheels", "tmp/mine", "tmp/compass_python", "tmp/suite.json"):
            path = root / made
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        self.assertRegex(inside("/bin/bash", "/tmp/archive/verify"), r"\b6 of 6\b")
        records = next((root / "tmp" / "archive" / "results" / "trials").glob("*.jsonl"))
        records.write_text(records.read_text().replace('"step":1', '"step":2', 1))
        with self.assertRaisesRegex(AssertionError, "results/trials/.*FAILED"):
            inside("/bin/bash", "/tmp/archive/verify")


if __name__ == "__main__":
    unittest.main()
