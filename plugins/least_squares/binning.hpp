// Binning and blurring of captures for least squares.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <relign/basics.hpp>

namespace least_squares {

// Images are stored row by row, row 0 on top.

// Means over squares of bin x bin pixels; incomplete squares at the right and lower edge are dropped.
template <class Pixels>
auto means_over_squares(const Eigen::MatrixBase<Pixels>& pixels, Eigen::Index width, Eigen::Index height,
                        Eigen::Index bin) {
  using Number = typename Pixels::Scalar;
  using Means = Eigen::Matrix<Number, Eigen::Dynamic, 1>;
  const Eigen::Index columns = width / bin, rows = height / bin;
  Means means = Means::Zero(columns * rows);
  for (Eigen::Index y = 0; y < rows * bin; ++y)
    for (Eigen::Index x = 0; x < columns * bin; ++x) means[y / bin * columns + x / bin] += pixels[y * width + x];
  return Means(means / static_cast<Number>(bin * bin));
}

class Binning {
 public:
  // Selects the smallest bin with which no side is longer than `most_side`; incomplete squares are dropped.
  Binning(std::size_t width, std::size_t height, std::size_t most_side)
      : bin_(1 + (std::max(width, height) - 1) / most_side),
        width_(static_cast<Eigen::Index>(width / bin_)),
        height_(static_cast<Eigen::Index>(height / bin_)) {}

  Eigen::Index width() const { return width_; }
  Eigen::Index height() const { return height_; }
  Eigen::Index pixels() const { return width_ * height_; }
  std::size_t bin() const { return bin_; }

  // Means over the squares. Pixels that are not finite, or so bright that their squares overflow, count as 0.
  template <class Image>  // at(x, y)
  Eigen::VectorXf operator()(const Image& image) const {
    const auto bin = static_cast<Eigen::Index>(bin_), width = width_ * bin, height = height_ * bin;
    Eigen::VectorXf pixels(width * height);
    for (Eigen::Index y = 0; y < height; ++y)
      for (Eigen::Index x = 0; x < width; ++x) {
        const float pixel = image.at(static_cast<std::size_t>(x), static_cast<std::size_t>(y));
        pixels[y * width + x] = std::fabs(pixel) < kBrightest ? pixel : 0.0F;
      }
    return means_over_squares(pixels, width, height, bin);
  }

 private:
  static constexpr float kBrightest = 1e9F;
  std::size_t bin_;
  Eigen::Index width_, height_;
};

namespace detail {

// Blurs a lines x length matrix (column-major) along its rows and returns its transpose.
inline Eigen::VectorXf blurred_and_turned(const Eigen::VectorXf& pixels, Eigen::Index lines, Eigen::Index length,
                                          double sigma) {
  const auto reach = static_cast<Eigen::Index>(std::ceil(3 * sigma));
  Eigen::VectorXf weights(2 * reach + 1);
  for (Eigen::Index i = -reach; i <= reach; ++i)
    weights[i + reach] = static_cast<float>(std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma)));
  weights /= weights.sum();
  const Eigen::Map<const Eigen::MatrixXf> in(pixels.data(), lines, length);
  Eigen::MatrixXf out = Eigen::MatrixXf::Zero(lines, length);
  for (Eigen::Index x = 0; x < length; ++x)
    for (Eigen::Index k = std::max(-reach, -x); k <= std::min(reach, length - 1 - x); ++k)
      out.col(x) += weights[k + reach] * in.col(x + k);
  const Eigen::MatrixXf turned = out.transpose();
  return Eigen::Map<const Eigen::VectorXf>(turned.data(), turned.size());
}

}  // namespace detail

// Gaussian blur with standard deviation `sigma` pixels, cut off at 3 sigma. Pixels beyond the edge count as 0.
inline Eigen::VectorXf blurred(const Eigen::VectorXf& pixels, Eigen::Index width, Eigen::Index height, double sigma) {
  if (!(sigma > 0)) return pixels;
  const Eigen::VectorXf down = detail::blurred_and_turned(pixels, width, height, sigma);
  return detail::blurred_and_turned(down, height, width, sigma);
}

}  // namespace least_squares
