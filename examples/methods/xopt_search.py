"""Generators of Xopt: BoTorch's expected improvement, also in trust regions (TuRBO), Nelder-Mead and RCDS."""
import torch
from xopt.generators import get_generator

from relign_bench.plugin import GeneratorSearch, parameter, serve

BAYESIAN = ("expected_improvement", "upper_confidence_bound")
NAMES = (*BAYESIAN, "neldermead", "rcds", "extremum_seeking")


class XoptSearch(GeneratorSearch):
    id = "xopt"
    presets = {
        "xopt-ei": {"generator_name": "expected_improvement"},
        "xopt-turbo": {"generator_name": "expected_improvement", "options": {"turbo_controller": "optimize"}},
        "xopt-ucb": {"generator_name": "upper_confidence_bound"},
        "xopt-neldermead": {"generator_name": "neldermead"},
        "xopt-rcds": {"generator_name": "rcds"},
        "xopt-extremum-seeking": {"generator_name": "extremum_seeking"},
    }
    license = "Apache-2.0"
    citation = "Roussel et al., Xopt: A simplified framework for optimization of accelerator problems, IPAC 2023."
    reproducible = "this_cpu"

    generator_name = parameter("expected_improvement", allowed=NAMES)
    options = parameter({}, description="Further arguments of the generator")

    def generator(self, space):
        torch.manual_seed(space.seed)
        torch.set_num_threads(1)  # trials run on all cores already
        options = dict(self.options)
        if self.generator_name in BAYESIAN:  # without Xopt's limit of seconds: a trial must not depend on the machine's speed
            options.setdefault("numerical_optimizer", {"name": "LBFGS", "max_time": None})
        return get_generator(self.generator_name)(vocs=space.vocs(), **options)


if __name__ == "__main__":
    serve(XoptSearch)
