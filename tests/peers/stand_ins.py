"""Stand-ins for learning libraries that the package imports but does not need for images.

`import relign` loads PyTorch and libraries based on it, several GB, for its agents. Rendering does not use them. Where they are
not installed, empty modules of the same names make the import possible.
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
    """Any class or function of a missing library: can be named, called and inherited from, and does nothing."""

    def __init__(self, *arguments, **named):
        pass


class StandIn(types.ModuleType):
    __path__ = []  # a package, so that submodules can be imported

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Naming(name, (Unused,), {})


class StandInFinder:
    """Makes the stand-ins when they are imported; the last finder, so that installed modules take precedence."""

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
    """Installs the stand-ins; returns the missing libraries."""
    missing = [name for name in NAMES if importlib.util.find_spec(name) is None]
    if missing:
        sys.meta_path.append(StandInFinder)
    return missing
