"""Plugins for relign-bench in Python: derive from the class of a kind, end the file with serve(YourClass).

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

    knows         what an algorithm is shown: "images", "merit", "start", "box", "design", "level"
    presets       {"guess-wide": {"first_stride": 0.3}}
    prepare       {"sources": 10, "steps": 100}: an algorithm that learns beforehand on other instances (talk.prepared())
    id, summary, license, citation, reproducible ("anywhere" or "this_cpu")

Optimizer and Agent are algorithms; Scene is a simulator, Station a scene that owns its stage; NoiseLevel draws the
variances. A path stands wherever an id does: `--scene ./bench.py`, `--noise-level ./tight.py`, or in a suite.

This module needs the standard library alone; with numpy, images are numpy arrays. The messages that it exchanges with
the host are described in docs/process_plugins.md.
"""


from .algorithms import Agent, Optimizer
from .images import Box, Image
from .manifest import manifest_of
from .noise_levels import NoiseLevel
from .parameters import Parameter, parameter
from .process import serve
from .scenes import Assembly, Moved, Scene, Station
from .services import Lens, Model, Outcome, Prepared, Stopped
from .talk import Observation, Talk

__all__ = [
    "Agent",
    "Assembly",
    "Box",
    "Image",
    "Lens",
    "Model",
    "Moved",
    "NoiseLevel",
    "Observation",
    "Optimizer",
    "Outcome",
    "Prepared",
    "Parameter",
    "Scene",
    "Station",
    "Stopped",
    "Talk",
    "manifest_of",
    "parameter",
    "serve",
]

for _name in __all__:  # users meet these names here, whatever file they lie in
    globals()[_name].__module__ = __name__
