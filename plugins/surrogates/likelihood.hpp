// Log marginal likelihood of a Gaussian process as a function of its hyperparameters, and its maximisation.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "bounded_lbfgs.hpp"
#include "kernel.hpp"

namespace surrogates {

// Of values (prior mean already subtracted) at points, with covariance kernel + white noise. fixed: a covariance that
// does not depend on the hyperparameters, such as the posterior covariance of source data; empty for none.
class Likelihood {
 public:
  Likelihood(Shape shape, const Matrix& points, const Vector& values, Matrix fixed = Matrix());

  // Returns -infinity if the covariance is not positive definite. gradient may be null. by_mean (may be null, needs the
  // gradient) receives the derivative by a constant `mean` of the process.
  double log(const Vector& theta, Vector* gradient, double mean = 0, double* by_mean = nullptr) const;

 private:
  Shape shape_;
  std::vector<Matrix> squares_;  // squared differences per dimension, independent of theta
  Vector values_;
  Matrix fixed_;
};

struct ThetaBounds {
  Vector lower;
  Vector upper;
};

// scikit-optimize's bounds: amplitude in [0.01, 1000], lengths in [0.01, 100], noise in [1e-5, 1e5], or fixed at
// fixed_noise if that is positive.
ThetaBounds skopt_bounds(Eigen::Index dimensions, double fixed_noise = 0);

// Returns the log prior density of theta and adds its derivatives to the gradient.
using ThetaPrior = std::function<double(const Vector& theta, Vector& gradient)>;

// Maximum likelihood from the best of the starts; maximum a posteriori with a prior.
Vector fit_theta(const Likelihood& likelihood, const ThetaBounds& bounds, const std::vector<Vector>& starts,
                 const ThetaPrior& prior = {});

}  // namespace surrogates
