"""BoTorch without a package above it: a Gaussian process and the logarithm of expected improvement, as in its tutorials."""
import torch
from botorch.acquisition.logei import qLogExpectedImprovement
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from botorch.optim import optimize_acqf
from botorch.utils.sampling import draw_sobol_samples
from botorch.utils.transforms import normalize, unnormalize
from gpytorch.mlls import ExactMarginalLogLikelihood

from relign_bench.plugin import GeneratorSearch, parameter, serve
from relign_bench.plugin.generators import Generator


class Improvement(Generator):
    """Quasi-random points first, then the point of the largest expected improvement."""

    def __init__(self, space, initial):
        super().__init__(space)
        self._poses, self._values = [], []
        self._box = torch.tensor([space.lower, space.upper], dtype=torch.double)
        self._cube = torch.tensor([[0.0], [1.0]], dtype=torch.double).expand_as(self._box)
        self._initial = draw_sobol_samples(self._box, n=initial, q=1, seed=space.seed).squeeze(1).tolist()

    def ask(self):
        if self._initial:
            return None, self._initial.pop(0)
        poses = normalize(torch.tensor(self._poses, dtype=torch.double), self._box)
        values = torch.tensor(self._values, dtype=torch.double)
        model = SingleTaskGP(poses, values)  # which standardizes the values
        fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
        improvement = qLogExpectedImprovement(model, best_f=values.max())
        best, _ = optimize_acqf(improvement, bounds=self._cube, q=1, num_restarts=5, raw_samples=256)
        return None, unnormalize(best, self._box).squeeze(0).tolist()

    def tell(self, asked, pose, merit):
        self.add(pose, merit)

    def add(self, pose, merit):
        self._poses.append(pose)
        self._values.append([-merit])  # BoTorch maximizes


class BotorchSearch(GeneratorSearch):
    id = "botorch"
    license = "MIT"
    citation = "Balandat et al., BoTorch, NeurIPS 2020; Ament et al., Unexpected Improvements, NeurIPS 2023."
    reproducible = "this_cpu"

    initial = parameter(10, minimum=1, description="Quasi-random points before the first model")

    def generator(self, space):
        torch.manual_seed(space.seed)
        torch.set_num_threads(1)  # trials run on all cores already
        return Improvement(space, self.initial)


if __name__ == "__main__":
    serve(BotorchSearch)
