// Shift, sharpness and slope of the sharpness of a capture, by comparison with the gradients of the reference image.
#ifndef THROUGH_FOCUS_SHARPNESS_HPP
#define THROUGH_FOCUS_SHARPNESS_HPP

#include <array>
#include <cmath>
#include <cstddef>
#include <relign/plugin.hpp>
#include <utility>
#include <vector>

namespace through_focus {

// Measurements on one capture.
struct Metrics {
  double shift[2] = {0, 0};  // pixels: right, down
  bool placed = false;       // the shift is known
  double rotation = 0;       // degrees clockwise; NaN if unknown
  double difference = 0;     // mean squared difference from the reference image, smoothed
  double mismatch = 0;       // the same with the reference shifted by `shift`
  double sharpness = 0;      // 1: edges as steep as in the reference
  double slope[2] = {0, 0};  // change of the sharpness per half image: right, down
  double slope_variance[2] = {0, 0};
  bool sound = false;  // all values except the rotation are finite
};

struct Capture {
  relign::Pose pose;
  Metrics metrics;
};

// Solves a symmetric 3 x 3 system by elimination. Returns false if it is singular.
inline bool solve3(std::array<std::array<double, 4>, 3> rows, double* solution) {
  for (int column = 0; column < 3; ++column) {
    int pivot = column;
    for (int row = column + 1; row < 3; ++row)
      if (std::fabs(rows[row][column]) > std::fabs(rows[pivot][column])) pivot = row;
    if (!(std::fabs(rows[pivot][column]) > 1e-30) || !std::isfinite(rows[pivot][column])) return false;
    std::swap(rows[pivot], rows[column]);
    for (int row = 0; row < 3; ++row) {
      if (row == column) continue;
      const double share = rows[row][column] / rows[column][column];
      for (int k = column; k < 4; ++k) rows[row][k] -= share * rows[column][k];
    }
  }
  for (int row = 0; row < 3; ++row) {
    solution[row] = rows[row][3] / rows[row][row];
    if (!std::isfinite(solution[row])) return false;
  }
  return true;
}

// The reference shifted by a number of pixels, with bilinear interpolation; border pixels are repeated.
class Shifted {
 public:
  Shifted(const relign::ImageView& image, double right, double down)
      : image_(image),
        column_(std::floor(right)),
        row_(std::floor(down)),
        right_(right - column_),
        down_(down - row_) {}
  double at(std::size_t x, std::size_t y) const {
    const auto left = static_cast<double>(x) - column_, top = static_cast<double>(y) - row_;
    return (1 - down_) * ((1 - right_) * pixel(left, top) + right_ * pixel(left - 1, top)) +
           down_ * ((1 - right_) * pixel(left, top - 1) + right_ * pixel(left - 1, top - 1));
  }

 private:
  double pixel(double x, double y) const {
    const auto last_x = static_cast<double>(image_.width() - 1), last_y = static_cast<double>(image_.height() - 1);
    const auto column = static_cast<std::size_t>(std::fmax(0, std::fmin(last_x, x)));
    const auto row = static_cast<std::size_t>(std::fmax(0, std::fmin(last_y, y)));
    return static_cast<double>(image_.at(column, row));
  }
  const relign::ImageView& image_;
  double column_, row_, right_, down_;
};

// Mean square of a difference image after a 5 x 5 running mean, which removes most of the noise but little of the
// effect of blur.
inline double smooth_square(const std::vector<double>& values, std::size_t width, std::size_t height) {
  constexpr std::size_t kWindow = 5;
  if (width < kWindow || height < kWindow) {
    double sum = 0;
    for (const double value : values) sum += value * value;
    return sum / static_cast<double>(values.size());
  }
  std::vector<double> rows(values.size());
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x + kWindow <= width; ++x)
      for (std::size_t k = 0; k < kWindow; ++k) rows[y * width + x] += values[y * width + x + k];
  double sum = 0;
  for (std::size_t y = 0; y + kWindow <= height; ++y)
    for (std::size_t x = 0; x + kWindow <= width; ++x) {
      double window = 0;
      for (std::size_t k = 0; k < kWindow; ++k) window += rows[(y + k) * width + x];
      sum += window * window;
    }
  return sum /
         static_cast<double>(kWindow * kWindow * kWindow * kWindow * (width - kWindow + 1) * (height - kWindow + 1));
}

// Sharpness at a pixel is the inner product of the gradients of capture and reference over the squared gradient of the
// reference. Noise averages out of it, unlike out of the capture's gradient energy. Fits the plane sharpness + slope *
// position by least squares, weighted by the squared gradient of the reference.
inline Metrics metrics_of(const relign::ImageView& capture, const relign::ImageView& wanted, double right,
                          double down) {
  Metrics metrics;
  if (capture.width() != wanted.width() || capture.height() != wanted.height()) return metrics;
  const std::size_t width = capture.width(), height = capture.height();
  if (width < 3 || height < 3) return metrics;
  metrics.placed = std::isfinite(right) && std::isfinite(down);
  metrics.shift[0] = metrics.placed ? right : 0;
  metrics.shift[1] = metrics.placed ? down : 0;
  const Shifted laid(wanted, metrics.shift[0], metrics.shift[1]);
  std::vector<double> reference(width * height), plain(width * height), moved(width * height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t pixel = y * width + x;
      const auto value = static_cast<double>(capture.at(x, y));
      reference[pixel] = laid.at(x, y);
      plain[pixel] = value - static_cast<double>(wanted.at(x, y));
      moved[pixel] = value - reference[pixel];
    }
  metrics.difference = smooth_square(plain, width, height);
  metrics.mismatch = smooth_square(moved, width, height);

  std::array<std::array<double, 4>, 3> rows{};
  double square = 0;
  const double half_x = 0.5 * static_cast<double>(width - 1), half_y = 0.5 * static_cast<double>(height - 1);
  for (std::size_t y = 1; y + 1 < height; ++y)
    for (std::size_t x = 1; x + 1 < width; ++x) {
      const double* r = &reference[y * width + x];
      const double reference_x = r[1] - r[-1], reference_y = *(r + width) - *(r - width);
      const double capture_x = static_cast<double>(capture.at(x + 1, y)) - static_cast<double>(capture.at(x - 1, y));
      const double capture_y = static_cast<double>(capture.at(x, y + 1)) - static_cast<double>(capture.at(x, y - 1));
      const double weight = reference_x * reference_x + reference_y * reference_y;
      const double product = reference_x * capture_x + reference_y * capture_y;
      square += capture_x * capture_x + capture_y * capture_y;
      const double place[3] = {1, (static_cast<double>(x) - half_x - metrics.shift[0]) / half_x,
                               (static_cast<double>(y) - half_y - metrics.shift[1]) / half_y};
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) rows[i][k] += weight * place[i] * place[k];
        rows[i][3] += product * place[i];
      }
    }
  double plane[3];
  if (solve3(rows, plane)) {
    metrics.sharpness = plane[0];
    metrics.slope[0] = plane[1];
    metrics.slope[1] = plane[2];
    // Residual variance of the fit: noise and deviations from a plane. Neighbouring residuals are mostly negatively
    // correlated, so this is an upper estimate.
    for (std::size_t i = 0; i < 3; ++i) square -= plane[i] * rows[i][3];
    const double variance = std::fmax(0, square) / (2.0 * static_cast<double>((width - 2) * (height - 2)));
    for (std::size_t side = 0; side < 2; ++side) {
      auto unit = rows;
      for (std::size_t i = 0; i < 3; ++i) unit[i][3] = i == side + 1 ? 1 : 0;
      double column[3];
      metrics.slope_variance[side] = solve3(unit, column) ? variance * column[side + 1] : 0;
    }
    metrics.sound = metrics.placed && std::isfinite(metrics.difference) && std::isfinite(metrics.mismatch);
  }
  return metrics;
}

}  // namespace through_focus

#endif  // THROUGH_FOCUS_SHARPNESS_HPP
