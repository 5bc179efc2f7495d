#include "conformance/synthetic.h"

#include <array>
#include <cmath>

#include "base/json_source.h"

namespace relign::conformance {

std::string synthetic_scene(unsigned axes) {
  static const std::array<const char*, 6> names = {"x", "y", "z", "Rx", "Ry", "Rz"};
  Json scene = {{"name", "synthetic"},
                {"summary", "Synthetic, for checks."},
                {"axes", Json::array()},
                {"nominal_pose", Json::array()},
                {"image", {{"width", kPictureSide}, {"height", kPictureSide}, {"white", 1}}},
                {"elements", {"L1", "L2", "L3", "L4"}},
                {"geometry", {{"pivot_z_mm", 0}, {"elements", Json::object()}}}};
  for (int element = 0; element < 4; ++element)
    scene["geometry"]["elements"]["L" + std::to_string(element + 1)] = {{"front_z_mm", 3.0 * element},
                                                                        {"back_z_mm", 3.0 * element + 2}};
  for (unsigned axis = 0; axis < axes; ++axis) {
    const bool shift = axis < 3;
    scene["axes"].push_back({{"name", axis < names.size() ? names.at(axis) : "a" + std::to_string(axis)},
                             {"unit", shift ? "mm" : "deg"},
                             {"lower", shift ? -1.0 : -5.0},
                             {"upper", shift ? 1.0 : 5.0}});
    scene["nominal_pose"].push_back(0.5);
  }
  return scene.dump();
}

void paint_edge(double blur, float* pixels) {
  const double width_px = 0.7 + 6 * (blur >= 0 && blur <= 1 ? blur : 1);
  const double middle = 0.5 * (kPictureSide - 1);
  constexpr double kSlope = 0.12;  // columns per row
  for (std::uint32_t y = 0; y < kPictureSide; ++y)
    for (std::uint32_t x = 0; x < kPictureSide; ++x) {
      const double across = (x - middle) + kSlope * (y - middle);
      pixels[y * kPictureSide + x] = static_cast<float>(0.5 + 0.4 * std::tanh(across / width_px));
    }
}

}  // namespace relign::conformance
