"""The search loops of the authors' package (relign 0.1.0, its classes `GP` and `ForestOptimization`) as a plugin.

They keep most defaults of scikit-optimize, so that `forest` is extra trees, in spite of its docstring (test_skopt.py), and `gp`
measures one random pose before scikit-optimize's ten.
"""

import importlib
import os

# One thread, as in relign-bench. numpy reads these when it is imported.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from relign_bench.plugin import Optimizer, parameter, serve  # noqa: E402


class BudgetSpent(Exception):
    """Ends the package's loop."""


class Measured:
    """Replaces the package's environment: the number of axes, and the merit at a pose."""

    def __init__(self, trial):
        self.trial = trial
        self.n_actions = len(trial.axes)

    def __call__(self, pose):
        observation = self.trial.step([float(value) for value in pose])
        if observation is None:
            raise BudgetSpent
        return observation.merit


def loop(name):
    """The package's class, imported without its learning libraries."""
    import stand_ins

    stand_ins.install()
    module, title = {"gp": ("gp", "GP"), "forest": ("forest", "ForestOptimization")}[name]
    return getattr(importlib.import_module(f"relign.algorithms.{module}"), title)


class PackageSearch(Optimizer):
    id = "package-search"
    observes = ("merit", "start", "box")
    reproducible = "this_cpu"
    license = "Apache-2.0"

    search = parameter("gp", allowed=["gp", "forest"], description="The package's GP or ForestOptimization")

    def run(self, trial):
        import warnings

        import numpy  # here, because the manifest does not need it

        warnings.filterwarnings("ignore")  # "evaluated at this point before", "did not converge"
        lower, upper = ({float(value) for value in bound} for bound in (trial.box.lower, trial.box.upper))
        if len(lower) != 1 or len(upper) != 1:
            raise ValueError("the package's loops need the same bounds on every axis, found "
                             f"{trial.box.lower} to {trial.box.upper}")
        numpy.random.seed(trial.seed % 2**32)  # the loops pass no seed to scikit-optimize
        try:
            loop(self.search)(n_steps=trial.budget, v_min=lower.pop(), v_max=upper.pop()).align(Measured(trial))
        except BudgetSpent:
            pass


if __name__ == "__main__":
    serve(PackageSearch)
