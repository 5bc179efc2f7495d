"""Algorithms for relign-bench in Python: derive from Optimizer or Agent, end the file with serve(YourClass).

    from relign_bench.plugin import Optimizer, parameter, serve

    class Guess(Optimizer):
        "Tries the middle of the box."

        def run(self, talk):
            talk.step(talk.box.centre())

    if __name__ == "__main__":
        serve(Guess)

`relign-bench try ./guess.py` runs it as a process of its own: it may print, fail or die, and costs its trial at
most. The class is the manifest (`python3 guess.py --manifest`): its name is the id, its docstring (or the module's)
the summary, and these class attributes say the rest:

    knows         what it is shown: "images", "merit", "start", "box", "design", "level"
    presets       {"guess-wide": {"first_stride": 0.3}}
    id, summary, license, citation, reproducible ("anywhere" or "this_cpu")

This module needs the standard library alone; with numpy, images are numpy arrays. The messages that it exchanges with
the host are described in docs/process_plugins.md.
"""


from .algorithms import Agent, Optimizer
from .images import Box, Image
from .manifest import manifest_of
from .parameters import Parameter, parameter
from .process import serve
from .services import Lens, Model, Outcome, Stopped
from .talk import Observation, Talk

__all__ = [
    "Agent",
    "Box",
    "Image",
    "Lens",
    "Model",
    "Observation",
    "Optimizer",
    "Outcome",
    "Parameter",
    "Stopped",
    "Talk",
    "manifest_of",
    "parameter",
    "serve",
]

for _name in __all__:  # users meet these names here, whatever file they lie in
    globals()[_name].__module__ = __name__
