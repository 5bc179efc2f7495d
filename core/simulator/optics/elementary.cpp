#include "optics/elementary.h"

namespace relign::optics {

SineCosine sine_cosine_of_degrees(double degrees) { return portable_sine_cosine(degrees); }

}  // namespace relign::optics
