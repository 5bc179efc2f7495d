// Counter-based random numbers: Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC 2011) and
// distributions that give the same values with every compiler and standard library.
//
// What it is for: anything that must be a pure function of a seed. Use it instead of <random>,
// whose distributions differ between libraries.
#ifndef RELIGN_RANDOM_HPP
#define RELIGN_RANDOM_HPP

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <relign/philox.hpp>

namespace relign {

// One Philox4x32-10 block: 128 random bits from a 128-bit counter and a 64-bit key.
inline std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  std::uint32_t words[4] = {counter[0], counter[1], counter[2], counter[3]};
  philox_rounds(words, key[0], key[1]);
  return {words[0], words[1], words[2], words[3]};
}

// Natural logarithm of a positive, normal double, within 2 units in the last place; the same bits with
// every C library, which std::log does not promise. x = m 2^e with m in [sqrt(1/2), sqrt(2)), and
// log m = 2 artanh((m - 1) / (m + 1)) by its series.
inline double portable_log(double x) {
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);  // exact, in [0.5, 1)
  if (mantissa < 0.70710678118654752) {
    mantissa *= 2;
    --exponent;
  }
  const double s = (mantissa - 1) / (mantissa + 1);
  const double s2 = s * s;  // at most 0.0295
  double series = 0;
  for (int term = 25; term >= 1; term -= 2) series = series * s2 + 1.0 / term;
  return 2 * s * series + exponent * 0.69314718055994531;
}

// A stream of random numbers: (seed, stream) names it, and draws come in order from counter 0.
// Two streams of one seed are independent; copying a Random copies its place in the stream.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : seed_(seed), stream_(stream) {}

  // 32 random bits.
  std::uint32_t bits() {
    if (used_ == 4) {
      block_ = philox4x32({static_cast<std::uint32_t>(counter_), static_cast<std::uint32_t>(counter_ >> 32),
                           static_cast<std::uint32_t>(stream_), static_cast<std::uint32_t>(stream_ >> 32)},
                          {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
      ++counter_;
      used_ = 0;
    }
    return block_[used_++];
  }

  std::uint64_t bits64() {
    const std::uint64_t high = bits();
    return high << 32 | bits();
  }

  // Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(bits64() >> 11) * 0x1p-53; }

  double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }

  // Standard normal, by the polar method of Marsaglia.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    while (true) {
      const double u = 2 * uniform() - 1;
      const double v = 2 * uniform() - 1;
      const double s = u * u + v * v;
      if (s >= 1 || s == 0) continue;
      const double scale = std::sqrt(-2 * portable_log(s) / s);
      spare_ = v * scale;
      has_spare_ = true;
      return u * scale;
    }
  }

  // Uniform integer in [0, n), n > 0, without bias.
  std::uint64_t below(std::uint64_t n) {
    const std::uint64_t reject = (0 - n) % n;
    std::uint64_t draw = bits64();
    while (draw < reject) draw = bits64();
    return draw % n;
  }

 private:
  std::uint64_t seed_;
  std::uint64_t stream_;
  std::uint64_t counter_ = 0;
  std::array<std::uint32_t, 4> block_{};
  std::size_t used_ = 4;
  bool has_spare_ = false;
  double spare_ = 0;
};

}  // namespace relign

#endif  // RELIGN_RANDOM_HPP
