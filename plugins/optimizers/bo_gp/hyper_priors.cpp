#include "hyper_priors.hpp"

#include <cmath>

namespace bo_gp {

using surrogates::Vector;

HyperPriors published_priors(Eigen::Index dimensions, double fixed_noise) {
  const Eigen::Index last = dimensions + 1;
  Vector middle(dimensions + 2);
  Vector spread(dimensions + 2);
  // BoTorch maximises the density of a length, not of its logarithm: the term -log(length) shifts the mean by
  // sqrt(3)^2.
  middle[0] = 0;
  spread[0] = 1;
  middle.segment(1, dimensions).setConstant(std::sqrt(2.0) + 0.5 * std::log(static_cast<double>(dimensions)) - 3);
  spread.segment(1, dimensions).setConstant(std::sqrt(3.0));
  middle[last] = -4;
  spread[last] = 2;
  HyperPriors made;
  made.bounds.lower = Vector::Constant(dimensions + 2, std::log(0.025));
  made.bounds.upper = Vector::Constant(dimensions + 2, std::log(1000.0));
  made.bounds.lower[last] = fixed_noise > 0 ? std::log(fixed_noise) : std::log(1e-4);
  made.bounds.upper[last] = fixed_noise > 0 ? std::log(fixed_noise) : std::log(10.0);
  // Start with lengths of half the cube: at the prior's mean the likelihood is flat.
  made.start = middle;
  made.start.segment(1, dimensions).setConstant(std::log(0.5));
  made.prior = [middle, spread](const Vector& theta, Vector& gradient) {
    const Vector away = (theta - middle).cwiseQuotient(spread);
    gradient -= away.cwiseQuotient(spread);
    return -0.5 * away.squaredNorm();
  };
  return made;
}

}  // namespace bo_gp
