// Gaussian process regression: predicts the function without the noise.
#pragma once

#include "growing_cholesky.hpp"
#include "kernel.hpp"
#include "standard.hpp"

namespace surrogates {

constexpr double kJitter = 1e-10;  // on the diagonal: scikit-learn's alpha

struct Prediction {
  double mean = 0;
  double deviation = 0;
  Vector mean_gradient;
  Vector deviation_gradient;
};

// What is known of the function before any value, besides the kernel's mean 0: the posterior of a model of other data.
// In standardised units. Each field is needed.
struct KnownAtPoints {
  Vector mean;        // n
  Matrix covariance;  // n x n
};
struct KnownAt {
  double mean = 0;
  double variance = 0;
  Vector covariance;  // with the n points
  Vector mean_gradient;
  Vector variance_gradient;
  Matrix covariance_gradient;  // d x n
};
struct KnownAtMany {
  Vector mean;        // m
  Vector variance;    // m
  Matrix covariance;  // n x m
};

class GaussianProcess {
 public:
  // Values in any units; predictions are in the same.
  GaussianProcess(Shape shape, Matrix points, const Vector& values, const Vector& theta, const Standard& standard,
                  const KnownAtPoints* known = nullptr);

  // With a known posterior at the points one is needed at the places to predict too.
  Prediction predict(const Vector& at, const KnownAt* known = nullptr) const;
  // Many places at once, without gradients.
  void predict(const Matrix& at, Vector& mean, Vector& deviation, const KnownAtMany* known = nullptr) const;

  // One more value under the same theta and standard, without a new factorisation; false (and unchanged) where
  // rounding does not allow it. Not for a process with a known posterior.
  bool append(const Vector& at, double value);

  const Standard& standard() const { return standard_; }
  const Matrix& points() const { return points_; }

 private:
  Kernel kernel_;
  double noise_;
  Matrix points_;
  Standard standard_;
  Vector targets_;  // standardised, known mean subtracted
  GrowingCholesky root_;
  Vector weights_;
};

}  // namespace surrogates
