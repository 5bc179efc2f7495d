// Charts of slightly rotated dark squares, painted analytically with a Gaussian blur, and their fields.
#pragma once

#include <cmath>
#include <numbers>
#include <relign/random.hpp>
#include <string>

#include "images/edge_fields.h"

namespace relign::images::painted_chart {

constexpr double kSpacing = 120, kSide = 60, kTurn_deg = 5;
constexpr double kDegree = std::numbers::pi / 180;

// Dark squares on a grid around (x0, y0).
inline Image chart(double x0, double y0, double sigma, double white = 0.9, double noise = 0) {
  Image image(480, 360);
  Random random(3);
  const double cosine = std::cos(kTurn_deg * kDegree), sine = std::sin(kTurn_deg * kDegree);
  const auto within = [&](double along) {
    const double scale = sigma * std::sqrt(2.0);
    return 0.5 * (std::erf((along + kSide / 2) / scale) - std::erf((along - kSide / 2) / scale));
  };
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const double dx = static_cast<double>(x) - x0, dy = static_cast<double>(y) - y0;
      const double u = dx - kSpacing * std::round(dx / kSpacing), v = dy - kSpacing * std::round(dy / kSpacing);
      const double dark = within(cosine * u + sine * v) * within(cosine * v - sine * u);
      image.at(x, y) = static_cast<float>(white * (1 - 0.9 * dark) + noise * random.normal());
    }
  return image;
}

// The regions around the left and the upper edge of the square at (x, y).
inline EdgeField field_at(const char* name, double x, double y) {
  const auto centred = [](double cx, double cy, std::size_t width, std::size_t height) {
    return Region{static_cast<std::size_t>(cx) - width / 2, static_cast<std::size_t>(cy) - height / 2, width, height};
  };
  return {name, Mark{x, y, kSide}, centred(x - kSide / 2, y, 50, 36), centred(x, y - kSide / 2, 36, 50)};
}

inline const EdgeFields& nine_fields() {
  static const EdgeFields fields = [] {
    EdgeFields made = {field_at("centre", 240, 180)};
    for (int row = -1; row <= 1; ++row)
      for (int column = -1; column <= 1; ++column)
        if (row != 0 || column != 0)
          made.push_back(field_at(("r" + std::to_string(row) + "c" + std::to_string(column)).c_str(),
                                  240 + kSpacing * column, 180 + kSpacing * row));
    return made;
  }();
  return fields;
}

inline double gaussian(double sigma, double f) { return std::exp(-2 * std::pow(std::numbers::pi * sigma * f, 2)); }

}  // namespace relign::images::painted_chart
