// Elementary functions whose bits do not depend on the C library.
#pragma once

namespace relign::optics {

struct SineCosine {
  double sine;
  double cosine;
};

// Sine and cosine of an angle in degrees, |angle| <= 360, within 3e-16.
SineCosine sine_cosine_of_degrees(double degrees);

}  // namespace relign::optics
