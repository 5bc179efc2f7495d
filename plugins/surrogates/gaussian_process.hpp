// Gaussian process regression. Predicts the noise-free function.
#pragma once

#include "growing_cholesky.hpp"
#include "kernel.hpp"
#include "standard.hpp"

namespace surrogates {

constexpr double kJitter = 1e-10;  // added to the diagonal, as scikit-learn's alpha

struct Prediction {
  double mean = 0;
  double deviation = 0;
  Vector mean_gradient;
  Vector deviation_gradient;
};

// An informative prior that is added to the kernel's: the posterior of a model of other data, in standardised units.
// All fields must be set. n: number of points, d: dimensions, m: number of queries.
struct PriorAtPoints {
  Vector mean;        // n
  Matrix covariance;  // n x n
};
struct PriorAt {
  double mean = 0;
  double variance = 0;
  Vector covariance;  // with the n points
  Vector mean_gradient;
  Vector variance_gradient;
  Matrix covariance_gradient;  // d x n
};
struct PriorAtMany {
  Vector mean;        // m
  Vector variance;    // m
  Matrix covariance;  // n x m
};

class GaussianProcess {
 public:
  // Predictions have the units of `values`.
  GaussianProcess(Shape shape, Matrix points, const Vector& values, const Vector& theta, const Standard& standard,
                  const PriorAtPoints* prior = nullptr);

  // A process with a prior needs it at the queries, too.
  Prediction predict(const Vector& at, const PriorAt* prior = nullptr) const;
  // For all columns of `at`, without gradients.
  void predict(const Matrix& at, Vector& mean, Vector& deviation, const PriorAtMany* prior = nullptr) const;

  // One joint draw of noisy values at all columns of `at`, from as many standard normal numbers. Its covariance matrix
  // takes memory of the square and time of the cube of their number. Not for a process with a prior.
  Vector draw(const Matrix& at, const Vector& normals) const;

  // Adds a value under the same theta and standard, without a new factorisation. Returns false and leaves the process
  // unchanged if rounding makes the matrix indefinite. Not for a process with a prior.
  bool append(const Vector& at, double value);

  const Standard& standard() const { return standard_; }
  const Matrix& points() const { return points_; }

 private:
  Kernel kernel_;
  double noise_;
  Matrix points_;
  Standard standard_;
  Vector targets_;  // standardised, the prior's mean subtracted
  GrowingCholesky root_;
  Vector weights_;
};

}  // namespace surrogates
