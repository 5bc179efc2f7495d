"""The notebooks of examples/notebooks run, as a user of the wheel runs them, and show what they promise."""

import asyncio
import os
import pathlib
import re
import shlex
import stat
import sys
import sysconfig
import tempfile
import unittest
import warnings
from unittest import mock

try:
    import ipykernel  # noqa: F401 (its kernel runs the cells)
    import nbclient
    import nbformat
    import pandas  # noqa: F401 (for the notebooks)
except ImportError as problem:
    raise unittest.SkipTest(f"{problem}: tests/python/requirements-others.txt pins it") from None

from relign_bench import program

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "notebooks"
SECONDS = 600  # of a cell, on a loaded machine


def command(place, name, words):
    script = place / name
    script.write_text(f'#!/bin/sh\nexec {shlex.join(words)} "$@"\n')
    script.chmod(script.stat().st_mode | stat.S_IXUSR)


class Notebooks(unittest.TestCase):
    def run_notebook(self, name):
        """Runs a copy in a folder of its own, with the wheel's commands on PATH; what its cells show, one text a cell."""
        built = os.environ.get("RELIGN_PROGRAM")
        if not built:
            self.skipTest("RELIGN_PROGRAM does not name the program")
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        commands = pathlib.Path(place.name) / "bin"
        alone = pathlib.Path(place.name) / "alone"
        commands.mkdir()
        alone.mkdir()
        command(commands, "relign-bench", [built])
        command(commands, "relign-train", [sys.executable, "-m", "relign_bench.training"])
        book = nbformat.read(FOLDER / name, as_version=4)
        with mock.patch.dict(os.environ, PATH=f"{commands}{os.pathsep}{os.environ['PATH']}", TMPDIR=place.name,
                             IPYTHONDIR=place.name, JUPYTER_PREFER_ENV_PATH="1"), warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            client = nbclient.NotebookClient(book, timeout=SECONDS, startup_timeout=SECONDS, kernel_name="python3",
                                             resources={"metadata": {"path": str(alone)}})
            client.create_kernel_manager()
            client.km.transport, client.km.ip = "ipc", str(pathlib.Path(place.name) / "kernel")  # no ports
            asyncio.run(client.async_execute(reset_kc=True))
        return ["".join(output.get("text", "") + "".join(map(str, output.get("data", {}).values()))
                        for output in cell.outputs) for cell in book.cells if cell.cell_type == "code"]

    def test_notebooks_are_stored_without_outputs_and_have_a_test(self):
        names = sorted(path.name for path in FOLDER.glob("*.ipynb"))
        self.assertEqual(names, ["first_look.ipynb", "own_lens.ipynb", "train_and_export.ipynb"])
        for name in names:
            book = nbformat.read(FOLDER / name, as_version=4)
            nbformat.validate(book)
            self.assertEqual([cell.outputs for cell in book.cells if cell.get("outputs")], [])
            for link in re.findall(r"\]\(([^)#]+)", "".join(cell.source for cell in book.cells)):
                self.assertTrue((FOLDER / link).exists(), f"{name}: {link}")

    def test_commands_are_found_beside_the_interpreter(self):
        for path in FOLDER.glob("*.ipynb"):
            first = next(cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code")
            with mock.patch.dict(os.environ, PATH="/nowhere"), mock.patch.object(os, "chdir"):
                exec(first.source, {})  # noqa: S102
                self.assertIn(sysconfig.get_path("scripts"), os.environ["PATH"].split(os.pathsep), path.name)

    def test_examples_are_found_in_the_wheel_and_in_a_clone(self):
        self.assertEqual(program.find_example("lens/triplet.zmx").resolve(), FOLDER.parent / "lens" / "triplet.zmx")
        with tempfile.TemporaryDirectory() as folder:
            package = pathlib.Path(folder).resolve() / "site-packages" / "relign_bench"
            shipped = package / "share" / "relign-bench" / "examples" / "lens" / "triplet.zmx"
            with mock.patch.object(program, "__file__", str(package / "program.py")):
                with self.assertRaisesRegex(FileNotFoundError, "no example 'lens/triplet.zmx' in .*/examples or .*: "
                                            "install the self-contained wheel"):
                    program.find_example("lens/triplet.zmx")
                shipped.parent.mkdir(parents=True)
                shipped.touch()
                self.assertEqual(program.find_example("lens/triplet.zmx"), shipped)

    def test_first_look(self):
        shown = self.run_notebook("first_look.ipynb")
        self.assertEqual(sum("data:image/png;base64," in text for text in shown), 4)
        self.assertIn("recommended_mse", shown[4])
        self.assertIn("<polyline", shown[7])
        self.assertIn("imitation", shown[8])

    def test_own_lens(self):
        shown = self.run_notebook("own_lens.ipynb")
        self.assertIn("<svg", shown[2])
        self.assertIn("L2", shown[4])
        self.assertIn("through-focus-quick", shown[-1])

    def test_train_and_export(self):
        for package in ("torch", "onnx"):
            try:
                __import__(package)
            except ImportError:
                self.skipTest(f"{package} is not installed (./quickstart test --training)")
        shown = self.run_notebook("train_and_export.ipynb")
        self.assertIn("Conv", shown[2])
        self.assertIn("imitation on instance 3", shown[3])
        self.assertEqual(len(re.findall("<polyline", shown[4])), 3)


if __name__ == "__main__":
    unittest.main()
