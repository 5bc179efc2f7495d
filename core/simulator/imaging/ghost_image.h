// Renders boxes of pixels under transport `ghost`. Internal to imaging; used by camera.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "imaging/ghost_paths.h"
#include "imaging/pupil_tiles.h"

namespace relign::imaging {

class GhostImage {
 public:
  GhostImage(const SceneFile& scene, double sensor_albedo) : scene_(&scene), paths_(scene, sensor_albedo) {}
  void place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
             const std::optional<optics::Motion>& into_print) {
    paths_.place(assembly, lens_to_world, into_print);
  }

  // Buffers of one thread.
  struct Workspace {
    std::vector<GhostPaths::Branch> waiting;
    std::vector<std::uint32_t> thresholds;
  };

  // Renders a box of pixels of a capture with `samples` directions over the hemisphere. Directions that miss the lens
  // are not traced: how many of a pixel's directions are in a box around the lens is drawn from a binomial
  // distribution.
  void capture(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work, float* pixels) const;
  // The same, tracing every direction: the cross-check.
  void capture_everywhere(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work, float* pixels) const;
  // Unbiased estimates of the reflected light, row by row, from `samples` weighted paths per pixel. Groups are
  // independent. `straight`: the image without that light, all pixels of the sensor, see GhostPaths::ghost_part.
  void ghost_part(const PixelBox& box, std::uint64_t seed, std::uint32_t group, int samples, const float* straight,
                  Workspace& work, float* values) const;

 private:
  DirectionBox directions(const PixelBox& box) const;
  void capture_within(const DirectionBox& directions, const PixelBox& box, std::uint64_t seed, int samples,
                      Workspace& work, float* pixels) const;
  template <class OnePixel>
  void for_pixels(const PixelBox& box, const OnePixel& one) const;
  PathStart start(int column, int row, const DirectionBox& box, const double (&unit)[4]) const;

  const SceneFile* scene_;
  GhostPaths paths_;
};

}  // namespace relign::imaging
