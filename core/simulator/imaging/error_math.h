// Elementary functions for loops over pixels: float, branch-free, sums and products only, so that loops vectorise and
// bits are the same on every machine. Internal to imaging.
#pragma once

#include <bit>
#include <cstdint>

namespace relign::imaging {

// Of a positive normal number, within 3e-7.
inline float log2_of(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  const std::int32_t exponent = (bits - 0x3f3504f3) >> 23;  // mantissa from sqrt(1/2) to sqrt(2)
  const auto mantissa = std::bit_cast<float>(bits - exponent * (1 << 23));
  const float s = (mantissa - 1) / (mantissa + 1), s2 = s * s;
  return static_cast<float>(exponent) +
         s * (2.88539008F + s2 * (0.961796694F + s2 * (0.577078016F + s2 * 0.412198583F)));
}

// 2 to the x for |x| <= 120, within 4e-7 of the value; outside, the value at that limit.
inline float exp2_of(float x) {
  x = x < -120 ? -120.0F : x;
  x = x > 120 ? 120.0F : x;
  const std::int32_t whole = static_cast<std::int32_t>(x + 128.5F) - 128;
  const float f = x - static_cast<float>(whole);
  const float series =
      1 +
      f * (0.693147181F + f * (0.240226507F + f * (0.0555041087F +
                                                   f * (0.00961812911F + f * (0.00133335581F + f * 0.000154035304F)))));
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(series) + whole * (1 << 23));
}

}  // namespace relign::imaging
