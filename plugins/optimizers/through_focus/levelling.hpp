// Focus and tilts from captures on both sides of the focus.
#ifndef THROUGH_FOCUS_LEVELLING_HPP
#define THROUGH_FOCUS_LEVELLING_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "sharpness.hpp"

namespace through_focus {

// The minimum of a parabola fitted to the mismatch of the captures along an axis, within their range.
inline std::optional<double> lowest(const std::vector<Capture>& captures, std::size_t focus_axis, double around) {
  std::array<std::array<double, 4>, 3> rows{};
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (const Capture& capture : captures) {
    if (!capture.metrics.sound) continue;
    const double z = capture.pose[focus_axis] - around;
    lower = std::min(lower, z);
    upper = std::max(upper, z);
    const double powers[3] = {1, z, z * z};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) rows[i][k] += powers[i] * powers[k];
      rows[i][3] += powers[i] * capture.metrics.mismatch;
    }
  }
  double curve[3];
  if (!solve3(rows, curve) || !(curve[2] > 0)) return std::nullopt;
  return around + std::clamp(-0.5 * curve[1] / curve[2], lower, upper);
}

// Difference of the sharpness slopes above and below focus, per unit of focus. It is proportional to the tilt of the
// plane of best focus; uneven blur of the lens itself is the same on both sides and cancels.
struct Evenness {
  double tilt[2] = {0, 0};
  double slope[2] = {0, 0};
  double variance[2] = {0, 0};
};

inline Evenness evenness_between(const Metrics& below, const Metrics& above, double distance) {
  Evenness evenness;
  for (std::size_t side = 0; side < 2; ++side) {
    evenness.slope[side] = (above.slope[side] - below.slope[side]) / distance;
    evenness.variance[side] = (above.slope_variance[side] + below.slope_variance[side]) / (distance * distance);
  }
  return evenness;
}

using Tilts = std::array<std::optional<double>, 2>;

// slope = offset + gain * tilt for one direction in the image, by least squares.
struct Line {
  double offset = 0;
  double gain[2] = {0, 0};
  double significance[2] = {0, 0};  // squared gain over its variance
};

inline std::optional<Line> fit_line(const std::vector<Evenness>& measured, std::size_t side, std::size_t tilts) {
  std::array<std::array<double, 4>, 3> rows{};
  double variance = 0;
  for (const Evenness& one : measured) {
    const double terms[3] = {1, one.tilt[0] - measured.front().tilt[0], one.tilt[1] - measured.front().tilt[1]};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) rows[i][k] += terms[i] * terms[k];
      rows[i][3] += terms[i] * one.slope[side];
    }
    variance += one.variance[side] / static_cast<double>(measured.size());
  }
  for (std::size_t absent = tilts; absent < 2; ++absent) rows[absent + 1][absent + 1] += 1;
  double solution[3];
  if (!solve3(rows, solution)) return std::nullopt;
  Line line;
  line.offset = solution[0];
  for (std::size_t tilt = 0; tilt < tilts; ++tilt) {
    auto unit = rows;
    for (std::size_t i = 0; i < 3; ++i) unit[i][3] = i == tilt + 1 ? 1 : 0;
    double column[3];
    if (!solve3(unit, column)) return std::nullopt;
    line.gain[tilt] = solution[tilt + 1];
    line.significance[tilt] = line.gain[tilt] * line.gain[tilt] / (variance * column[tilt + 1]);
  }
  return line;
}

// The tilts at which both sides of the focus are equally blurred. A tilt without significant effect is omitted; the
// others are limited to `reach` from the first measurement.
inline Tilts level_tilts(const std::vector<Evenness>& measured, std::size_t tilts, double reach) {
  constexpr double kSignificant = 4;  // two standard deviations, squared
  Tilts level;
  Line lines[2];
  for (std::size_t side = 0; side < 2; ++side) {
    const auto line = fit_line(measured, side, tilts);
    if (!line) return level;
    lines[side] = *line;
  }
  bool works[2] = {false, false};
  double square[2][2] = {{0, 0}, {0, 0}}, right[2] = {0, 0};  // of the least squares problem gain * tilt = -offset
  for (std::size_t i = 0; i < tilts; ++i) works[i] = lines[0].significance[i] + lines[1].significance[i] > kSignificant;
  for (std::size_t i = 0; i < 2; ++i)
    for (const Line& line : lines) {
      if (!works[i]) continue;
      right[i] -= line.gain[i] * line.offset;
      for (std::size_t k = 0; k < 2; ++k) square[i][k] += works[k] ? line.gain[i] * line.gain[k] : 0;
    }
  for (std::size_t i = 0; i < 2; ++i)
    if (!works[i]) square[i][i] = 1;
  const double determinant = square[0][0] * square[1][1] - square[0][1] * square[1][0];
  if (!(determinant > 0.01 * square[0][0] * square[1][1])) return level;  // the tilts have the same effect
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t other = 1 - i;
    const double move = (right[i] * square[other][other] - right[other] * square[i][other]) / determinant;
    if (works[i]) level[i] = measured.front().tilt[i] + std::clamp(move, -reach, reach);
  }
  return level;
}

}  // namespace through_focus

#endif  // THROUGH_FOCUS_LEVELLING_HPP
