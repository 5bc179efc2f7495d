"""aarch64 under qemu-user gives the bits of this machine: kernels, which are compiled here, and the program, if
./quickstart aarch64 built it. Skipped where the cross-compiler, qemu or that build is missing."""

import json
import os
import pathlib
import platform
import shutil
import subprocess
import tempfile
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
HERE = pathlib.Path(os.environ.get("RELIGN_BUILD", TREE / "build" / "release"))
CROSS = TREE / "build" / "aarch64"
QEMU = ["qemu-aarch64", "-L"]
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

    @unittest.skipUnless((CROSS / "bin" / "relign-bench").exists(), "the program was not built for aarch64 (./quickstart aarch64)")
    def test_trials_give_the_same_bytes(self):
        root = TREE / "build" / "aarch64-root" / "root"
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            (folder / "suite.json").write_text(json.dumps(SUITE))
            trials = {}
            for build, runner in ((HERE, []), (CROSS, [*QEMU, root])):
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


if __name__ == "__main__":
    unittest.main()
