// Rays of one tile: draws them, traces them block by block, adds what they see to their pixels.
// Not part of the room's face; camera.cpp uses it.
#pragma once

#include <cstdint>

#include "imaging/pupil_tiles.h"
#include "imaging/scene_file.h"
#include "optics/block_tracer.h"
#include "optics/ray_block.h"

namespace relign::imaging {

struct RayPath {
  const optics::Op* ops;
  int op_count;
  const optics::EmitterPlane* emitter;
  bool fresnel;
  double highest_transmittance;                 // of any ray; 1 for transport refract
  const optics::BlockTracer* tracer = nullptr;  // in place of the operations, if there is one
  std::uint32_t streams = 0;                    // the first of the frame seed's random streams that are this path's own
};

class RaySource {
 public:
  RaySource();

  // Prepares a tile, of which only the pixels in `seen` get rays. `sums` (one for each of them, row by row) is
  // set to 0 and collects their radiance.
  void start_tile(const SceneFile& scene, const optics::BackwardPath& path, const Tile& tile, const PixelBox& seen,
                  float* sums);

  // `samples` directions over the whole hemisphere for each pixel, Fresnel and roulette by dice.
  void all_directions(const RayPath& way, std::uint64_t seed, int samples, double survival);
  // The same in law, tracing few of them: a binomial draw tells how many of `samples` directions fall into B and
  // could survive the dice of the clearest ray; the dice of the traced rays make up for the difference.
  void binomial_directions(const RayPath& way, std::uint64_t seed, int samples, double survival);
  // `samples` independent directions in B for each pixel, weighted by transmittance.
  void random_directions(const RayPath& way, std::uint64_t seed, int samples);
  // `samples` points of a rank-1 lattice in (place, direction), shifted at random for each pixel and
  // group, weighted by transmittance: unbiased, and far less scattered than independent rays.
  void lattice_directions(const RayPath& way, std::uint64_t seed, std::uint32_t group, int samples);

 private:
  static constexpr int kMostPixels = kTilePixels * kTilePixels;
  static constexpr int kSpare = 16;  // of arrays that are filled some entries at a time

  enum class Weight { transmittance, dice };
  // Of the first `count` rays, a multiple of 16: places from owner_, words from Philox.
  void take_pixels(int count);
  void draw_words(std::uint64_t seed, std::uint32_t stream, int count);
  void trace_and_weigh(const RayPath& way, Weight weight, double bound, int count);
  void add_by_owner(int count);
  // The block stands for one ray of each pixel from number `from` on.
  void one_each(int from, int count);
  // `samples` rays for each pixel, block by block; words(count) draws their words.
  template <class Words>
  void equal_runs(const RayPath& way, int samples, Weight weight, double bound, const Words& words);
  void draw_counts(std::uint64_t seed, std::uint32_t streams, int samples, double probability);

  float* sums_ = nullptr;
  optics::TileStart start_{};
  double area_ = 0;     // of B
  bool whole_ = false;  // directions from the whole disc instead of the ellipse
  optics::PixelPlaces places_{};
  int pixels_ = 0;  // how many get rays
  alignas(64) optics::RayBlock block_;
  // Of each ray of the block, padded: its pixel, which ray of the pixel's it is, the pixel's number in the frame.
  std::uint32_t owner_[optics::kBlockRays + kSpare], sample_[optics::kBlockRays + kSpare];
  std::uint32_t number_[optics::kBlockRays];
  // Of each pixel: rays drawn, lattice shifts.
  std::uint32_t drawn_[kMostPixels + kSpare];
  std::uint32_t shift_[4][kMostPixels + kSpare];
};

}  // namespace relign::imaging
