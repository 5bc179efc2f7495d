// What the sources taught: Gaussian processes stacked on each other, the posterior of which is the prior of the target.
//
// The hierarchy: the merit of source i is f_i = g_0 + ... + g_i with independent g_l ~ GP(0, k_l), so that
//   cov(f_i(x), f_j(x')) = sum over l <= min(i, j) of k_l(x, x').
// Conditioned exactly (shgp; one source after the other or all at once is the same), or by means alone (mhgp: source i
// is fitted to what the means before it leave), or by means alone with the error that this makes (bhgp).
//
// Everything is in standardised units; points are columns, in the unit cube.
#pragma once

#include <vector>

#include "surrogates/kernel.hpp"

namespace transfer_gp {

using surrogates::Matrix;
using surrogates::Shape;
using surrogates::Vector;

enum class Stacking { exact, means, boosted };

// The prior of the target at some points. The covariance of two of them is
//   prior(x, x') - white(x) . white(x') + excess(x) . excess(x'),
// prior = sum of all k_l; with Stacking::means it is 0.
struct Known {
  Matrix points;  // d x m
  Vector mean;    // m
  Matrix white;   // N x m; 0 rows where nothing is uncertain
  Matrix excess;  // N x m; 0 rows unless boosted
};

class SourceModel {
 public:
  SourceModel(Shape shape, Stacking stacking) : shape_(shape), stacking_(stacking) {}

  // The next source. theta: amplitude, lengths, noise, as surrogates::Kernel has them. False where the matrix is not
  // positive definite.
  bool append(const Matrix& points, const Vector& values, const Vector& theta);

  Known know(const Matrix& points) const;
  Vector mean(const Matrix& points) const;  // that of know, and no more
  // That mean with `white` . weights less, white being that of know: what values of the target add to it. Not boosted.
  Vector mean_less(const Matrix& points, const Vector& white_weights) const;
  Matrix covariance(const Known& a, const Known& b) const;
  Vector variance(const Known& at) const;
  // The sum of the kernels between points, which know() began from; 0 with Stacking::means.
  Matrix prior(const Matrix& a, const Matrix& b) const;

  Eigen::Index size() const { return values_.size(); }  // N
  Shape shape() const { return shape_; }
  Stacking stacking() const { return stacking_; }

 private:
  struct Level {
    Eigen::Index first, count;
    surrogates::Kernel kernel;
    Matrix own_root;  // of its own kernel matrix with noise; empty when exact
    Vector own_weights;
  };

  Matrix cross(const Matrix& points) const;            // N x m: covariance of the sources' values with the target
  Matrix stacked_weights(const Matrix& points) const;  // N x m: the mean is values . weights, without exactness

  Shape shape_;
  Stacking stacking_;
  std::vector<Level> levels_;
  Matrix points_;         // d x N
  Vector values_;         // N
  Matrix root_;           // N x N, lower; empty with Stacking::means
  Vector whitened_;       // root^-1 values
  Vector weights_;        // root^-T whitened
  double amplitude_ = 0;  // sum of all
};

}  // namespace transfer_gp
