"""relign-bench for Python.

    import gymnasium, relign_bench
    env = gymnasium.make("relign_bench/Alignment-v0", scene="relign_od", noise_level="rho0.25")

    bench = relign_bench.Bench("relign_od", noise_level="rho0.25")
    trial = bench.run("nlopt-sbplx", instance=3, steps=50)

`relign_bench.plugin` writes algorithms, scenes and noise levels in Python; it needs the standard library alone.
`relign_bench.environment` has the environments, `relign_bench.bench` the rest; both need numpy and the compiled part.
"""

import sys as _sys

_LAZY = {
    "Batch": "batch",
    "Bench": "bench",
    "Trial": "bench",
    "read_results": "bench",
    "list_plugins": "bench",
    "AlignmentEnv": "environment",
    "AlignmentVectorEnv": "vector_environment",
    "register": "registration",
}

_MODULES = ("batch", "bench", "environment", "plugin", "rewards", "training", "vector_environment")

__all__ = sorted(_LAZY)


def __getattr__(name):
    # Plugins in Python import this package a thousand times a study: nothing heavy before it is asked for.
    if name in _LAZY:
        from importlib import import_module

        try:  # who asks for these has no plugin's start to pay for
            import_module(".registration", __name__).register()
        except ImportError:  # no gymnasium: no environment
            pass
        return getattr(import_module("." + _LAZY[name], __name__), name)
    if name in _MODULES:
        from importlib import import_module

        return import_module("." + name, __name__)
    raise AttributeError(f"module 'relign_bench' has no attribute '{name}'")


def __dir__():
    return sorted(list(globals()) + __all__)


# Where gymnasium came first, its environment is there at once; else `register()` adds it. Importing gymnasium here would
# cost every plugin in Python its start.
if "gymnasium" in _sys.modules:
    from .registration import register as _register

    _register()
