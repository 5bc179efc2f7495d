// What is held likely of a Gaussian process's hyper-parameters before any value was seen.
#pragma once

#include "surrogates/likelihood.hpp"

namespace bo_gp {

// Bounds, start and prior for standardised values in the unit cube; theta as in surrogates/kernel.hpp.
struct HyperPriors {
  surrogates::ThetaBounds bounds;
  surrogates::Vector start;
  surrogates::ThetaPrior prior;
};

// Lengths grow with the square root of the dimension: log-normal (sqrt 2 + log(d) / 2, sqrt 3), at least 0.025
// (BoTorch's SingleTaskGP; Hvarfner et al., 2024). Logarithm of the noise: normal (-4, 2), twice as wide as BoTorch's,
// at least log 1e-4; of the amplitude: normal (0, 1) (SMAC3). A noise given is held.
HyperPriors published_priors(Eigen::Index dimensions, double fixed_noise);

}  // namespace bo_gp
