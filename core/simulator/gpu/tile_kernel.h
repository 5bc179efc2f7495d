// What kernels draw rays from: the tiles of many lenses and poses, and the kernels' functions that fit them, one for
// each thread. They exist where NVRTC compiles this header; a plain loop runs the same functions on the CPU. Arithmetic
// is that of imaging/pupil_tiles.h, so that tiles have its bits.
//
// Certificates (imaging/certificate.h) check the fitted tiles of lenses whose first image this is.
//
// In this order: regions that no pose has needed before are requested and found (a warp shares one), corners are
// fitted, their probe rays traced and the blurry ones seen, then it is known which tiles see the emitter, and these are
// fitted.
#pragma once

#include "imaging/binomial.h"
#include "imaging/certificate_steps.h"
#include "imaging/streams.h"
#include "imaging/tile_steps.h"
#include "optics/asphere_steps.h"

namespace relign::gpu {

constexpr int kTileThreads = 160;  // of a GPU block: one for each pixel of a tile, in whole warps

// A tile of one image (imaging/pupil_tiles.h), of which only the lit pixels get rays.
struct TileJob {
  optics::TileStart start;
  optics::PixelPlaces places;  // of the lit pixels
  std::int32_t lit_pixels;     // 0: no light of the emitter arrives
  std::int32_t image;          // index of its ImageJob
  std::int32_t whole_disc;     // directions from the whole disc, not from the ellipse
  std::int32_t thresholds;     // captures: of the distribution of the number of rays
  // MSE: all pixels of the tile; where the lit ones begin in them.
  std::int32_t columns, pixels, lit_column, lit_row;
  std::uint32_t first_number;  // of the tile's first pixel in the frame
  std::int64_t first_threshold;
  double scale;  // sum of radiances -> irradiance
};

// A lens at a pose.
struct ImageJob {
  std::uint32_t seed_low, seed_high;
  std::int32_t first_op, ops;
  float highest_transmittance;  // of any ray
  std::uint32_t place;          // captures: of the image in memory, counted in images
  std::int32_t errors;          // captures: index of the ErrorJob; -1: none
};

// How tiles get their rays.
struct TileRays {
  std::int32_t captures;  // else noise-free MSE
  std::int32_t samples;   // per pixel: directions over the hemisphere; of a MSE rays in the region
  std::int32_t frame_width;
};

// All of a job but its image and the place of its thresholds, which are written to `thresholds`: space for
// rays.samples, of captures.
inline void set_tile_job(const imaging::Tile& tile, const TileRays& rays, double highest_transmittance, TileJob& job,
                         std::uint32_t* thresholds) {
  const auto number = [&](int column, int row) {
    return static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(rays.frame_width) +
           static_cast<std::uint32_t>(column);
  };
  job = {};
  job.columns = tile.box.columns;
  job.pixels = tile.box.columns * tile.box.rows;
  job.first_number = number(tile.box.column, tile.box.row);
  job.places.frame_width = static_cast<std::uint32_t>(rays.frame_width);
  if (tile.unlit) return;
  job.start = tile.start;
  job.places = imaging::places_of(tile.box, tile.lit, rays.frame_width);
  job.lit_pixels = tile.lit.columns * tile.lit.rows;
  job.whole_disc = tile.whole_disc ? 1 : 0;
  job.lit_column = tile.lit.column - tile.box.column;
  job.lit_row = tile.lit.row - tile.box.row;
  if (!rays.captures) {
    job.scale = tile.area / rays.samples;
    return;
  }
  job.scale = optics::kPi / rays.samples / imaging::kRouletteSurvival;
  // The distribution of the number of rays of a pixel, as in RaySource::draw_counts.
  const double largest_survival = imaging::kRouletteSurvival * highest_transmittance;
  const double probability = tile.area / optics::kPi * largest_survival;
  if (probability < 1) {
    job.thresholds = imaging::binomial_thresholds(rays.samples, probability, thresholds);
    return;
  }
  job.thresholds = rays.samples;
  for (std::int32_t k = 0; k < rays.samples; ++k) thresholds[k] = 0;  // every word reaches it: all samples are traced
}

// Of an image whose tiles kernels fit.
struct FitJob {
  optics::Motion lens_to_world, world_to_lens;
  optics::Motion into_first_frame;       // from the world to the frame in which the path's operations begin
  optics::Motion lens_into_first_frame;  // the same from lens coordinates
  double highest_transmittance;
  // The lens's table, in the memory of the processor that fits tiles: regions, and for each the stamp if it was found
  // or is missing.
  optics::PassingRegion* regions;
  std::int32_t* requested;
  std::int32_t stamp;             // no other lens had it
  std::int32_t through_aperture;  // operations up to and including the aperture stop
};

// Where they are, in the memory of the processor that fits tiles.
struct FitBatch {
  const FitJob* jobs;
  const ImageJob* images;
  const optics::Op* ops;
  std::int32_t image_count;
  TileRays rays;
  imaging::TileGrid grid;
  optics::PassingGrid places;  // of a table's regions
  optics::Azimuths azimuths;
  std::int32_t* missing;           // number of regions, then image and place of each
  imaging::TileCorner* corners;    // of all images
  std::int32_t* blurry;            // per image
  imaging::Visibility* visible;    // per tile of all images
  TileJob* tiles;                  // of all images
  std::uint32_t* thresholds;       // captures: rays.samples for each of them
  float distance_z, half_emitter;  // of the emitter's plane (optics::EmitterPlane)
};

// Both compilers must see the same layout.
static_assert(sizeof(optics::Op) == 232 && sizeof(TileJob) == 168 && sizeof(ImageJob) == 28);
static_assert(sizeof(FitJob) == 416 && sizeof(FitBatch) == 736);
static_assert(sizeof(optics::PassingRegion) == 152 && sizeof(imaging::TileCorner) == 696);

// A pixel that is checked, and its tile in the grid.
struct CheckJob {
  std::int32_t column, row, tile;
};

// The checks of first images.
struct CheckBatch {
  const std::int32_t* images;  // that are checked
  const CheckJob* pixels;      // of each
  std::int32_t image_count, pixel_count, rays;
  std::uint32_t seed_low, seed_high;
  optics::DirectionWindows windows;
  std::int32_t* counts;  // per pixel of each: rays that reach the emitter, and those of them that images do not sample
};
static_assert(sizeof(CheckBatch) == 80);

#if defined(__CUDACC_RTC__)
inline std::int32_t exchange(std::int32_t& value, std::int32_t other) { return atomicExch(&value, other); }
inline std::int32_t add(std::int32_t& value, std::int32_t more) { return atomicAdd(&value, more); }
#else
inline std::int32_t exchange(std::int32_t& value, std::int32_t other) {
  const std::int32_t before = value;
  value = other;
  return before;
}
inline std::int32_t add(std::int32_t& value, std::int32_t more) { return exchange(value, value + more); }
#endif

// A corner of an image: `index` counts those of all images.
struct CornerOfImage {
  CornerOfImage(const FitBatch& batch, std::int32_t index)
      : image(index / batch.grid.corners()),
        place(batch.grid.corner_place(index % batch.grid.corners() % (batch.grid.across + 1),
                                      index % batch.grid.corners() / (batch.grid.across + 1))),
        job(batch.jobs[image]),
        in_lens(job.world_to_lens.point(place)) {}
  std::int32_t image;
  optics::Vec3 place;  // world
  const FitJob& job;
  optics::Vec3 in_lens;
};

// Requests the regions around a corner. missing[0] must be 0 at first.
inline void request_regions(const FitBatch& batch, std::int32_t index) {
  const CornerOfImage at(batch, index);
  if (index % batch.grid.corners() == 0) batch.blurry[at.image] = 0;
  optics::PassingCell cell;
  if (!optics::find_cell(batch.places, at.in_lens, cell)) return;
  for (int corner = 0; corner < 8; ++corner) {
    const std::int32_t place = cell.place(batch.places, corner);
    std::int32_t& requested = at.job.requested[place];
    if (requested == at.job.stamp || exchange(requested, at.job.stamp) == at.job.stamp) continue;
    std::int32_t* const entry = batch.missing + 1 + 2 * static_cast<std::int64_t>(add(batch.missing[0], 1));
    entry[0] = at.image;
    entry[1] = place;
  }
}

inline optics::FloatRay ray_between(const optics::Vec3& start, const optics::Vec3& direction) {
  return {static_cast<float>(start.x),
          static_cast<float>(start.y),
          static_cast<float>(start.z),
          static_cast<float>(direction.x),
          static_cast<float>(direction.y),
          static_cast<float>(direction.z),
          1.0F,
          1.0F,
          1.0F};
}

// Finds one of the missing regions.
template <class Block>
void fill_region(const Block& block, const FitBatch& batch, std::int32_t entry, optics::RegionSearch& work) {
  const std::int32_t* const missing = batch.missing + 1 + 2 * static_cast<std::int64_t>(entry);
  const FitJob& job = batch.jobs[missing[0]];
  const optics::Op* const ops = batch.ops + batch.images[missing[0]].first_op;
  const optics::Vec3 place = batch.places.place(missing[1]);
  const optics::Vec3 start = job.lens_into_first_frame.point(place);
  const auto x = static_cast<float>(start.x), y = static_cast<float>(start.y), z = static_cast<float>(start.z);
  const auto probe = [&](std::int32_t count) {
    block.for_each(count, [&](std::int32_t i) {
      optics::FloatRay ray = optics::aimed_ray(&job.lens_into_first_frame.rotation[0], x, y, z, work.x[i] - place.x,
                                               work.y[i] - place.y, batch.places.plane_z - place.z);
      optics::trace_ray<false>(ray, ops, job.through_aperture);
      work.passed[i] = ray.margin > 0;
    });
  };
  optics::find_region(block, batch.places, batch.azimuths, work, probe, job.regions[missing[1]]);
}

inline void fit_corner(const FitBatch& batch, std::int32_t index) {
  const CornerOfImage at(batch, index);
  imaging::fit_corner(batch.places, at.job.regions, batch.azimuths, at.job.lens_to_world.rotation, at.in_lens,
                      batch.corners[index]);
}

// Traces a probe ray of a corner to the emitter's plane: `index` counts those of all images.
inline void trace_probe(const FitBatch& batch, std::int32_t index) {
  const std::int32_t probe = index % imaging::kProbes;
  const CornerOfImage at(batch, index / imaging::kProbes);
  imaging::TileCorner& corner = batch.corners[index / imaging::kProbes];
  optics::Vec3 direction;
  if (corner.empty || !imaging::probe_direction(corner, imaging::polygon_points(batch.places), probe, direction))
    return;
  const ImageJob& image = batch.images[at.image];
  optics::FloatRay ray =
      ray_between(at.job.into_first_frame.point(at.place), at.job.into_first_frame.direction(direction));
  optics::trace_ray<false>(ray, batch.ops + image.first_op, image.ops);
  optics::move_to_plane(ray, batch.distance_z);
  if (ray.margin > 0 && ray.lz < 0)
    imaging::add_hit(corner, probe, static_cast<double>(ray.x), static_cast<double>(ray.y));
}

inline void see_blur(const FitBatch& batch, std::int32_t index) {
  if (imaging::is_blurry(batch.corners[index], static_cast<double>(batch.half_emitter)))
    batch.blurry[index / batch.grid.corners()] = 1;
}

// A tile of an image: `index` counts those of all images.
struct TileOfImage {
  TileOfImage(const FitBatch& batch, std::int32_t index)
      : image(index / batch.grid.tiles()),
        column(index % batch.grid.tiles() % batch.grid.across),
        row(index % batch.grid.tiles() / batch.grid.across),
        corners(imaging::corners_of(batch.grid, batch.corners + static_cast<std::int64_t>(image) * batch.grid.corners(),
                                    column, row)),
        lighting{static_cast<double>(batch.half_emitter), batch.places.on_plane, batch.blurry[image] != 0} {}
  std::int32_t image, column, row;
  imaging::TileCorners corners;
  imaging::Lighting lighting;
};

inline void see_emitter(const FitBatch& batch, std::int32_t index) {
  const TileOfImage at(batch, index);
  batch.visible[index] = imaging::visibility(at.corners, at.lighting);
}

inline void fit_tile(const FitBatch& batch, std::int32_t index) {
  const TileOfImage at(batch, index);
  const FitJob& job = batch.jobs[at.image];
  imaging::Tile tile;
  tile.box = batch.grid.box(at.column, at.row);
  tile.unlit = imaging::is_unlit(batch.grid, at.corners,
                                 batch.visible + static_cast<std::int64_t>(at.image) * batch.grid.tiles(), at.column,
                                 at.row, at.lighting.blurry);
  if (!tile.unlit)
    imaging::fit_tile(tile, at.corners, batch.places, batch.grid.sensor, at.lighting, job.into_first_frame);
  const std::int64_t first = batch.rays.captures ? static_cast<std::int64_t>(index) * batch.rays.samples : 0;
  TileJob& made = batch.tiles[index];
  set_tile_job(tile, batch.rays, job.highest_transmittance, made, batch.thresholds + first);
  made.image = at.image;
  made.first_threshold = first;
}

// Checks one ray of a pixel of an image: `index` counts those of all. counts must be 0 at first.
inline void check_ray(const FitBatch& batch, const CheckBatch& checks, std::int32_t index) {
  const std::int32_t pixel = index / checks.rays;  // of all images
  const CheckJob& at = checks.pixels[pixel % checks.pixel_count];
  const std::int32_t number = checks.images[pixel / checks.pixel_count];
  const FitJob& job = batch.jobs[number];
  const ImageJob& image = batch.images[number];
  const imaging::CheckSource source{batch.grid.sensor, checks.windows,  job.lens_to_world,
                                    job.world_to_lens, checks.seed_low, checks.seed_high};
  const imaging::CheckRay drawn = source.draw(at.column, at.row, static_cast<std::uint32_t>(index % checks.rays));
  optics::FloatRay ray =
      ray_between(job.into_first_frame.point(drawn.place), job.into_first_frame.direction(drawn.direction()));
  optics::trace_ray<false>(ray, batch.ops + image.first_op, image.ops);
  optics::move_to_plane(ray, batch.distance_z);
  if (!imaging::reaches_emitter(ray, batch.half_emitter)) return;
  add(checks.counts[2 * pixel], 1);
  const TileJob& tile = batch.tiles[static_cast<std::int64_t>(number) * batch.grid.tiles() + at.tile];
  const imaging::PixelBox box = batch.grid.box(at.tile % batch.grid.across, at.tile / batch.grid.across);
  const bool lit = tile.lit_pixels > 0 && imaging::holds({box.column + tile.lit_column, box.row + tile.lit_row,
                                                          tile.places.columns, tile.lit_pixels / tile.places.columns},
                                                         at.column, at.row);
  const optics::Vec3 middle = imaging::middle_of(batch.grid.sensor, box);
  if (!lit || !imaging::is_sampled(tile.start, tile.whole_disc != 0, middle, drawn))
    add(checks.counts[2 * pixel + 1], 1);
}

#if defined(__CUDACC_RTC__)
// The threads of a warp (optics/one_thread.h).
constexpr int kWarp = 32;
struct Warp {
  template <class Body>
  RELIGN_DEVICE void for_each(std::int32_t count, const Body& body) const {
    for (auto i = static_cast<std::int32_t>(threadIdx.x) % kWarp; i < count; i += kWarp) body(i);
    __syncwarp();
  }
};

RELIGN_DEVICE std::int32_t number_of_thread() {
  return static_cast<std::int32_t>(blockIdx.x) * kTileThreads + static_cast<std::int32_t>(threadIdx.x);
}

// One thread for each corner of all images.
extern "C" __global__ void relign_request(const FitBatch batch) {
  const std::int32_t index = number_of_thread();
  if (index < batch.image_count * batch.grid.corners()) request_regions(batch, index);
}

// Any number of blocks; each warp finds a region at a time.
extern "C" __global__ void relign_fill(const FitBatch batch) {
  constexpr std::int32_t kWarps = kTileThreads / kWarp;
  __shared__ optics::RegionSearch work[kWarps];
  const std::int32_t missing = batch.missing[0], warp = static_cast<std::int32_t>(threadIdx.x) / kWarp;
  for (std::int32_t entry = static_cast<std::int32_t>(blockIdx.x) * kWarps + warp; entry < missing;
       entry += static_cast<std::int32_t>(gridDim.x) * kWarps)
    fill_region(Warp(), batch, entry, work[warp]);
}

// One thread for each corner of all images.
extern "C" __global__ void relign_corners(const FitBatch batch) {
  const std::int32_t index = number_of_thread();
  if (index < batch.image_count * batch.grid.corners()) fit_corner(batch, index);
}

// One thread for each probe ray of all images.
extern "C" __global__ void relign_probes(const FitBatch batch) {
  const std::int32_t index = number_of_thread();
  if (index < batch.image_count * batch.grid.corners() * imaging::kProbes) trace_probe(batch, index);
}

// One thread for each corner of all images.
extern "C" __global__ void relign_blur(const FitBatch batch) {
  const std::int32_t index = number_of_thread();
  if (index < batch.image_count * batch.grid.corners()) see_blur(batch, index);
}

// One thread for each tile of all images.
extern "C" __global__ void relign_see(const FitBatch batch) {
  const std::int32_t index = number_of_thread();
  if (index < batch.image_count * batch.grid.tiles()) see_emitter(batch, index);
}

// One thread for each tile of all images.
extern "C" __global__ void relign_tiles(const FitBatch batch) {
  const std::int32_t index = number_of_thread();
  if (index < batch.image_count * batch.grid.tiles()) fit_tile(batch, index);
}

// One thread for each ray.
extern "C" __global__ void relign_check(const FitBatch batch, const CheckBatch checks) {
  const std::int32_t index = number_of_thread();
  if (index < checks.image_count * checks.pixel_count * checks.rays) check_ray(batch, checks, index);
}
#endif

}  // namespace relign::gpu
