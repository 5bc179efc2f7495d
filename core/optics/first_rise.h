// The first zero of a function whose second derivative is bounded: how rays meet aspheres, in face_shape.cpp and in the
// block kernels' slow path.
#pragma once

#include <cmath>
#include <optional>

namespace relign::optics {

// The first t in [from, to] at which g passes through 0 from below. `most_bent` bounds |g''|: each step goes as far as
// the parabola of that bend leaves no zero behind, so that none is stepped over, and the steps converge as Newton's
// do. g(t, derivative) gives the value and writes the derivative. Empty when there is no such t; a g that only touches
// 0 has none.
template <class Function>
std::optional<double> first_rise(const Function& g, double from, double to, double most_bent) {
  constexpr int kMostSteps = 200;
  constexpr double kRounding = 4e-16;  // of t and of g
  constexpr double kOver = 1e-9;       // to the other side of a zero that leads down
  const double bent = std::fmax(most_bent, 1e-9);
  bool below = false;
  double t = from;
  for (int k = 0; k < kMostSteps && t <= to; ++k) {
    double slope = 0;
    const double value = g(t, slope);
    if (value < 0 || (value == 0 && slope > 0)) {
      below = true;
      // No earlier than where value + slope h + bent h^2 / 2 is 0.
      const double root = std::sqrt(slope * slope - 2 * bent * value);
      const double step = slope > 0 ? -2 * value / (slope + root) : (root - slope) / bent;
      t += step;
      if (slope > 0 && step <= kRounding * (1 + std::fabs(t))) return t;
    } else {
      if (below) return slope > 0 ? t - value / slope : t;  // the last step ended on the zero, but for rounding
      // On to where value + slope h - bent h^2 / 2 is 0, and a little farther.
      const double root = std::sqrt(slope * slope + 2 * bent * value);
      const double step = slope < 0 ? 2 * value / (root - slope) : (slope + root) / bent;
      t += std::fmax(step, kOver);
    }
  }
  return std::nullopt;
}

}  // namespace relign::optics
