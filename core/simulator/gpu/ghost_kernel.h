// Captures with reflections (transport `ghost`) of many lenses and poses at once, as capture_kernel.h has those
// without: what the GPU thread of a pixel does. Its paths start as the CPU's do (imaging/ghost_image.h) and meet what
// those meet (optics/ghost_steps.h), but draw what happens there from streams of their own: the CPU numbers its random
// words by blocks of rays, whose order a GPU has not. So images have the CPU's distribution, not its bits.
#pragma once

#include "gpu/capture_kernel.h"
#include "imaging/ghost_sensor.h"

namespace relign::gpu {

// The surfaces of a lens at a pose (optics/ghost_tables.h).
struct GhostLensJob {
  optics::GhostLens lens;  // without addresses
  std::int32_t first_step, first_body, first_stop;
  std::int32_t entrance;  // queue of rays that come from the sensor
};

// Pixels whose paths start alike.
struct GhostBoxJob {
  optics::TileStart start;
  optics::PixelPlaces places;
  std::int32_t image, pixels;
  std::int32_t whole_disc, thresholds;  // as of TileJob
  std::int64_t first_threshold;
  double centre_x, centre_y;  // on the sensor
};

// A Batch's further jobs. Of each image three operations: from the lens to the world, the same to the print, the bore.
struct GhostBatch {
  const GhostBoxJob* boxes;
  const GhostLensJob* lenses;  // one for each image
  const optics::GhostStep* steps;
  const optics::GhostBody* bodies;
  const optics::GhostStop* stops;
  imaging::PixelGrid sensor;
  float albedo;
  std::int32_t has_bore;
  std::int32_t samples;        // directions over the hemisphere
  std::int32_t blocks_of_box;  // GPU blocks for each box
};
// Both compilers must see the same layout.
static_assert(sizeof(GhostBatch) == 104 && sizeof(GhostBoxJob) == 160 && sizeof(GhostLensJob) == 72);
static_assert(sizeof(optics::GhostStep) == 100 && sizeof(optics::GhostBody) == 180);

// A path from a pixel to the emitter or to its end.
struct GhostPath {
  const Batch* batch;
  const GhostBatch* ghosts;
  const GhostBoxJob* box;
  const ImageJob* image;
  const optics::Op* ops;
  const optics::GhostStep* steps;
  optics::GhostLens lens;
  std::int32_t entrance;
  std::uint32_t number;  // of the pixel
};

RELIGN_DEVICE void draw_for(const GhostPath& path, std::uint32_t sample, std::uint32_t stream, std::uint32_t event,
                            std::uint32_t (&words)[4]) {
  words[0] = sample;
  words[1] = path.number;
  words[2] = stream;
  words[3] = event;
  philox_rounds(words, path.image->seed_low, path.image->seed_high);
}

// The queue of a path that starts behind the lens, if the barrel lets it pass.
RELIGN_DEVICE std::int32_t enter_lens(const GhostPath& path, optics::FloatRay from, float weight, std::uint32_t tag,
                                      optics::GhostRay& ray) {
  if (path.ghosts->has_bore) optics::intersect_bore(from, path.ops[2]);
  ray = {from.x, from.y, from.z, from.lx, from.ly, from.lz, weight, tag};
  return from.margin > 0 && from.lz < 0 ? path.entrance : optics::kGhostGone;
}

RELIGN_DEVICE optics::FloatRay moved_by(const optics::GhostRay& ray, const optics::Op& motion) {
  optics::FloatRay there{ray.x, ray.y, ray.z, ray.l, ray.m, ray.n, 1.0F, 1.0F, 1.0F};
  optics::trace_ray<false>(there, &motion, 1);
  return there;
}

RELIGN_DEVICE double light_of(const GhostPath& path, const optics::GhostRay& ray) {
  optics::FloatRay there = moved_by(ray, path.ops[1]);
  return static_cast<double>(ray.weight * radiance_at(path.batch->emitter, there));
}

// The sensor scatters a path that left the lens towards the image.
RELIGN_DEVICE std::int32_t scatter_at_sensor(const GhostPath& path, std::uint32_t sample, optics::GhostRay& ray) {
  if (!(path.ghosts->albedo > 0)) return optics::kGhostGone;
  imaging::ScatterPlace place;
  const optics::Op* const bore = path.ghosts->has_bore ? path.ops + 2 : nullptr;
  if (!imaging::meets_sensor(path.ghosts->sensor, bore, ray, moved_by(ray, path.ops[0]), place))
    return optics::kGhostGone;
  const std::uint32_t tag = imaging::scattered(ray.tag), events = tag & optics::kGhostEventMask;
  if (events >= optics::kGhostEvents * optics::kGhostEvent) return optics::kGhostGone;
  std::uint32_t words[4];
  draw_for(path, sample, imaging::kGhostScatter, events, words);
  float weight = ray.weight * path.ghosts->albedo;
  if (events >= optics::kGhostRouletteFrom) {
    const float survival = optics::smaller(weight, optics::kGhostMostSurvival);
    if (!(optics::unit_of_word(words[0]) < survival)) return optics::kGhostGone;
    weight /= survival;
  }
  const optics::FloatRay from =
      optics::start_in_hemisphere(path.box->start, static_cast<float>(place.x - path.box->centre_x),
                                  static_cast<float>(place.y - path.box->centre_y), 0, 0, words[2], words[3]);
  return enter_lens(path, from, weight, tag, ray);
}

// Writes a pixel of a capture. One loop over the events of all its paths, so that threads whose path has ended begin
// the next one and do not wait.
RELIGN_DEVICE void ghost_pixel(const Batch& batch, const GhostBatch& ghosts, const GhostBoxJob& box, std::int32_t pixel,
                               float* images) {
  const ImageJob& image = batch.images[box.image];
  const GhostLensJob& job = ghosts.lenses[box.image];
  const optics::PixelStart from = start_of(box, pixel);
  GhostPath path{&batch,   &ghosts,      &box,       &image, batch.ops + image.first_op, ghosts.steps + job.first_step,
                 job.lens, job.entrance, from.number};
  path.lens.bodies = ghosts.bodies + job.first_body;
  path.lens.stops = ghosts.stops + job.first_stop;
  std::uint32_t words[4];
  draw_for(path, 0, imaging::kGhostCounts, 0, words);
  const std::uint32_t paths = box.whole_disc ? static_cast<std::uint32_t>(ghosts.samples)
                                             : count_reached(batch, box.first_threshold, box.thresholds, words[0]);
  double sum = 0;
  std::uint32_t begun = 0;
  optics::GhostRay ray{};
  std::int32_t queue = optics::kGhostGone;
  while (true) {
    if (queue == optics::kGhostGone) {
      if (begun == paths) break;
      draw_for(path, begun++, imaging::kGhostStarts, 0, words);
      queue = enter_lens(path, start_ray(box.start, box.whole_disc, from, words), 1.0F, 0, ray);
    } else if (queue == path.lens.object_side) {
      sum += light_of(path, ray);
      queue = optics::kGhostGone;
    } else if (queue == path.lens.image_side) {
      queue = scatter_at_sensor(path, begun - 1, ray);
    } else {
      draw_for(path, begun - 1, imaging::kGhostWalks, ray.tag & optics::kGhostEventMask, words);
      queue = optics::advance_ghost(path.steps, path.lens, queue, words[0], words[1], ray);
    }
  }
  image_at(batch, image, images)[from.number] = static_cast<float>(optics::kPi / ghosts.samples * sum);
}

#if defined(__CUDACC_RTC__)
// Several blocks for each box.
extern "C" __global__ void relign_ghosts(const Batch batch, float* images, const GhostBatch ghosts) {
  const GhostBoxJob& box = ghosts.boxes[blockIdx.x / ghosts.blocks_of_box];
  const auto pixel = static_cast<std::int32_t>(blockIdx.x % ghosts.blocks_of_box * kTileThreads + threadIdx.x);
  if (pixel < box.pixels) ghost_pixel(batch, ghosts, box, pixel, images);
}
#endif

}  // namespace relign::gpu
