#include "imaging/read_out.h"

#include <algorithm>
#include <cmath>

namespace relign::imaging {

ReadOut read_out_of(const Electronics& electronics, ShotNoise shot_noise) {
  return {electronics.full_well_electrons / electronics.saturation,
          electronics.read_noise_electrons * electronics.read_noise_electrons,
          electronics.full_well_electrons,
          electronics.saturation,
          electronics.bits > 0 ? std::ldexp(1.0, electronics.bits) - 1 : 0,
          shot_noise == ShotNoise::added ? 1 : 0,
          1};
}

void read_out(const Electronics& electronics, ShotNoise shot_noise, std::uint64_t seed, int first, int count,
              float* pixels, optics::RayBlock& space) {
  const ReadOut levels = read_out_of(electronics, shot_noise);
  std::uint32_t number[optics::kBlockRays], zero[optics::kBlockRays] = {};
  for (int from = 0; from < count; from += optics::kBlockRays) {
    const int here = std::min(optics::kBlockRays, count - from);
    for (int i = 0; i < optics::kBlockRays; ++i) number[i] = static_cast<std::uint32_t>(first + from + i);
    optics::block_kernels().philox(space, number, zero, kElectronics, static_cast<std::uint32_t>(seed),
                                   static_cast<std::uint32_t>(seed >> 32), (here + 15) / 16 * 16);
    for (int i = 0; i < here; ++i)
      pixels[from + i] = read_out_pixel(levels, pixels[from + i],
                                        sum_of_bytes({{space.u0[i], space.u1[i], space.u2[i], space.u3[i]}}));
  }
}

}  // namespace relign::imaging
