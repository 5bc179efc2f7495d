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
  void place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
             const std::optional<optics::Motion>& into_print);

  // As placed last.
  const GhostScene& placed() const { return scene_; }

  // Boxes of pixels that are rendered one by one: large, so that blocks of rays are full, and many enough for threads.
  const std::vector<PixelBox>& boxes() const { return boxes_; }

  // Buffers of one thread.
  struct Workspace {
    GhostBlocks blocks;
    std::vector<std::uint32_t> thresholds;
    std::vector<double> sums;
    optics::RayBlock words;
  };

  // Where the paths of a capture's box start, and the area of their directions.
  GhostBlocks::Box box_of(const PixelBox& box, std::uint64_t seed, double& area) const;

  // Each works on one box of an image.
  // Renders a capture with `samples` directions over the hemisphere. Directions that miss the lens are not traced: how
  // many of a pixel's directions are in an ellipse around the lens is drawn from a binomial distribution.
  void capture(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work, float* pixels) const;
  // The same, tracing every direction, one path after the other in double precision: the cross-check.
  void capture_everywhere(const PixelBox& box, std::uint64_t seed, int samples, float* pixels) const;
  // Adds unbiased estimates of the reflected light from `samples` weighted paths per pixel. Groups are independent.
  // `straight`: the image without that light, see GhostBlocks.
  void add_ghosts(const PixelBox& box, std::uint64_t seed, std::uint32_t group, int samples, const float* straight,
                  Workspace& work, float* pixels) const;

 private:
  std::uint32_t number_of(const PixelBox& box, int pixel) const;
  // Numbers and places of the pixels of a box from `first` on, at most kGhostRays.
  struct Places {
    std::uint32_t number[optics::kGhostRays];
    float x[optics::kGhostRays], y[optics::kGhostRays];
    int count = 0, whole = 0;  // whole: of lanes
  };
  Places places(const PixelBox& box, const GhostBlocks::Box& blocks, int first) const;

  GhostPaths paths_;
  GhostScene scene_;
  optics::BackwardPath path_;  // only its frames: world to lens and back
  std::vector<PixelBox> boxes_;
};

}  // namespace relign::imaging
