"""Optimizers of Nevergrad by their names in its registry."""
from relign_bench.plugin import GeneratorSearch, parameter, serve
from relign_bench.plugin.generators import NevergradGenerator


class NevergradSearch(GeneratorSearch):
    id = "nevergrad"
    presets = {
        "nevergrad-ngopt": {"optimizer": "NGOpt"},
        "nevergrad-one-plus-one": {"optimizer": "OnePlusOne"},
        "nevergrad-tbpsa": {"optimizer": "TBPSA"},
        "nevergrad-two-points-de": {"optimizer": "TwoPointsDE"},
        "nevergrad-pso": {"optimizer": "PSO"},
        "nevergrad-diagonal-cma": {"optimizer": "DiagonalCMA"},
    }
    license = "MIT"
    citation = "Rapin, Teytaud, Nevergrad: a gradient-free optimization platform, 2018."
    reproducible = "this_cpu"

    optimizer = parameter("NGOpt", description="Name in nevergrad.optimizers.registry")

    def generator(self, space):
        return NevergradGenerator(self.optimizer, space)


if __name__ == "__main__":
    serve(NevergradSearch)
