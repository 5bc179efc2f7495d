// Stacked Gaussian processes of the sources, whose posterior is the prior of the target.
//
// The hierarchy: the merit of source i is f_i = g_0 + ... + g_i with independent g_l ~ GP(0, k_l), so that
//   cov(f_i(x), f_j(x')) = sum over l <= min(i, j) of k_l(x, x').
// Conditioned exactly (shgp; sequential and joint conditioning are equal), on means only (mhgp: source i is fitted to
// the residuals of the previous means), or on means with the covariance of their error (bhgp).
//
// All values are standardised; points are columns, in the unit cube.
#pragma once

#include <vector>

#include "surrogates/kernel.hpp"

namespace transfer_gp {

using surrogates::Matrix;
using surrogates::Shape;
using surrogates::Vector;

enum class Stacking { exact, means, boosted };

// The prior of the target at m points. The covariance of two of them is
//   prior(x, x') - white(x) . white(x') + excess(x) . excess(x'),
// prior = sum of all k_l; with Stacking::means it is 0.
struct Known {
  Matrix points;  // d x m
  Vector mean;    // m
  Matrix white;   // N x m; 0 rows without covariance
  Matrix excess;  // N x m; 0 rows unless boosted
};

class SourceModel {
 public:
  SourceModel(Shape shape, Stacking stacking) : shape_(shape), stacking_(stacking) {}

  // Adds the next source. theta: amplitude, lengths, noise, as in surrogates::Kernel. Returns false if the matrix is
  // not positive definite.
  bool append(const Matrix& points, const Vector& values, const Vector& theta);

  Known know(const Matrix& points) const;
  Vector mean(const Matrix& points) const;  // the mean of know(), with less work
  // mean(points) - white . white_weights, with the white matrix of know(): the contribution of values of the target.
  // Not for boosted stacking.
  Vector mean_less(const Matrix& points, const Vector& white_weights) const;
  Matrix covariance(const Known& a, const Known& b) const;
  Vector variance(const Known& at) const;
  // The sum of all kernels between points, before conditioning; 0 with Stacking::means.
  Matrix prior(const Matrix& a, const Matrix& b) const;

  Eigen::Index size() const { return values_.size(); }  // N
  Shape shape() const { return shape_; }
  Stacking stacking() const { return stacking_; }

 private:
  struct Level {
    Eigen::Index first, count;
    surrogates::Kernel kernel;
    Matrix own_root;  // Cholesky factor of its kernel matrix with noise; empty if exact
    Vector own_weights;
  };

  Matrix cross(const Matrix& points) const;            // N x m: covariance of the sources' values with the target
  Matrix stacked_weights(const Matrix& points) const;  // N x m: mean = values . weights; not for exact stacking

  Shape shape_;
  Stacking stacking_;
  std::vector<Level> levels_;
  Matrix points_;         // d x N
  Vector values_;         // N
  Matrix root_;           // N x N, lower; empty with Stacking::means
  Vector whitened_;       // root^-1 values
  Vector weights_;        // root^-T whitened
  double amplitude_ = 0;  // sum over all levels
};

}  // namespace transfer_gp
