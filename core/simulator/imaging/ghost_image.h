// Renders boxes of pixels under transport `ghost`. Internal to imaging; used by camera.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "imaging/ghost_blocks.h"
#include "imaging/ghost_paths.h"
#include "imaging/pupil_tiles.h"
#include "optics/backward_path.h"

namespace relign::imaging {

class GhostImage {
 public:
  GhostImage(const SceneFile& scene, double sensor_albedo);
  void place(const optics::Assembly& assembly, const optics::Motion& lens_to_world);

  // Buffers of one thread.
  struct Workspace {
    GhostBlocks blocks;
    std::vector<std::uint32_t> owners, samples, thresholds;
    std::vector<double> sums;
    optics::RayBlock words;
  };

  // Renders a box of pixels of a capture with `samples` directions over the hemisphere. Directions that miss the lens
  // are not traced: how many of a pixel's directions are in an ellipse around the lens is drawn from a binomial
  // distribution.
  void capture(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work, float* pixels) const;
  // The same, tracing every direction, one path after the other in double precision: the cross-check.
  void capture_everywhere(const PixelBox& box, std::uint64_t seed, int samples, float* pixels) const;
  // Unbiased estimates of the reflected light, row by row, from `samples` weighted paths per pixel. Groups are
  // independent. `straight`: the image without that light, all pixels of the sensor, see GhostBlocks.
  void ghost_part(const PixelBox& box, std::uint64_t seed, std::uint32_t group, int samples, const float* straight,
                  Workspace& work, float* values) const;

 private:
  GhostBlocks::Box box_of(const PixelBox& box, std::uint64_t seed, double& area) const;
  std::uint32_t number_of(int column, int row) const;

  GhostPaths paths_;
  GhostScene scene_;
  optics::BackwardPath path_;  // only its frames: world to lens and back
};

}  // namespace relign::imaging
