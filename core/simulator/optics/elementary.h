// Elementary functions whose bits do not depend on the C library, and pi.
#pragma once

#include <numbers>
#include <relign/portable_math.hpp>

namespace relign::optics {

using relign::SineCosine;

inline constexpr double kPi = std::numbers::pi;

inline double square(double value) { return value * value; }

// Sine and cosine of an angle in degrees, |angle| <= 360, within 3e-16. Not inline, so that the linker never picks a
// copy that was compiled for a newer instruction set.
SineCosine sine_cosine_of_degrees(double degrees);

}  // namespace relign::optics
