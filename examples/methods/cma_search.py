"""CMA-ES of the package cma by its author; recommends the mean of its distribution."""
import cma

from relign_bench.plugin import GeneratorSearch, parameter, serve
from relign_bench.plugin.generators import CmaGenerator


class CmaSearch(GeneratorSearch):
    id = "cma"
    presets = {"cma-separable": {"options": {"CMA_diagonal": True}}, "cma-active-off": {"options": {"CMA_active": False}}}
    license = "BSD-3-Clause"
    citation = "Hansen, Akimoto, Baudis, CMA-ES/pycma on Github, Zenodo 2559634."
    reproducible = "this_cpu"

    sigma = parameter(0.15, minimum=0.001, maximum=1.0, unit="share of the travel",
                      description="Standard deviation of the first generation, per axis")
    options = parameter({}, description="Further options of cma.CMAEvolutionStrategy")

    def generator(self, space):
        options = {"bounds": [space.lower, space.upper], "seed": space.seed or 1, "verbose": -9, **self.options}
        return CmaGenerator(cma.CMAEvolutionStrategy(space.start, self.sigma, options), space)


if __name__ == "__main__":
    serve(CmaSearch)
