// Elementary functions whose bits do not depend on the C library, and pi.
#pragma once

#include <relign/portable_math.hpp>

#include "optics/pi.h"

namespace relign::optics {

using relign::SineCosine;

inline double square(double value) { return value * value; }

// Sine and cosine of an angle in degrees, |angle| <= 360, within 3e-16. Not inline, so that the linker never picks a
// copy that was compiled for a newer instruction set.
SineCosine sine_cosine_of_degrees(double degrees);

}  // namespace relign::optics
