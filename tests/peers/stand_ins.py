"""Stands in for learning libraries that the package imports and that none of its images needs.

`import relign` loads PyTorch and libraries on top of it, several GB, for its agents. Rendering uses none of it. Where
they are not installed, empty modules of the same names make the import possible; where they are, they are used.
"""

import importlib.util
import sys
import types

NAMES = ("torch", "stable_baselines3", "sb3_contrib", "gymnasium")


class Naming(type):
    """Classes that have every attribute: `spaces.Box`, `torch.device`."""

    def __getattr__(cls, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Naming(name, (Unused,), {})


class Unused(metaclass=Naming):
    """Any class or function of a missing library: may be named, called and inherited from, and does nothing."""

    def __init__(self, *arguments, **named):
        pass


class StandIn(types.ModuleType):
    __path__ = []  # a package, so that submodules can be imported

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Naming(name, (Unused,), {})


class StandInFinder:
    """Makes the stand-ins when they are imported; stands last, so that what is installed goes first."""

    @staticmethod
    def find_spec(name, path=None, target=None):
        if name.split(".")[0] not in NAMES:
            return None
        return importlib.util.spec_from_loader(name, StandInFinder)

    @staticmethod
    def create_module(spec):
        return StandIn(spec.name)

    @staticmethod
    def exec_module(module):
        if module.__name__ == "torch":
            module.cuda = types.SimpleNamespace(is_available=lambda: False)


def install():
    """The missing libraries that were stood in for."""
    missing = [name for name in NAMES if importlib.util.find_spec(name) is None]
    if missing:
        sys.meta_path.append(StandInFinder)
    return missing
