// Prior distributions of a Gaussian process's hyperparameters.
#pragma once

#include "surrogates/likelihood.hpp"

namespace bo_gp {

// Bounds, start and log prior for standardised values in the unit cube; theta as in surrogates/kernel.hpp.
struct HyperPriors {
  surrogates::ThetaBounds bounds;
  surrogates::Vector start;
  surrogates::ThetaPrior prior;
};

// Lengths: log-normal (sqrt 2 + log(d) / 2, sqrt 3), at least 0.025, so they grow with the square root of the dimension
// (BoTorch's SingleTaskGP; Hvarfner et al., 2024). Logarithm of the noise: normal (-4, 2), twice as wide as BoTorch's,
// at least log 1e-4; fixed if fixed_noise is positive. Logarithm of the amplitude: normal (0, 1) (SMAC3).
HyperPriors published_priors(Eigen::Index dimensions, double fixed_noise);

}  // namespace bo_gp
