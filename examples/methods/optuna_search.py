"""Samplers of Optuna: Parzen estimators, a Gaussian process, CMA-ES and quasi-random points."""
import optuna

from relign_bench.plugin import GeneratorSearch, parameter, serve
from relign_bench.plugin.generators import OptunaGenerator

SAMPLERS = ("TPESampler", "GPSampler", "CmaEsSampler", "QMCSampler", "RandomSampler")


class OptunaSearch(GeneratorSearch):
    id = "optuna"
    presets = {
        "optuna-tpe": {"sampler": "TPESampler"},
        "optuna-tpe-multivariate": {"sampler": "TPESampler", "options": {"multivariate": True}},
        "optuna-gp": {"sampler": "GPSampler"},
        "optuna-cma-es": {"sampler": "CmaEsSampler"},
        "optuna-qmc": {"sampler": "QMCSampler"},
    }
    license = "MIT"
    citation = "Akiba et al., Optuna: A Next-generation Hyperparameter Optimization Framework, KDD 2019."
    reproducible = "this_cpu"

    sampler = parameter("TPESampler", allowed=SAMPLERS)
    options = parameter({}, description="Further arguments of the sampler")

    def generator(self, space):
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        sampler = getattr(optuna.samplers, self.sampler)(seed=space.seed, **self.options)
        return OptunaGenerator(optuna.create_study(sampler=sampler), space)


if __name__ == "__main__":
    serve(OptunaSearch)
