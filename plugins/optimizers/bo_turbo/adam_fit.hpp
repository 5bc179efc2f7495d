// The fit of TuRBO's hyperparameters: 50 steps of Adam on the marginal likelihood from a fixed start.
#pragma once

#include "surrogates/likelihood.hpp"

namespace bo_turbo {

using surrogates::Vector;

struct Fitted {
  Vector theta;     // as in surrogates/kernel.hpp
  double mean = 0;  // of the process, in units of the standardised values
};

// Keeps the amplitude within 0.05 to 20, lengths within 0.005 to 2 and the noise within 5e-4 to 0.2.
Fitted adam_fit(const surrogates::Likelihood& likelihood, Eigen::Index axes, Eigen::Index points);

}  // namespace bo_turbo
