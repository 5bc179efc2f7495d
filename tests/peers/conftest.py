"""Set-up of the comparisons. ctest does not run them: the other programs are downloaded, and take seconds for an image."""

import importlib.util
import sys
import warnings

import program
import pytest

# The program puts relign_bench on the path of its plugins; the tests import these plugins themselves.
sys.path.append(str(program.ROOT / "python"))

# Numba, which Optiland uses, warns about its internals.
warnings.filterwarnings("ignore", category=UserWarning, module="numba|optiland")


def need(*modules):
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)} (./quickstart peers installs them)")


@pytest.fixture(scope="session", autouse=True)
def built_program():
    if program.path() is None:
        pytest.skip("relign-bench is not built; build it (./quickstart build) or name it in RELIGN_BENCH")


@pytest.fixture(scope="session")
def figures():
    """Collects figures for the summary, which a test that passes would not print."""
    return FIGURES


FIGURES = []


def pytest_terminal_summary(terminalreporter):
    if FIGURES:
        terminalreporter.section("figures")
    for line in FIGURES:
        terminalreporter.write_line(line)
