// Captures as least squares sees them: differences from the reference image, blurred. All that least squares needs of
// residuals is the product of one with another, so that 40,000 pixels are looked at once per capture and pair.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <relign/plugin.hpp>
#include <utility>
#include <vector>

namespace ceres_plugin {

class Captures {
 public:
  explicit Captures(const relign::ImageView& reference)
      : bin_(1 + (std::max(reference.width(), reference.height()) - 1) / kMostSide),
        width_(static_cast<Eigen::Index>(reference.width() / bin_)),
        height_(static_cast<Eigen::Index>(reference.height() / bin_)),
        reference_(binned(reference)) {}

  void add(const relign::ImageView& image) {
    raw_.push_back(binned(image) - reference_);
    add_blurred();
  }

  // Standard deviation of the blur as a share of the image's shorter side.
  void set_blur(double share) {
    sigma_ = share * static_cast<double>(std::min(width_, height_));
    blurred_.clear();
    products_.resize(0, 0);
    while (blurred_.size() < raw_.size()) add_blurred();
    const Eigen::VectorXf seen = blur(reference_);
    const double power = seen.squaredNorm() / static_cast<double>(seen.size());
    contrast_ = power > 0 && std::isfinite(power) ? std::sqrt(power) : 1;
  }

  // Mean over the pixels of the product of two residuals, in units of the blurred reference's own mean square.
  Eigen::MatrixXd products() const { return products_ / (contrast_ * contrast_); }

  // What noise adds to the product of a capture with itself, from two captures at one pose.
  double noise(Eigen::Index one, Eigen::Index other) const {
    const Eigen::MatrixXd all = products();
    return std::max(0.0, 0.5 * (all(one, one) + all(other, other)) - all(one, other));
  }

 private:
  static constexpr std::size_t kMostSide = 256;  // larger images are binned
  static constexpr float kBrightest = 1e9F;      // beyond it squares overflow: such pixels count as dark

  Eigen::VectorXf binned(const relign::ImageView& image) const {
    Eigen::VectorXf pixels = Eigen::VectorXf::Zero(width_ * height_);
    const std::size_t width = static_cast<std::size_t>(width_) * bin_,
                      height = static_cast<std::size_t>(height_) * bin_;
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x) {
        const float pixel = image.at(x, y);
        if (std::fabs(pixel) < kBrightest)
          pixels[static_cast<Eigen::Index>(y / bin_) * width_ + static_cast<Eigen::Index>(x / bin_)] += pixel;
      }
    return pixels / static_cast<float>(bin_ * bin_);
  }

  void add_blurred() {
    blurred_.push_back(blur(raw_[blurred_.size()]));
    const auto count = static_cast<Eigen::Index>(blurred_.size());
    Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(count, count);
    larger.topLeftCorner(count - 1, count - 1) = products_;
    for (Eigen::Index i = 0; i < count; ++i) {
      const double sum = blurred_[static_cast<std::size_t>(i)].dot(blurred_.back());
      larger(i, count - 1) = larger(count - 1, i) = sum / static_cast<double>(width_ * height_);
    }
    products_ = larger;
  }

  // Gaussian, along y and then along x. Dark beyond the edge: what lies there is unknown in every capture alike. The
  // result is transposed, which no product feels.
  Eigen::VectorXf blur(const Eigen::VectorXf& pixels) const {
    if (!(sigma_ > 0)) return pixels;
    return along_columns(along_columns(pixels, width_, height_), height_, width_);
  }

  // `lines` values lie side by side; blurs across them and transposes.
  Eigen::VectorXf along_columns(const Eigen::VectorXf& pixels, Eigen::Index lines, Eigen::Index length) const {
    const auto reach = static_cast<Eigen::Index>(std::ceil(3 * sigma_));
    Eigen::VectorXf weights(2 * reach + 1);
    for (Eigen::Index i = -reach; i <= reach; ++i)
      weights[i + reach] = static_cast<float>(std::exp(-0.5 * static_cast<double>(i * i) / (sigma_ * sigma_)));
    weights /= weights.sum();
    const Eigen::Map<const Eigen::MatrixXf> in(pixels.data(), lines, length);
    Eigen::MatrixXf out = Eigen::MatrixXf::Zero(lines, length);
    for (Eigen::Index x = 0; x < length; ++x)
      for (Eigen::Index k = std::max(-reach, -x); k <= std::min(reach, length - 1 - x); ++k)
        out.col(x) += weights[k + reach] * in.col(x + k);
    const Eigen::MatrixXf turned = out.transpose();
    return Eigen::Map<const Eigen::VectorXf>(turned.data(), turned.size());
  }

  std::size_t bin_;
  Eigen::Index width_, height_;
  Eigen::VectorXf reference_;
  std::vector<Eigen::VectorXf> raw_;
  double sigma_ = 0;  // pixels
  double contrast_ = 1;
  std::vector<Eigen::VectorXf> blurred_;
  Eigen::MatrixXd products_;
};

// Columns with the same products as the captures have, one for each: residuals of as many numbers as there are captures
// (Cholesky's factor; a capture that is a combination of those before it adds no number).
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
