// Sensor electronics: converts irradiance to electrons with noise and full well, and to grey values.
#pragma once

#include <cstdint>

#include "imaging/pixel_steps.h"
#include "imaging/sensor.h"
#include "optics/ray_block.h"

namespace relign::imaging {

enum class ShotNoise {
  sampled,  // already in the image: samplers whose rays are drawn like photons
  added     // the image is (nearly) an expectation
};

ReadOut read_out_of(const Electronics& electronics, ShotNoise shot_noise);

// In place, for pixels `first` to first + count of a frame (row by row); values stay irradiances.
//
// electrons = irradiance / saturation * full well; noise of variance electrons (shot noise, if added) + read noise
// squared; cut at 0 and the full well; rounded to 2^bits steps. The noise is the sum of 16 uniform bytes, scaled:
// normal but for tails that end at 6.9 standard deviations, and the same bits everywhere. A pure function of (values,
// seed).
void read_out(const Electronics& electronics, ShotNoise shot_noise, std::uint64_t seed, int first, int count,
              float* pixels, optics::RayBlock& space);

}  // namespace relign::imaging
