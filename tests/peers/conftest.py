"""Nothing here is run by ctest: the peers are downloaded programs, and one of their images takes seconds."""

import importlib.util
import sys
import warnings

import program
import pytest

# Plugins in Python import relign_bench.plugin, which the program puts on their path.
sys.path.append(str(program.ROOT / "python"))

# Numba, under Optiland, warns about its own insides.
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
    """Collects what was found, for the summary: a test that passes still tells its figure."""
    return FIGURES


FIGURES = []


def pytest_terminal_summary(terminalreporter):
    if FIGURES:
        terminalreporter.section("figures")
    for line in FIGURES:
        terminalreporter.write_line(line)
