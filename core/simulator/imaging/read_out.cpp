#include "imaging/read_out.h"

#include <algorithm>
#include <cmath>

namespace relign::imaging {
namespace {

// Sum of the four bytes of a word.
std::uint32_t byte_sum(std::uint32_t word) {
  const std::uint32_t pairs = (word & 0x00ff00ffU) + (word >> 8 & 0x00ff00ffU);
  return (pairs & 0xffffU) + (pairs >> 16);
}

constexpr double kMeanOfBytes = 16 * 127.5;
constexpr double kVarianceOfBytes = 16 * (256.0 * 256.0 - 1) / 12;
constexpr std::uint32_t kStream = 16;  // of the frame's seed; rays use the streams below

}  // namespace

void read_out(const Electronics& electronics, ShotNoise shot_noise, std::uint64_t seed, int first, int count,
              float* pixels, optics::RayBlock& space) {
  const double electrons_per_unit = electronics.full_well_electrons / electronics.saturation;
  const double read_variance = electronics.read_noise_electrons * electronics.read_noise_electrons;
  const double steps = electronics.bits > 0 ? std::ldexp(1.0, electronics.bits) - 1 : 0;
  const double unit = 1 / std::sqrt(kVarianceOfBytes);
  std::uint32_t number[optics::kBlockRays], zero[optics::kBlockRays] = {};
  for (int from = 0; from < count; from += optics::kBlockRays) {
    const int here = std::min(optics::kBlockRays, count - from);
    for (int i = 0; i < optics::kBlockRays; ++i) number[i] = static_cast<std::uint32_t>(first + from + i);
    optics::block_kernels().philox(space, number, zero, kStream, static_cast<std::uint32_t>(seed),
                                   static_cast<std::uint32_t>(seed >> 32), (here + 15) / 16 * 16);
    for (int i = 0; i < here; ++i) {
      float& pixel = pixels[from + i];
      double electrons = static_cast<double>(pixel) * electrons_per_unit;
      const double variance = read_variance + (shot_noise == ShotNoise::added ? electrons : 0);
      const auto bytes = byte_sum(space.u0[i]) + byte_sum(space.u1[i]) + byte_sum(space.u2[i]) + byte_sum(space.u3[i]);
      electrons += (static_cast<double>(bytes) - kMeanOfBytes) * unit * std::sqrt(variance);
      double filled = std::clamp(electrons / electronics.full_well_electrons, 0.0, 1.0);
      if (steps > 0) filled = std::floor(filled * steps + 0.5) / steps;
      pixel = static_cast<float>(filled * electronics.saturation);
    }
  }
}

}  // namespace relign::imaging
