"""The wheel in a new environment of every Python from 3.9 to 3.13 that has its headers on this machine."""

import importlib.util
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import unittest

TREE = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("RELIGN_BUILD", TREE / "build" / "release"))
SUITE = {"name": "small", "scenes": ["gaussian_spot"], "noise_levels": ["rho0"],
         "algorithms": ["nlopt-sbplx", "compass"], "instances": 2, "steps": 5}
# Imports every module that needs no extra, steps an environment, moves a batch, and reads the results of a run.
SCRIPT = """
import importlib, pkgutil, sys
import gymnasium, numpy, relign_bench

imported = []
for module in pkgutil.walk_packages(relign_bench.__path__, "relign_bench.", onerror=lambda name: None):
    if module.name.endswith("__main__"):
        continue
    try:
        importlib.import_module(module.name)
        imported.append(module.name)
    except ModuleNotFoundError as problem:
        assert problem.name not in sys.stdlib_module_names if sys.version_info >= (3, 10) else True, problem
        assert not problem.name.startswith("relign_bench"), problem
env = gymnasium.make("relign_bench/Alignment-v0", scene="relign_l2", noise_level="rho0.25", max_episode_steps=3)
env.reset(seed=1)
image, reward, _, _, info = env.step(env.action_space.sample())
batch = relign_bench.Batch(2, "relign_l2")
batch.reset([0, 1], [3, 4])
before = batch.frames.copy()
batch.move_by([1], numpy.full((1, batch.axes), 0.1))
changed = [bool((a != b).any()) for a, b in zip(before, batch.frames)]
table = relign_bench.Results(sys.argv[1]).table("instances")
trial = relign_bench.Bench("relign_l2", noise_level="rho0.25").run("nlopt-sbplx", instance=3, steps=3)
print(sys.version_info[1], len(imported) > 20, image.dtype, reward < 0, info["noise_free_error"] > 0, changed,
      sorted(set(table["algorithm"])), len(table), len(trial.errors()))
"""

sys.path.insert(0, str(TREE / "python"))
import build_wheel  # noqa: E402

MINORS = range(build_wheel.SUPPORTED[0][1], build_wheel.SUPPORTED[1][1] + 1)
LACKING = [name for name in ("auditwheel", "pybind11") if not importlib.util.find_spec(name)]


def run(*command, **keywords):
    """The output of a command; the failure carries what it printed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **keywords)
    if done.returncode != 0:
        raise AssertionError(f"{command} exited with {done.returncode}:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done.stdout


@unittest.skipUnless(platform.machine() == "x86_64", "the wheel is for x86-64")
@unittest.skipUnless(os.environ.get("RELIGN_ALL_PYTHONS"), "ten minutes: ./quickstart test --others")
@unittest.skipIf(LACKING, f"not installed: {', '.join(LACKING)} (tests/wheel/requirements.txt)")
class Pythons(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pythons = {minor: build_wheel.found_python(minor) for minor in MINORS}
        kept = tempfile.TemporaryDirectory()
        cls.addClassCleanup(kept.cleanup)
        cls.folder = pathlib.Path(kept.name)
        given = [word for python in cls.pythons.values() if python for word in ("--python", python)]
        run(sys.executable, TREE / "python" / "build_wheel.py", BUILD, "-o", cls.folder, *given)
        [cls.wheel] = cls.folder.glob("relign_bench-*.whl")

    def check(self, minor):
        """Installs and uses the wheel in one Python."""
        python = self.pythons[minor]
        if not python:
            self.skipTest(f"python3.{minor} with its headers is neither on PATH nor in ~/.pyenv/versions")
        there = self.folder / f"3.{minor}"
        run(python, "-m", "venv", there)
        pip = subprocess.run([there / "bin" / "python", "-m", "pip", "install", "--quiet", f"{self.wheel}[tables]"],
                             capture_output=True, text=True, check=False)
        if pip.returncode != 0:
            self.skipTest("pip cannot install what the wheel needs: " + pip.stderr.strip().splitlines()[-1])
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "RELIGN_"))}
        [package] = there.glob("lib/python3*/site-packages/relign_bench")
        run(there / "bin" / "python", "-m", "compileall", "-q", "-f", package, env=environment)
        (there / "suite.json").write_text(json.dumps(SUITE))
        run(there / "bin" / "relign-bench", "--plugin", TREE / "examples" / "compass_python" / "compass.py",
            "--progress", "none", "run", "suite.json", "-o", "results", cwd=there, env=environment)
        said = run(there / "bin" / "python", "-W", "error::SyntaxWarning", "-c", SCRIPT, there / "results", cwd=there,
                   env=environment)
        methods = ["compass", "home", "nlopt-sbplx", "random"]
        self.assertEqual(said.strip(), f"{minor} True uint8 True True [False, True] {methods} 8 4")


for one in MINORS:
    setattr(Pythons, f"test_runs_in_python_3_{one}", lambda self, minor=one: self.check(minor))


class Versions(unittest.TestCase):
    def test_oldest_python_is_the_same_everywhere(self):
        project = (TREE / "python" / "pyproject.toml").read_text()
        (major, minor), _ = build_wheel.SUPPORTED
        self.assertIn(f'\nrequires-python = ">={major}.{minor}"\n', project)
        self.assertIn(f'\ntarget-version = "py{major}{minor}"\n', project)


if __name__ == "__main__":
    unittest.main()
