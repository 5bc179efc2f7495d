// A lens with a closed-form image, for tests: five blobs that move, widen, turn and change their balance.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <relign/random.hpp>
#include <vector>

namespace toy {

constexpr int kSide = 48;
constexpr double kReach = 30;  // image shift of the first two axes over their travel, in pixels

// Axes: right, down, width, turn, balance; further axes have no effect.
inline std::vector<float> paint(const std::vector<double>& pose) {
  double away[5] = {};
  for (std::size_t axis = 0; axis < pose.size() && axis < 5; ++axis) away[axis] = pose[axis] - 0.5;
  const double width = 2.5 * std::exp(1.5 * away[2]);
  std::vector<float> pixels(kSide * kSide);
  for (int blob = 0; blob < 5; ++blob) {
    const double angle = 1.3 * blob + away[3], radius = blob == 0 ? 0 : 9;
    const double x = 0.5 * kSide + radius * std::cos(angle) + kReach * away[0];
    const double y = 0.5 * kSide + radius * std::sin(angle) + kReach * away[1];
    const double light = (blob % 2 ? 1 + away[4] : 1) * 6 / (width * width);
    for (int row = 0; row < kSide; ++row)
      for (int column = 0; column < kSide; ++column) {
        const double square = std::pow(column - x, 2) + std::pow(row - y, 2);
        pixels[static_cast<std::size_t>(row * kSide + column)] +=
            static_cast<float>(light * std::exp(-0.5 * square / (width * width)));
      }
  }
  return pixels;
}

inline void add_noise(double deviation, std::uint64_t seed, std::vector<float>& pixels) {
  relign::Random random(seed);
  for (float& pixel : pixels) pixel += static_cast<float>(deviation * random.normal());
}

}  // namespace toy
