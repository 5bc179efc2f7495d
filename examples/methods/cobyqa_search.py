"""COBYQA: the successor of Powell's BOBYQA and COBYLA, quadratic models in a trust region."""
from cobyqa import minimize

from relign_bench.plugin import FunctionSearch, serve


class CobyqaSearch(FunctionSearch):
    id = "cobyqa"
    license = "BSD-3-Clause"
    citation = "Ragonneau, Zhang, COBYQA: Constrained Optimization BY Quadratic Approximations, 2022."
    reproducible = "this_cpu"

    def search(self, merit, space):
        minimize(merit, space.start, bounds=space.bounds)


if __name__ == "__main__":
    serve(CobyqaSearch)
