"""Py-BOBYQA: quadratic models in a trust region, with restarts for noisy functions."""
import numpy as np
import pybobyqa

from relign_bench.plugin import FunctionSearch, parameter, serve


class PyBobyqaSearch(FunctionSearch):
    id = "pybobyqa"
    presets = {"pybobyqa-noisy": {"noisy": True}}
    license = "GPL-3.0-or-later"
    citation = "Cartis et al., Improving the Flexibility and Robustness of Model-Based Derivative-Free Solvers, 2019."
    reproducible = "this_cpu"

    noisy = parameter(False, description="Settings for a noisy function, with restarts")

    def search(self, merit, space):
        np.random.seed(space.seed)  # Py-BOBYQA uses numpy's global generator
        pybobyqa.solve(merit, np.array(space.start), bounds=(np.array(space.lower), np.array(space.upper)),
                       maxfun=2 * space.budget + 2, rhobeg=0.1, objfun_has_noise=self.noisy)


if __name__ == "__main__":
    serve(PyBobyqaSearch)
