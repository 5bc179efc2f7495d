"""Ax with its own choice of models: quasi-random points first, then Bayesian optimisation of BoTorch."""
import logging

from ax.api.client import Client

from relign_bench.plugin import GeneratorSearch, serve
from relign_bench.plugin.generators import AxGenerator


class AxSearch(GeneratorSearch):
    id = "ax"
    license = "MIT"
    citation = "Olson et al., Ax: A Platform for Adaptive Experimentation, AutoML 2025."
    reproducible = "this_cpu"

    def generator(self, space):
        logging.getLogger("ax").setLevel(logging.ERROR)
        return AxGenerator(Client(random_seed=space.seed), space)


if __name__ == "__main__":
    serve(AxSearch)
