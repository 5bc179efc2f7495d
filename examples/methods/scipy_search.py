"""Searches of SciPy that need no derivatives, local and global."""
from scipy import optimize

from relign_bench.plugin import FunctionSearch, parameter, serve

LOCAL = ("Nelder-Mead", "Powell", "COBYLA", "COBYQA")
GLOBAL = ("differential_evolution", "dual_annealing", "direct", "shgo")


class ScipySearch(FunctionSearch):
    id = "scipy"
    presets = {"scipy-" + method.lower().replace("_", "-"): {"method": method} for method in LOCAL + GLOBAL}
    license = "BSD-3-Clause"
    citation = "Virtanen et al., SciPy 1.0, Nature Methods 17, 2020."
    reproducible = "this_cpu"

    method = parameter("COBYQA", allowed=LOCAL + GLOBAL)

    def search(self, merit, space):
        if self.method in LOCAL:
            optimize.minimize(merit, space.start, method=self.method, bounds=space.bounds)
        else:
            seeded = {"rng": space.seed} if self.method in ("differential_evolution", "dual_annealing") else {}
            getattr(optimize, self.method)(merit, space.bounds, **seeded)


if __name__ == "__main__":
    serve(ScipySearch)
