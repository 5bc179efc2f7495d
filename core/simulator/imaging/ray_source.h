// Draws the rays of one tile, traces them block by block and adds their radiance to their pixels. Internal to imaging;
// used by camera.cpp.
#pragma once

#include <cstdint>

#include "imaging/pupil_tiles.h"
#include "imaging/ray_derivatives.h"
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
  const optics::BlockTracer* tracer = nullptr;  // used instead of the operations if not null
  std::uint32_t streams = 0;                    // first random stream of the frame seed that belongs to this path
};

class RaySource {
 public:
  RaySource();

  // Prepares a tile, of which only the pixels in `lit` get rays. `sums` (one for each of them, row by row) is set to 0
  // and collects their radiance.
  void start_tile(const SceneFile& scene, const optics::BackwardPath& path, const Tile& tile, const PixelBox& lit,
                  float* sums);

  // Until null is given, derivatives of the pixels are summed as well; not with a tracer. Of rays that play roulette
  // they have the mean over its outcomes, which scatters less.
  void differentiate(RayDerivatives* derivatives) { derivatives_ = derivatives; }

  // `samples` directions over the whole hemisphere for each pixel; Fresnel losses and survival by Russian roulette.
  void all_directions(const RayPath& path, std::uint64_t seed, int samples, double survival);
  // Same distribution, tracing few of them: a binomial draw gives how many of `samples` directions fall into B and
  // would survive at the highest transmittance; the roulette of the traced rays accounts for the difference.
  void binomial_directions(const RayPath& path, std::uint64_t seed, int samples, double survival);
  // `samples` independent directions in B for each pixel, weighted by transmittance.
  void random_directions(const RayPath& path, std::uint64_t seed, int samples);
  // `samples` points of a rank-1 lattice in (position, direction), randomly shifted for each pixel and group, weighted
  // by transmittance: unbiased, with far less variance than independent rays.
  void lattice_directions(const RayPath& path, std::uint64_t seed, std::uint32_t group, int samples);

 private:
  static constexpr int kMaxPixels = kTilePixels * kTilePixels;
  static constexpr int kSpare = 16;  // padding of arrays that are filled several entries at a time

  enum class Weight { transmittance, roulette };
  // For the first `count` rays, a multiple of 16: positions from owner_, words from Philox.
  void take_pixels(int count);
  void draw_words(std::uint64_t seed, std::uint32_t stream, int count);
  void trace_and_weigh(const RayPath& path, Weight weight, double bound, int count);
  void add_by_owner(int count);
  void add_derivatives(int count);
  // One ray for each pixel from number `from` on.
  void one_each(int from, int count);
  // `samples` rays for each pixel, block by block; words(count) draws their words.
  template <class Words>
  void equal_runs(const RayPath& path, int samples, Weight weight, double bound, const Words& words);
  void draw_counts(std::uint64_t seed, std::uint32_t streams, int samples, double probability);

  float* sums_ = nullptr;
  RayDerivatives* derivatives_ = nullptr;
  optics::TileStart start_{};
  double area_ = 0;     // of B
  bool whole_ = false;  // draw directions from the whole disc instead of the ellipse
  optics::PixelPlaces places_{};
  int pixels_ = 0;  // number of pixels that get rays
  alignas(64) optics::RayBlock block_;
  // Per ray of the block, padded: its pixel, its number within the pixel, the pixel's number in the frame.
  std::uint32_t owner_[optics::kBlockRays + kSpare], sample_[optics::kBlockRays + kSpare];
  std::uint32_t number_[optics::kBlockRays];
  // Per pixel: rays drawn, lattice shifts.
  std::uint32_t drawn_[kMaxPixels + kSpare];
  std::uint32_t shift_[4][kMaxPixels + kSpare];
};

}  // namespace relign::imaging
