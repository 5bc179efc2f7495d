// Rays of one tile: draws them, traces them block by block, adds what they see to their pixels.
// Not part of the room's face; camera.cpp uses it.
#pragma once

#include <cstdint>

#include "imaging/pupil_tiles.h"
#include "imaging/scene_file.h"
#include "optics/ray_block.h"

namespace relign::imaging {

struct RayPath {
  const optics::Op* ops;
  int op_count;
  const optics::EmitterPlane* emitter;
  bool fresnel;
};

class RaySource {
 public:
  RaySource();

  // Prepares a tile; `sums` (columns x rows of it) is set to 0 and collects the radiance of each pixel.
  void start_tile(const SceneFile& scene, const optics::BackwardPath& path, const Tile& tile, float* sums);

  // `samples` directions over the whole hemisphere for each pixel, Fresnel and roulette by dice.
  void all_directions(const RayPath& way, std::uint64_t seed, int samples, double survival);
  // The same in law: only those of `samples` directions that fall into B, by a binomial draw a pixel.
  void binomial_directions(const RayPath& way, std::uint64_t seed, int samples, double survival);
  // `samples` independent directions in B for each pixel, weighted by transmittance.
  void random_directions(const RayPath& way, std::uint64_t seed, int samples);
  // `samples` points of a rank-1 lattice in (place, direction), shifted at random for each pixel and
  // group, weighted by transmittance: unbiased, and far less scattered than independent rays.
  void lattice_directions(const RayPath& way, std::uint64_t seed, std::uint32_t group, int samples);

 private:
  void add_ray(int pixel, std::uint32_t sample);
  void flush_random(const RayPath& way, std::uint64_t seed, bool dice, double survival);
  void trace_and_add(const RayPath& way, bool dice, double survival);

  const SceneFile* scene_ = nullptr;
  const Tile* tile_ = nullptr;
  optics::TileStart start_{};
  float* sums_ = nullptr;
  bool whole_ = false;  // directions from the whole disc instead of the ellipse
  int count_ = 0;
  alignas(64) optics::RayBlock block_;
  std::uint32_t pixel_[optics::kBlockRays];  // index in the frame, for the random stream
  std::uint32_t sample_[optics::kBlockRays];
  std::uint16_t owner_[optics::kBlockRays];  // index in the tile
  // Of each pixel of the tile: lower left corner (mm, from the tile's centre), index in the frame.
  float corner_x_[kTilePixels * kTilePixels], corner_y_[kTilePixels * kTilePixels];
  std::uint32_t in_frame_[kTilePixels * kTilePixels];
  std::uint32_t drawn_[kTilePixels * kTilePixels + 16];  // padded for the block kernels
};

}  // namespace relign::imaging
