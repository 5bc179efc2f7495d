"""The search loops of the authors' package (relign 0.1.0, its classes `GP` and `ForestOptimization`) as a plugin.

They leave most of scikit-optimize at its defaults, so that `forest` is extra trees, whatever its docstring says
(test_skopt.py), and `gp` measures a random pose of its own before scikit-optimize's ten.
"""

import importlib
import os

# One thread, as ours. Read when numpy is loaded.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from relign_bench.plugin import Optimizer, parameter, serve


class BudgetSpent(Exception):
    """Leaves the package's loop."""


class Measured:
    """What the package's loops need of its environment: the number of axes, and the merit at a pose."""

    def __init__(self, talk):
        self.talk = talk
        self.n_actions = len(talk.axes)

    def __call__(self, pose):
        seen = self.talk.step([float(value) for value in pose])
        if seen is None:
            raise BudgetSpent
        return seen.merit


def loop(name):
    """The package's class, imported without its learning libraries."""
    import stand_ins

    stand_ins.install()
    module, title = {"gp": ("gp", "GP"), "forest": ("forest", "ForestOptimization")}[name]
    return getattr(importlib.import_module(f"relign.algorithms.{module}"), title)


class PackageSearch(Optimizer):
    id = "package-search"
    knows = ("merit", "start", "box")
    reproducible = "this_cpu"
    license = "Apache-2.0"

    search = parameter("gp", allowed=["gp", "forest"], description="The package's GP or ForestOptimization")

    def run(self, talk):
        import warnings

        import numpy  # here: asking for the manifest needs neither

        warnings.filterwarnings("ignore")  # "evaluated at this point before", "did not converge"
        lower, upper = ({float(value) for value in bound} for bound in (talk.box.lower, talk.box.upper))
        if len(lower) != 1 or len(upper) != 1:
            raise ValueError(f"the package's loops need the same bounds on every axis, not {talk.box}")
        numpy.random.seed(talk.seed % 2**32)  # the loops give scikit-optimize no seed
        try:
            loop(self.search)(n_steps=talk.budget, v_min=lower.pop(), v_max=upper.pop()).align(Measured(talk))
        except BudgetSpent:
            pass


if __name__ == "__main__":
    serve(PackageSearch)
