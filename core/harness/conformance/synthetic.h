// Synthetic data for checks: a scene's description, and an image that gets sharper as the merit improves.
#pragma once

#include <cstdint>
#include <string>

namespace relign::conformance {

constexpr std::uint32_t kPictureSide = 40;  // pixels

// A scene description with this many axes, images of kPictureSide and the elements L1 to L4.
std::string synthetic_scene(unsigned axes);

// Paints a slanted edge from dark to bright, suitable for every measure. blur: 0 (sharp) to 1; other values count as 1.
void paint_edge(double blur, float* pixels);

}  // namespace relign::conformance
