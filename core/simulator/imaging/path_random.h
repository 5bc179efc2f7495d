// Random numbers of one light path, from a Philox stream per path, so that no path depends on the length of another.
#pragma once

#include <array>
#include <cstdint>
#include <relign/random.hpp>

namespace relign::imaging {

class PathRandom {
 public:
  // `use` must not be 0, which the block kernels use (ray_block.h): streams must not overlap.
  PathRandom(std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample, std::uint32_t use)
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
        counter_{0, pixel, sample, use} {}

  std::uint32_t word() {
    if (used_ == 4) {
      words_ = philox4x32(counter_, key_);
      ++counter_[0];
      used_ = 0;
    }
    return words_[used_++];
  }
  static double unit(std::uint32_t word) { return static_cast<double>(word) * 0x1p-32; }
  // Uniform in [0, 1).
  double unit() { return unit(word()); }

 private:
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 4> words_{};
  unsigned used_ = 4;
};

}  // namespace relign::imaging
