// Elementary functions for loops over pixels and for GPU kernels: branch-free, sums and products only, so that loops
// vectorise and bits are the same on every machine. No library functions: NVRTC compiles this header. Internal to
// imaging.
#pragma once

#include <relign/philox.hpp>

namespace relign::imaging {

#if defined(__CUDACC_RTC__)
RELIGN_DEVICE std::int32_t bits_of(float x) { return __float_as_int(x); }
RELIGN_DEVICE float float_of(std::int32_t bits) { return __int_as_float(bits); }
RELIGN_DEVICE double round_down(double x) { return floor(x); }
#else
RELIGN_DEVICE std::int32_t bits_of(float x) { return __builtin_bit_cast(std::int32_t, x); }
RELIGN_DEVICE float float_of(std::int32_t bits) { return __builtin_bit_cast(float, bits); }
RELIGN_DEVICE double round_down(double x) { return __builtin_floor(x); }
#endif

// Of a positive normal number, within 3e-7.
RELIGN_DEVICE float log2_of(float x) {
  const std::int32_t bits = bits_of(x);
  const std::int32_t exponent = (bits - 0x3f3504f3) >> 23;  // mantissa from sqrt(1/2) to sqrt(2)
  const float mantissa = float_of(bits - exponent * (1 << 23));
  const float s = (mantissa - 1) / (mantissa + 1), s2 = s * s;
  return static_cast<float>(exponent) +
         s * (2.88539008F + s2 * (0.961796694F + s2 * (0.577078016F + s2 * 0.412198583F)));
}

// 2 to the x for |x| <= 120, within 4e-7 of the value; outside, the value at that limit.
RELIGN_DEVICE float exp2_of(float x) {
  x = x < -120 ? -120.0F : x;
  x = x > 120 ? 120.0F : x;
  const std::int32_t whole = static_cast<std::int32_t>(x + 128.5F) - 128;
  const float f = x - static_cast<float>(whole);
  const float series =
      1 +
      f * (0.693147181F + f * (0.240226507F + f * (0.0555041087F +
                                                   f * (0.00961812911F + f * (0.00133335581F + f * 0.000154035304F)))));
  return float_of(bits_of(series) + whole * (1 << 23));
}

}  // namespace relign::imaging
