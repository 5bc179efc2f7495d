// Made up for checks: a scene's description, and a picture that gets sharper as an algorithm gets better.
#pragma once

#include <cstdint>
#include <string>

namespace relign::conformance {

constexpr std::uint32_t kPictureSide = 40;  // pixels

// A scene description with this many axes, images of kPictureSide and the elements L1 to L4.
std::string synthetic_scene(unsigned axes);

// A leaning edge from dark to bright, wide enough for every measure. blur: 0 (sharp) to 1; all else is 1.
void paint_edge(double blur, float* pixels);

}  // namespace relign::conformance
