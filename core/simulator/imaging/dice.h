// Random numbers of one path: a Philox stream of its own, so that no path depends on another's length.
#pragma once

#include <array>
#include <cstdint>
#include <relign/random.hpp>

namespace relign::imaging {

class Dice {
 public:
  // `use` is not 0: block kernels have that one (ray_block.h), and streams must not meet.
  Dice(std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample, std::uint32_t use)
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
