#include "imaging/ghost_blocks.h"

#include <algorithm>
#include <cmath>

#include "imaging/ghost_sensor.h"

namespace relign::imaging {
namespace {

using optics::GhostRay;
using optics::kGhostEvent;
using optics::kGhostEventMask;
using optics::kGhostEvents;
using optics::kGhostPaths;
using optics::kGhostRays;
using optics::kGhostReflected;
using optics::kPi;

// Noise-free images: Russian roulette below these weights. Chosen by trial in relign_od-package: time falls much more
// than the variance of the error grows.
constexpr float kLeastWeight = 0.005F, kLeastFaint = 0.08F;

int padded(int count) { return (count + optics::kGhostLanes - 1) / optics::kGhostLanes * optics::kGhostLanes; }

}  // namespace

void GhostBlocks::start(const GhostScene& scene, const Box& box, double* sums) {
  scene_ = &scene;
  box_ = box;
  sums_ = sums;
  blocks_ = 0;
  choice_ = {box.straight != nullptr, kLeastWeight, kLeastFaint, nullptr, nullptr};
  std::fill_n(numbers_, kGhostRays, box.number);
  queues_.resize(static_cast<std::size_t>(scene.tables.queues() + 1));
}

void GhostBlocks::make_room() {
  queues_.front().size = 0;
  for (Queue& one : queues_) {
    const auto needed = static_cast<std::size_t>(one.size + 2 * kGhostRays);
    if (one.rays.size() < needed) one.rays.resize(2 * needed);
  }
}

// Two random words for each ray of the next block; one round of Philox serves two blocks.
void GhostBlocks::draw() {
  if (choice_.words == words_.u0) {
    choice_.words = words_.u2;
    choice_.more_words = words_.u3;
    return;
  }
  for (std::uint32_t i = 0; i < kGhostRays; ++i) places_[i] = blocks_ * kGhostRays + i;
  ++blocks_;
  optics::block_kernels().philox(words_, numbers_, places_, box_.stream, static_cast<std::uint32_t>(box_.seed),
                                 static_cast<std::uint32_t>(box_.seed >> 32), kGhostRays);
  choice_.words = words_.u0;
  choice_.more_words = words_.u1;
}

// Starts rays on the sensor with the weights and tags of `from`.
void GhostBlocks::launch_as(bool hemisphere, const GhostRay* from, int count) {
  const optics::BlockKernels& kernels = optics::block_kernels();
  const int whole = padded(count);
  if (hemisphere)
    kernels.start_in_hemisphere(block_, box_.start, whole);
  else
    kernels.start_in_ellipse(block_, box_.start, whole);
  if (scene_->has_bore) kernels.trace(block_, &scene_->bore, 1, false, whole);
  Queue& entrance = queue(scene_->tables.entrance());
  for (int i = 0; i < count; ++i)
    if (block_.margin[i] > 0 && block_.lz[i] < 0)
      entrance.push({block_.x[i], block_.y[i], block_.z[i], block_.lx[i], block_.ly[i], block_.lz[i], from[i].weight,
                     from[i].tag});
}

void GhostBlocks::launch(const std::uint32_t* owners, int count) {
  for (int i = 0; i < count; ++i) {
    started_[i].weight = 1;
    started_[i].tag = owners[i];
  }
  make_room();
  launch_as(box_.hemisphere, started_, count);
  run(kGhostRays);
}

void GhostBlocks::finish() { run(1); }

void GhostBlocks::distribute(const GhostRay* rays, const std::int32_t* to, int count) {
  for (int i = 0; i < count; ++i) queue(to[i]).push(rays[i]);
}

// Advances blocks of rays until each queue has fewer than `least`, the fullest first.
void GhostBlocks::run(int least) {
  const optics::GhostKernels& kernels = *optics::block_kernels().ghosts;
  while (true) {
    make_room();
    int fullest = 0;
    for (int k = 1; k < scene_->tables.queues(); ++k)
      if (queue(k).size > queue(fullest).size) fullest = k;
    Queue& from = queue(fullest);
    if (from.size < least) return;
    const int count = std::min(from.size, kGhostRays);
    from.size -= count;
    const GhostRay* const rays = from.rays.data() + from.size;  // overwritten only after they have been read
    if (fullest == scene_->tables.object_side()) {
      reach_emitter(rays, count);
      continue;
    }
    draw();
    if (fullest == scene_->tables.image_side()) {
      reach_sensor(rays, count);
      continue;
    }
    scene_->tables.advance(kernels, fullest, rays, choice_, children_, padded(count));
    distribute(children_.first, children_.first_to, count);
    if (choice_.both) distribute(children_.second, children_.second_to, count);
  }
}

// Rays to the block, moved by an operation out of the lens's coordinates.
void GhostBlocks::load(const GhostRay* rays, int count, const optics::Op& motion) {
  for (int i = 0; i < padded(count); ++i) {
    const GhostRay& ray = rays[i];
    block_.x[i] = ray.x;
    block_.y[i] = ray.y;
    block_.z[i] = ray.z;
    block_.lx[i] = ray.l;
    block_.ly[i] = ray.m;
    block_.lz[i] = ray.n;
    block_.margin[i] = 1;
  }
  optics::block_kernels().trace(block_, &motion, 1, false, padded(count));
}

void GhostBlocks::reach_emitter(const GhostRay* rays, int count) {
  load(rays, count, scene_->to_print);
  optics::block_kernels().look_up(block_, scene_->emitter, padded(count));
  for (int i = 0; i < count; ++i) {
    const GhostRay& ray = rays[i];
    // Noise-free images have the light that was never reflected already.
    if (box_.straight != nullptr && (ray.tag & kGhostReflected) == 0) continue;
    sums_[ray.tag % kGhostPaths] += static_cast<double>(ray.weight * block_.radiance[i]);
  }
}

// The sensor scatters rays that left towards the image.
void GhostBlocks::reach_sensor(const GhostRay* rays, int count) {
  if (!(scene_->albedo > 0)) return;
  load(rays, count, scene_->to_world);
  const Sensor& sensor = scene_->scene->sensor;
  const auto albedo = static_cast<float>(scene_->albedo);
  const optics::Op* const bore = scene_->has_bore ? &scene_->bore : nullptr;
  int arrived = 0;
  for (int i = 0; i < count; ++i) {
    const GhostRay ray = rays[i];
    const optics::FloatRay there{block_.x[i],  block_.y[i], block_.z[i], block_.lx[i], block_.ly[i],
                                 block_.lz[i], 1.0F,        1.0F,        1.0F};
    ScatterPlace place;
    if (!meets_sensor(sensor, bore, ray, there, place)) continue;
    float weight = ray.weight * albedo;
    const float u = optics::unit_of_word(choice_.words[i]);
    const std::uint32_t tag = scattered(ray.tag);
    if ((tag & kGhostEventMask) >= kGhostEvents * kGhostEvent) continue;
    if (box_.straight != nullptr) {
      // Lambertian: the mean incident radiance is the irradiance over pi.
      sums_[ray.tag % kGhostPaths] += static_cast<double>(weight * box_.straight[place.pixel]) / kPi;
      if (!(weight >= kLeastFaint || u * kLeastFaint < weight)) continue;
      weight = std::max(weight, kLeastFaint);
    } else if ((tag & kGhostEventMask) >= optics::kGhostRouletteFrom) {
      const float survival = std::min(weight, optics::kGhostMostSurvival);
      if (!(u < survival)) continue;
      weight /= survival;
    }
    block_.pixel_x[arrived] = static_cast<float>(place.x - box_.centre.x);
    block_.pixel_y[arrived] = static_cast<float>(place.y - box_.centre.y);
    started_[arrived].weight = weight;
    started_[arrived++].tag = tag;
  }
  draw();
  std::fill_n(block_.u0, kGhostRays, 0);  // exactly there
  std::fill_n(block_.u1, kGhostRays, 0);
  std::copy_n(choice_.words, kGhostRays, block_.u2);
  std::copy_n(choice_.more_words, kGhostRays, block_.u3);
  launch_as(true, started_, arrived);
}

}  // namespace relign::imaging
