// A check that images hold all light: random pixels are held against rays in all directions.
//
// Images trace only directions that were found to pass the lens, from pixels that were found to see the target
// (pupil_tiles.h). Should either have been missed, an image would be too dark somewhere and look like any other. So
// whoever opens a scene or mounts a lens has this done first, and a disagreement is an error instead of an image.
#pragma once

#include <cstdint>
#include <vector>

#include "imaging/mounted_lens.h"
#include "imaging/pupil_tiles.h"
#include "optics/block_tracer.h"

namespace relign::imaging {

struct CertificateRays {
  int pixels_a_tile = 1;  // 0: `pixels` of the whole image
  int pixels = 0;
  int rays = 1024;  // a pixel, even over the hemisphere; rounded up to whole blocks
};

// Of the tiles in place at a pose. Rays that start from random places of random pixels, go in any direction and reach
// the target must lie in their tile's region. A few at its rim may not: kMostMissing of all, beyond what chance makes
// of the number looked at; or half of those of one pixel. Throws Error(internal) with the place on the sensor, and with
// the wavelength unless that is 0.
// Half of the rays go where `search` has seen light, twice as wide: narrow pupils are hit by few others. Returns how
// many arrived.
int certify(const SceneFile& scene, const PupilTiles& tiles, const optics::BackwardPath& path,
            const std::vector<optics::Op>& ops, const optics::PupilSearch& search, const optics::Motion& lens_to_world,
            const optics::BlockTracer* tracer, const CertificateRays& rays, std::uint64_t seed, Parallel& parallel,
            double wavelength_nm = 0);

inline constexpr double kMostMissing = 0.002;

}  // namespace relign::imaging
