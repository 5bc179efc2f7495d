// NVRTC compiles this header.
#pragma once

namespace relign::optics {

inline constexpr double kPi = 3.141592653589793;

}  // namespace relign::optics
