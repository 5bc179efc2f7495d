// Elementary functions whose bits do not depend on the C library.
#pragma once

#include <relign/portable_math.hpp>

namespace relign::optics {

using relign::SineCosine;

// Sine and cosine of an angle in degrees, |angle| <= 360, within 3e-16. Not inline: a copy that a file compiled for a
// newer instruction set emits must never become everybody's.
SineCosine sine_cosine_of_degrees(double degrees);

}  // namespace relign::optics
