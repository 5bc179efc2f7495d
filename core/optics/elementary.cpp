#include "optics/elementary.h"

#include <cmath>

namespace relign::optics {

SineCosine sine_cosine_of_degrees(double degrees) {
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

}  // namespace relign::optics
