// Residuals of captures: differences from the reference image, blurred. Least squares needs only their inner products,
// so each pair of captures is processed once.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <relign/plugin.hpp>
#include <utility>
#include <vector>

#include "least_squares/binning.hpp"

namespace ceres_plugin {

class Captures {
 public:
  explicit Captures(const relign::ImageView& reference)
      : binned_(reference.width(), reference.height(), kMaxSide), reference_(binned_(reference)) {}

  void add(const relign::ImageView& image) {
    raw_.push_back(binned_(image) - reference_);
    add_blurred();
  }

  // share: standard deviation of the blur, as a share of the image's shorter side.
  void set_blur(double share) {
    sigma_ = share * static_cast<double>(std::min(binned_.width(), binned_.height()));
    blurred_.clear();
    products_.resize(0, 0);
    while (blurred_.size() < raw_.size()) add_blurred();
    const Eigen::VectorXf soft = blur(reference_);
    const double power = soft.squaredNorm() / static_cast<double>(soft.size());
    contrast_ = power > 0 && std::isfinite(power) ? std::sqrt(power) : 1;
  }

  // Inner products of all residuals, as means over pixels relative to the blurred reference's mean square.
  Eigen::MatrixXd products() const { return products_ / (contrast_ * contrast_); }

  // The contribution of noise to the product of a capture with itself, from two captures at the same pose.
  double noise(Eigen::Index one, Eigen::Index other) const {
    const Eigen::MatrixXd all = products();
    return std::max(0.0, 0.5 * (all(one, one) + all(other, other)) - all(one, other));
  }

 private:
  static constexpr std::size_t kMaxSide = 256;  // larger images are binned

  void add_blurred() {
    blurred_.push_back(blur(raw_[blurred_.size()]));
    const auto count = static_cast<Eigen::Index>(blurred_.size());
    Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(count, count);
    larger.topLeftCorner(count - 1, count - 1) = products_;
    for (Eigen::Index i = 0; i < count; ++i) {
      const double sum = blurred_[static_cast<std::size_t>(i)].dot(blurred_.back());
      larger(i, count - 1) = larger(count - 1, i) = sum / static_cast<double>(binned_.pixels());
    }
    products_ = larger;
  }

  Eigen::VectorXf blur(const Eigen::VectorXf& pixels) const {
    return least_squares::blurred(pixels, binned_.width(), binned_.height(), sigma_);
  }

  least_squares::Binning binned_;
  Eigen::VectorXf reference_;
  std::vector<Eigen::VectorXf> raw_;
  double sigma_ = 0;  // pixels
  double contrast_ = 1;
  std::vector<Eigen::VectorXf> blurred_;
  Eigen::MatrixXd products_;
};

// Returns short vectors, one column per capture, with the given inner products (a Cholesky factor; a capture that is a
// combination of earlier ones adds no dimension).
inline Eigen::MatrixXd coordinates(const Eigen::MatrixXd& products) {
  const Eigen::Index count = products.rows();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    double rest = products(i, i);
    for (Eigen::Index j = 0; j < i; ++j) {
      const double pivot = rows(j, j);
      if (pivot > 0) rows(i, j) = (products(i, j) - rows.row(i).head(j).dot(rows.row(j).head(j))) / pivot;
      rest -= rows(i, j) * rows(i, j);
    }
    rows(i, i) = rest > 1e-6 * products(i, i) ? std::sqrt(rest) : 0;
  }
  return rows.transpose();
}

}  // namespace ceres_plugin
