// Log marginal likelihood of a Gaussian process as a function of its hyper-parameters, and the search for the best
// ones.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "bounded_lbfgs.hpp"
#include "kernel.hpp"

namespace surrogates {

// Of values (prior mean subtracted already) at points, with covariance kernel + white noise. A fixed covariance that no
// hyper-parameter changes, such as what source data left uncertain, is added where one is given.
class Likelihood {
 public:
  Likelihood(Shape shape, const Matrix& points, const Vector& values, Matrix fixed = Matrix());

  // -infinity where the matrix is not positive definite. The gradient may be null.
  double log(const Vector& theta, Vector* gradient) const;

 private:
  Shape shape_;
  std::vector<Matrix> squares_;  // per dimension: squared differences, the same for every theta
  Vector values_;
  Matrix fixed_;
};

struct ThetaBounds {
  Vector lower;
  Vector upper;
};

// scikit-optimize's: amplitude in [0.01, 1000], lengths in [0.01, 100], noise in [1e-5, 1e5]; or the noise held at a
// value.
ThetaBounds skopt_bounds(Eigen::Index dimensions, double fixed_noise = 0);

// Adds the logarithm of a prior density of theta to the value, its derivatives to the gradient.
using ThetaPrior = std::function<double(const Vector& theta, Vector& gradient)>;

// The most likely theta found from any of the starts; with a prior the most probable one.
Vector fit_theta(const Likelihood& likelihood, const ThetaBounds& bounds, const std::vector<Vector>& starts,
                 const ThetaPrior& prior = {});

}  // namespace surrogates
