// Checks that images miss no light: compares random pixels with rays in all directions.
//
// Images trace only directions found to pass the lens, from pixels found to be lit by the target (pupil_tiles.h). If
// either search missed something, an image would be too dark somewhere without any other sign. So every new scene and
// every mounted lens is checked first, and a disagreement is an error instead of an image.
#pragma once

#include <cstdint>
#include <vector>

#include "imaging/certificate_steps.h"
#include "imaging/mounted_lens.h"
#include "imaging/pupil_tiles.h"
#include "optics/block_tracer.h"

namespace relign::imaging {

struct CertificateRays {
  int pixels_a_tile = 1;  // 0: `pixels` of the whole image
  int pixels = 0;
  int rays = 1024;  // per pixel, uniform on the disc of direction cosines; rounded up to whole blocks
};

// Of the first image of a mounted lens.
inline constexpr CertificateRays kFirstImageRays{0, 24, 512};
inline constexpr std::uint64_t kFirstImageSeed = 0x6d6f756e74;

struct CheckedPixel {
  int column = 0, row = 0;
  std::size_t tile = 0;  // its place in the tiles
  int arrived = 0;       // rays that reach the target
  int missing = 0;       // of these, outside the directions that images sample
};

std::vector<CheckedPixel> pixels_to_check(const std::vector<PixelBox>& tiles, const CertificateRays& rays,
                                          std::uint64_t seed);
// Throws Error(internal), as certify() does. Returns how many rays arrived.
int expect_all_light(const SceneFile& scene, const std::vector<CheckedPixel>& pixels, double wavelength_nm = 0);

inline constexpr double kMaxMissing = 0.002;

// Checks the fitted tiles of a pose. Rays from random points of random pixels in any direction that reach the target
// must be in their tile's region, except for a few at its rim: up to kMaxMissing of all rays, with a statistical
// margin, and up to half of those of one pixel. Throws Error(internal) with the position on the sensor, and with the
// wavelength unless it is 0. `search`: what the design passes (certificate_steps.h). Returns how many rays arrived.
int certify(const SceneFile& scene, const PupilTiles& tiles, const optics::BackwardPath& path,
            const std::vector<optics::Op>& ops, const optics::PupilSearch& search, const optics::Motion& lens_to_world,
            const optics::BlockTracer* tracer, const CertificateRays& rays, std::uint64_t seed, Parallel& parallel,
            double wavelength_nm = 0);

}  // namespace relign::imaging
