// Elementary functions whose bits do not depend on the C library: sums, products and exact scalings alone.
//
// What it is for: plugins whose images or draws are the same on every machine ("reproducible": "anywhere").
// std::exp, std::sin and std::cos differ in the last place between C libraries. portable_log is in random.hpp.
#ifndef RELIGN_PORTABLE_MATH_HPP
#define RELIGN_PORTABLE_MATH_HPP

#include <cmath>

namespace relign {

struct SineCosine {
  double sine;
  double cosine;
};

// Of an angle in degrees, |angle| <= 360, within 3e-16.
inline SineCosine portable_sine_cosine(double degrees) {
  // Whole quarter turns are taken off in degrees, where that is exact; what is left is at most 45.
  const double quarters = std::floor(degrees / 90 + 0.5);
  const double x = (degrees - 90 * quarters) * 0.017453292519943295;
  const double x2 = x * x;
  double sine = 0, cosine = 0;  // Taylor series, remainder below 1e-17 for |x| <= pi/4
  for (int k = 19; k >= 3; k -= 2) sine = (sine + 1) * -x2 / (k * (k - 1));
  for (int k = 20; k >= 2; k -= 2) cosine = (cosine + 1) * -x2 / (k * (k - 1));
  sine = x * (1 + sine);
  cosine = 1 + cosine;
  switch (static_cast<int>(quarters) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

// e to the x for |x| <= 700, within 3 units in the last place; 0 below that range, infinity above it.
inline double portable_exp(double x) {
  if (x < -700) return 0;
  if (x > 700) return HUGE_VAL;
  if (std::isnan(x)) return x;
  // x = k log 2 + rest, |rest| <= 0.35; log 2 in two parts, the first with trailing zeros: k times it is exact.
  const double k = std::floor(x * 1.4426950408889634 + 0.5);
  const double rest = (x - k * 0x1.62e42feep-1) - k * 1.9082149292705877e-10;
  double series = 1;
  for (int term = 14; term >= 1; --term) series = 1 + series * rest / term;
  return std::ldexp(series, static_cast<int>(k));  // exact
}

}  // namespace relign

#endif  // RELIGN_PORTABLE_MATH_HPP
