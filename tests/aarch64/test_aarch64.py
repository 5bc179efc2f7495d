"""aarch64 under qemu-user gives the bits of this machine: kernels, which are compiled here, and the program, if
./quickstart aarch64 built it. The Debian package of that build runs there. Skipped where the cross-compiler, qemu or that build
is missing."""

import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import tempfile
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
HERE = pathlib.Path(os.environ.get("RELIGN_BUILD", TREE / "build" / "release"))
CROSS = TREE / "build" / "aarch64"
ROOT = TREE / "build" / "aarch64-root"
DATABASE = f"--admindir={ROOT}/root/var/lib/dpkg"
QEMU = ["qemu-aarch64", "-L"]
NOT_BUILT = "the program was not built for aarch64 (./quickstart aarch64)"
OPTICS = TREE / "core" / "simulator" / "optics"
KERNELS = [OPTICS / f"{name}.cpp" for name in ("adjoint_kernels", "block_kernels", "ghost_kernels", "lane_kernels",
                                               "block_asphere_exact")]
# As core/simulator/optics/CMakeLists.txt compiles them.
FLAGS = ["-std=c++20", "-O3", "-ffp-contract=off", "-fopenmp-simd", "-fno-math-errno", "-fno-trapping-math",
         "-DRELIGN_KERNEL_ISA=generic"]
SUITE = {"name": "small", "scenes": ["relign_od"], "noise_levels": ["rho0.25"],
         "algorithms": ["nlopt-sbplx", "through-focus", "imitation", "bo-gp", "random"], "instances": 1, "steps": 4}


def output(*command):
    """What a command prints; the failure carries its messages."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{command} exited with {done.returncode}:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return done.stdout


@unittest.skipUnless(platform.machine() == "x86_64", "compares with x86-64")
@unittest.skipUnless(shutil.which("qemu-aarch64"), "qemu-aarch64 is not installed (Debian and Ubuntu: qemu-user)")
class Bits(unittest.TestCase):
    @unittest.skipUnless(shutil.which("aarch64-linux-gnu-g++"),
                         "aarch64-linux-gnu-g++ is not installed (Debian and Ubuntu: g++-aarch64-linux-gnu)")
    def test_kernels_give_the_same_bits(self):
        with tempfile.TemporaryDirectory() as scratch:
            found = {}
            for compiler, runner in (("g++", []), ("aarch64-linux-gnu-g++", [*QEMU, "/usr/aarch64-linux-gnu"])):
                program = pathlib.Path(scratch) / compiler
                output(compiler, *FLAGS, f"-I{TREE / 'core' / 'simulator'}", f"-I{TREE / 'core' / 'foundation'}",
                       f"-I{TREE / 'core' / 'plugin_api'}", *KERNELS, TREE / "tests" / "aarch64" / "kernel_bits.cpp",
                       "-o", program)
                found[compiler] = output(*runner, program).splitlines()
        here, there = found.values()
        self.assertGreater(len(here), 200)
        self.assertEqual([line.split()[0] for line, other in zip(here, there) if line != other], [])
        self.assertEqual(len(here), len(there))

    @unittest.skipUnless((CROSS / "bin" / "relign-bench").exists(), NOT_BUILT)
    def test_trials_give_the_same_bytes(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            (folder / "suite.json").write_text(json.dumps(SUITE))
            trials = {}
            for build, runner in ((HERE, []), (CROSS, [*QEMU, ROOT / "root"])):
                results = folder / build.name
                os.environ["XDG_CACHE_HOME"] = str(folder / f"cache-{build.name}")  # each draws its own reference images
                output(*runner, build / "bin" / "relign-bench", "--progress", "none", "run", folder / "suite.json",
                       "-o", results, "--isolation", "none", "--workers", "1")
                trials[build.name] = {}
                for file in sorted((results / "trials").glob("*.jsonl")):
                    for line in file.read_text().splitlines():
                        record = json.loads(line)
                        trials[build.name].setdefault(record["trial"], []).append(line)
        here, there = trials.values()
        self.assertEqual(set(here), set(there))
        differing = {json.loads(lines[-1])["algorithm"] for trial, lines in here.items() if lines != there[trial]}
        self.assertEqual(differing, set())

    @unittest.skipUnless((CROSS / "bin" / "relign-bench").exists(), NOT_BUILT)
    @unittest.skipUnless(shutil.which("dpkg-shlibdeps"), "dpkg-shlibdeps is not installed (Debian and Ubuntu: dpkg-dev)")
    def test_debian_package_runs(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            output("env", f"RELIGN_DEBIAN_ROOT={ROOT}", "cpack", "--config", CROSS / "CPackConfig.cmake", "-G", "DEB",
                   "-B", folder, "-D", f"SHLIBDEPS_EXECUTABLE={TREE / 'python' / 'cross_shlibdeps.py'}")
            [package] = folder.glob("relign-bench_*_arm64.deb")
            self.assertEqual(output("dpkg-deb", "--field", package, "Architecture").strip(), "arm64")
            depends = dict(re.fullmatch(r"(\S+)(?: \((.*)\))?", one).groups()
                           for one in output("dpkg-deb", "--field", package, "Depends").strip().split(", "))
            for name, needed in depends.items():  # the versions come from the packages' own symbols files
                found = output("dpkg-query", DATABASE, "-W", "-f", "${Version}", name)
                output("dpkg", "--compare-versions", found, *(needed or ">= 0").replace(">=", "ge").split())
            output("dpkg-deb", "--extract", package, folder / "unpacked")
            programs = [file for file in (folder / "unpacked" / "usr").rglob("*")
                        if file.is_file() and file.read_bytes()[:4] == b"\x7fELF"]
            wanted = set()
            for program in programs:
                text = output("env", "LC_ALL=C", "aarch64-linux-gnu-readelf", "--wide", "--file-header", "--dynamic", program)
                self.assertIn("AArch64", text, program)
                wanted |= set(re.findall(r"\(NEEDED\).*\[(.*)\]", text))
            self.assertGreater(len(programs), 20)
            owners = output("dpkg-query", DATABASE, "-S", *(f"*/{name}" for name in wanted if not name.startswith("ld-linux")))
            self.assertLessEqual(set(depends), {line.split(":")[0] for line in owners.splitlines()})
            self.assertLessEqual({"libc6", "libtiff6", "libnlopt0", "libopencv-dnn406"}, set(depends))
            program = [*QEMU, ROOT / "root", folder / "unpacked" / "usr" / "bin" / "relign-bench"]
            self.assertIn('"nlopt"', output(*program, "list", "--json"))
            steps = json.loads(output(*program, "--progress", "none", "try", "nlopt-sbplx", "--steps", "2", "--json"))
            self.assertEqual(steps["steps"][-1]["step"], 2)


if __name__ == "__main__":
    unittest.main()
