"""relign-bench for Python: instances, images, trials and results of the benchmark, and Gymnasium environments.

    import gymnasium, relign_bench
    env = gymnasium.make("relign_bench/Alignment-v0", scene="relign_od", noise_level="rho0.25")

    bench = relign_bench.Bench("relign_od", noise_level="rho0.25")
    trial = bench.run("nlopt-sbplx", instance=3, steps=50)

    method = relign_bench.Method("nlopt-bobyqa", {"x": (-0.5, 0.5), "y": (-0.5, 0.5)})   # for your own machine

`relign_bench.plugin` is for writing algorithms, scenes and noise levels in Python; it needs the standard library only,
and `Results` pandas or polars for its tables. All other modules need numpy and the compiled module `relign_bench._core`; the
environments also need gymnasium, and `relign_bench.training` needs torch.
"""

from __future__ import annotations

import sys as _sys

TYPE_CHECKING = False  # as typing.TYPE_CHECKING, without the time that importing typing takes
if TYPE_CHECKING:
    from .batch import Batch
    from .bench import Bench, Instance, Trial, list_plugins
    from .environment import AlignmentEnv
    from .method import Method
    from .registration import register
    from .results import Results
    from .vector_environment import AlignmentVectorEnv

    __version__: str

__all__ = [
    "AlignmentEnv",
    "AlignmentVectorEnv",
    "Batch",
    "Bench",
    "Instance",
    "Method",
    "Results",
    "Trial",
    "list_plugins",
    "register",
]

_MODULE_OF = {
    "AlignmentEnv": "environment",
    "AlignmentVectorEnv": "vector_environment",
    "Batch": "batch",
    "Bench": "bench",
    "Instance": "bench",
    "Method": "method",
    "Results": "results",
    "Trial": "bench",
    "list_plugins": "bench",
    "register": "registration",
}

_SUBMODULES = ("batch", "bench", "environment", "method", "plugin", "results", "rewards", "training", "vector_environment")


def __getattr__(name: str) -> object:
    # Imports are deferred: a study starts thousands of Python plugins, and each of them imports this package.
    if name in _MODULE_OF:
        from importlib import import_module

        try:  # only plugins need a fast start, and they use none of these names
            import_module(".registration", __name__).register()
        except ImportError:  # without gymnasium there is no environment to register
            pass
        return getattr(import_module("." + _MODULE_OF[name], __name__), name)
    if name in _SUBMODULES:
        from importlib import import_module

        return import_module("." + name, __name__)
    if name == "__version__":
        from . import _core

        return _core.__version__
    raise AttributeError(f"module 'relign_bench' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(list(globals()) + __all__)


# The environment is registered at once where gymnasium was imported first; otherwise `register()` does it. Importing
# gymnasium here would slow down the start of every Python plugin.
if "gymnasium" in _sys.modules:
    from .registration import register as _register

    _register()
