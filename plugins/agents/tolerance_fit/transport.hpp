// Shifts images across the sensor and estimates shifts: the main effect of a small move of the lens.
#pragma once

#include <algorithm>
#include <cmath>

#include "level.hpp"

namespace tolerance_fit {

struct Shift {
  double x = 0, y = 0;  // columns to the right, rows down
};

namespace detail {

// Catmull-Rom weights of the pixels -1, 0, 1, 2 around a position `part` after pixel 0.
inline void cubic_weights(double part, double (&weights)[4]) {
  const double t = part, t2 = t * t, t3 = t2 * t;
  weights[0] = 0.5 * (-t3 + 2 * t2 - t);
  weights[1] = 0.5 * (3 * t3 - 5 * t2 + 2);
  weights[2] = 0.5 * (-3 * t3 + 4 * t2 + t);
  weights[3] = 0.5 * (t3 - t2);
}

using Picture = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Shifts down by `by` rows; pixels beyond the border count as 0.
inline Picture moved_down(const Picture& from, double by) {
  Picture to = Picture::Zero(from.rows(), from.cols());
  const auto whole = static_cast<Eigen::Index>(std::floor(-by));
  double weights[4];
  cubic_weights(-by - static_cast<double>(whole), weights);
  for (Eigen::Index row = 0; row < from.rows(); ++row)
    for (Eigen::Index tap = 0; tap < 4; ++tap) {
      const Eigen::Index source = row + whole + tap - 1;
      if (source >= 0 && source < from.rows()) to.row(row) += weights[tap] * from.row(source);
    }
  return to;
}

}  // namespace detail

inline Vector moved(const Vector& picture, Eigen::Index width, Shift shift) {
  const Eigen::Map<const detail::Picture> from(picture.data(), picture.size() / width, width);
  const detail::Picture down = shift.y == 0 ? detail::Picture(from) : detail::moved_down(from, shift.y);
  if (shift.x == 0) return Eigen::Map<const Vector>(down.data(), down.size());
  const detail::Picture across = detail::moved_down(down.transpose(), shift.x).transpose();
  return Eigen::Map<const Vector>(across.data(), across.size());
}

// The shift that maps `from` onto `to`, by Gauss-Newton from 0; for shifts of a few pixels.
inline Shift shift_between(const Vector& from, const Vector& to, const Vector& weight, Eigen::Index width) {
  constexpr double kFarthest = 10;  // pixels
  Shift shift;
  for (int step = 0; step < 4; ++step) {
    const Vector here = moved(from, width, shift);
    const Vector by_x = (moved(here, width, {0.5, 0}) - moved(here, width, {-0.5, 0})).cwiseProduct(weight);
    const Vector by_y = (moved(here, width, {0, 0.5}) - moved(here, width, {0, -0.5})).cwiseProduct(weight);
    const Vector wanted = (to - here).cwiseProduct(weight);
    const double xx = by_x.squaredNorm(), yy = by_y.squaredNorm(), xy = by_x.dot(by_y);
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 1e-12 * xx * yy)) break;
    const double x = (yy * by_x.dot(wanted) - xy * by_y.dot(wanted)) / determinant;
    const double y = (xx * by_y.dot(wanted) - xy * by_x.dot(wanted)) / determinant;
    shift.x = std::clamp(shift.x + x, -kFarthest, kFarthest);
    shift.y = std::clamp(shift.y + y, -kFarthest, kFarthest);
    if (std::fabs(x) + std::fabs(y) < 0.01) break;
  }
  return shift;
}

}  // namespace tolerance_fit
