#include "drawing/colours.h"

#include <algorithm>
#include <cmath>

namespace relign::drawing {

Colour series_colour(std::size_t number) {
  static constexpr Colour kSeries[] = {{0, 114, 178},   {213, 94, 0},   {0, 158, 115},
                                       {204, 121, 167}, {86, 180, 233}, {230, 159, 0}};
  return kSeries[number % std::size(kSeries)];
}

Colour map_colour(double share) {
  static constexpr Colour kTable[] = {{0x44, 0x01, 0x54}, {0x48, 0x24, 0x75}, {0x41, 0x44, 0x87}, {0x35, 0x5f, 0x8d},
                                      {0x2a, 0x78, 0x8e}, {0x21, 0x91, 0x8c}, {0x22, 0xa8, 0x84}, {0x44, 0xbf, 0x70},
                                      {0x7a, 0xd1, 0x51}, {0xbd, 0xdf, 0x26}, {0xfd, 0xe7, 0x25}};
  constexpr int kLast = static_cast<int>(std::size(kTable)) - 1;
  const double place = std::clamp(share, 0.0, 1.0) * kLast;
  const int below = std::min(static_cast<int>(place), kLast - 1);
  const double part = place - below;
  const auto between = [&](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + part * (b - a)));
  };
  const Colour &a = kTable[below], &b = kTable[below + 1];
  return {between(a.red, b.red), between(a.green, b.green), between(a.blue, b.blue)};
}

}  // namespace relign::drawing
