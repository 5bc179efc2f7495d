"""Plugins for relign-bench in Python: derive from the class of a kind, and end the file with serve(YourClass).

    from relign_bench.plugin import Optimizer, parameter, serve

    class Guess(Optimizer):
        "Tries the centre of the box."

        def run(self, trial):
            trial.step(trial.box.centre())

    if __name__ == "__main__":
        serve(Guess)

`relign-bench try ./guess.py` runs it as a process of its own: it may print, fail or crash, and costs its trial at most. The
class is the manifest (`python3 guess.py --manifest` prints it): its name is the id, its docstring or the module's is the
summary, and these class attributes add the rest:

    observes      what an algorithm observes: "images", "merit", "start", "box", "design", "level",
                  "history"
    presets       {"guess-wide": {"first_stride": 0.3}}
    prepare       {"sources": 10, "steps": 100}: an algorithm with pretraining on other instances (trial.pretraining())
    id, version, summary, license, citation, reproducible ("anywhere" or "this_cpu")

Optimizer and Agent are algorithms; Scene is a simulator, Station a scene that owns its stage; NoiseLevel draws the
perturbations. A path is accepted wherever an id is: `--scene ./bench.py`, `--noise-level ./tight.py`, or in a suite.

This package needs the standard library only; where numpy is installed, images are numpy arrays. The messages that it
exchanges with the host are documented in docs/process_plugins.md.
"""

from .algorithms import Agent, Algorithm, Optimizer
from .images import Box, Image
from .manifest import manifest_of
from .noise_levels import NoiseLevel
from .parameters import Parameter, parameter
from .process import serve
from .scenes import Assembly, Moved, Scene, Station, uncertain_values
from .searches import FunctionSearch, GeneratorSearch, Space
from .service import Stopped
from .services import Lens, Model, Outcome, Pretraining
from .trial import Observation, Trial

__all__ = [
    "Agent",
    "Algorithm",
    "Assembly",
    "Box",
    "FunctionSearch",
    "GeneratorSearch",
    "Image",
    "Lens",
    "Model",
    "Moved",
    "NoiseLevel",
    "Observation",
    "Optimizer",
    "Outcome",
    "Parameter",
    "Pretraining",
    "Scene",
    "Space",
    "Station",
    "Stopped",
    "Trial",
    "manifest_of",
    "parameter",
    "serve",
    "uncertain_values",
]

for _name in __all__:  # error messages and help() then show the public name, not the file
    globals()[_name].__module__ = __name__
