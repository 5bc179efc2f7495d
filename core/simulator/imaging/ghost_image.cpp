#include "imaging/ghost_image.h"

#include <algorithm>

#include "imaging/sequences.h"

namespace relign::imaging {
namespace {

using optics::kGhostRays;
using optics::kPi;

// Streams of one frame seed. PathRandom's are apart from those of the block kernels, of which others use those
// below 32.
enum Use : std::uint32_t { kPaths = 2 };
constexpr std::uint32_t kCounts = 32, kStarts = 33, kEvents = 34, kFirstGroup = 64, kStreamsPerGroup = 4;

std::uint32_t low_word(std::uint64_t seed) { return static_cast<std::uint32_t>(seed); }
std::uint32_t high_word(std::uint64_t seed) { return static_cast<std::uint32_t>(seed >> 32); }

}  // namespace

GhostImage::GhostImage(const SceneFile& scene, double sensor_albedo) : paths_(scene, sensor_albedo) {
  scene_.scene = &scene;
  scene_.albedo = sensor_albedo;
  scene_.emitter = scene.emitter.plane();
  scene_.has_bore = scene.lens.barrel.has_value();
  if (!scene_.has_bore) return;
  scene_.bore.kind = optics::Op::bore;
  scene_.bore.vertex_z = static_cast<float>(scene.lens.barrel->to_z_mm);
  scene_.bore.clear_radius2 = static_cast<float>(optics::square(scene.lens.barrel->bore_radius_mm));
}

void GhostImage::place(const optics::Assembly& assembly, const optics::Motion& lens_to_world) {
  paths_.place(assembly, lens_to_world);
  scene_.tables.set(paths_.walk());
  path_.world_of_last_frame = lens_to_world;
  path_.into_first_frame = optics::inverse(lens_to_world);
  scene_.to_world = optics::last_frame_to_world(path_);
}

std::uint32_t GhostImage::number_of(int column, int row) const {
  return static_cast<std::uint32_t>(row * scene_.scene->sensor.width + column);
}

GhostBlocks::Box GhostImage::box_of(const PixelBox& box, std::uint64_t seed, double& area) const {
  const Sensor& sensor = scene_.scene->sensor;
  GhostBlocks::Box found;
  found.seed = seed;
  found.number = number_of(box.column, box.row);
  found.centre = sensor.place(box.column + 0.5 * box.columns, box.row + 0.5 * box.rows);
  set_places(found.start, *scene_.scene, box, path_);
  const optics::Vec3 first = sensor.place(box.column, box.row);
  const optics::Vec3 last = sensor.place(box.column + box.columns, box.row + box.rows);
  const DirectionEllipse region = paths_.towards_lens(first.x, last.x, last.y, first.y);
  area = region.area();
  found.hemisphere = !(area < kPi);
  if (found.hemisphere) area = kPi;
  found.start.centre[0] = static_cast<float>(region.centre_p);
  found.start.centre[1] = static_cast<float>(region.centre_q);
  found.start.axes[0] = static_cast<float>(region.half_p);
  found.start.axes[3] = static_cast<float>(region.half_q);
  return found;
}

void GhostImage::capture(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work, float* pixels) const {
  const optics::BlockKernels& kernels = optics::block_kernels();
  double area = 0;
  GhostBlocks::Box blocks = box_of(box, seed, area);
  blocks.stream = kEvents - 1;
  const int count = box.columns * box.rows;
  work.owners.clear();
  work.samples.clear();
  work.thresholds.resize(static_cast<std::size_t>(samples));
  const int levels = blocks.hemisphere ? 0 : binomial_thresholds(samples, area / kPi, work.thresholds.data());
  for (int first = 0; first < count; first += optics::kBlockRays) {
    std::uint32_t numbers[optics::kBlockRays], drawn[optics::kBlockRays];
    const std::uint32_t zero[optics::kBlockRays] = {};
    const int here = std::min(count - first, optics::kBlockRays), whole = (here + 15) / 16 * 16;
    for (int i = 0; i < whole; ++i) {
      const int pixel = std::min(first + i, count - 1);
      numbers[i] = number_of(box.column + pixel % box.columns, box.row + pixel / box.columns);
    }
    kernels.philox(work.words, numbers, zero, kCounts, low_word(seed), high_word(seed), whole);
    kernels.count_reached(work.words.u0, work.thresholds.data(), levels, drawn, whole);
    for (int i = 0; i < here; ++i)
      for (std::uint32_t k = 0; k < (blocks.hemisphere ? static_cast<std::uint32_t>(samples) : drawn[i]); ++k) {
        work.owners.push_back(static_cast<std::uint32_t>(first + i));
        work.samples.push_back(k);
      }
  }
  work.sums.assign(static_cast<std::size_t>(count), 0);
  work.blocks.start(scene_, blocks, work.sums.data());
  optics::RayBlock& block = work.blocks.block();
  for (std::size_t first = 0; first < work.owners.size(); first += kGhostRays) {
    const int here = static_cast<int>(std::min<std::size_t>(work.owners.size() - first, kGhostRays));
    std::uint32_t numbers[kGhostRays] = {}, places[kGhostRays] = {};
    for (int i = 0; i < here; ++i) {
      const int pixel = static_cast<int>(work.owners[first + static_cast<std::size_t>(i)]);
      const int column = pixel % box.columns, row = pixel / box.columns;
      numbers[i] = number_of(box.column + column, box.row + row);
      places[i] = work.samples[first + static_cast<std::size_t>(i)];
      block.pixel_x[i] =
          (static_cast<float>(column) - 0.5F * static_cast<float>(box.columns)) * blocks.start.pixel_pitch_x;
      block.pixel_y[i] = (static_cast<float>(row) - 0.5F * static_cast<float>(box.rows)) * blocks.start.pixel_pitch_y;
    }
    kernels.philox(block, numbers, places, kStarts, low_word(seed), high_word(seed), (here + 15) / 16 * 16);
    work.blocks.launch(work.owners.data() + first, here);
  }
  work.blocks.finish();
  for (int i = 0; i < count; ++i)
    pixels[number_of(box.column + i % box.columns, box.row + i / box.columns)] =
        static_cast<float>(kPi / samples * work.sums[static_cast<std::size_t>(i)]);
}

void GhostImage::capture_everywhere(const PixelBox& box, std::uint64_t seed, int samples, float* pixels) const {
  for (int row = box.row; row < box.row + box.rows; ++row)
    for (int column = box.column; column < box.column + box.columns; ++column) {
      const std::uint32_t pixel = number_of(column, row);
      double sum = 0;
      for (int sample = 0; sample < samples; ++sample) {
        PathRandom random(seed, pixel, static_cast<std::uint32_t>(sample), kPaths);
        PathStart start;
        do {
          const double across = random.unit(), down = random.unit();
          const optics::Vec3 place = scene_.scene->sensor.place(column + across, row + down);
          const double p = 2 * random.unit() - 1, q = 2 * random.unit() - 1;
          start = {place.x, place.y, p, q};
        } while (!start.is_direction());
        sum += paths_.trace(start, random);
      }
      pixels[pixel] = static_cast<float>(kPi / samples * sum);
    }
}

void GhostImage::ghost_part(const PixelBox& box, std::uint64_t seed, std::uint32_t group, int samples,
                            const float* straight, Workspace& work, float* values) const {
  const optics::BlockKernels& kernels = optics::block_kernels();
  double area = 0;
  GhostBlocks::Box blocks = box_of(box, seed, area);
  blocks.stream = kFirstGroup + kStreamsPerGroup * group;
  blocks.straight = straight;
  const int count = box.columns * box.rows;
  work.sums.assign(static_cast<std::size_t>(count), 0);
  work.blocks.start(scene_, blocks, work.sums.data());
  optics::RayBlock& block = work.blocks.block();
  for (int first = 0; first < count; first += kGhostRays) {
    const int here = std::min(count - first, kGhostRays), whole = (here + 15) / 16 * 16;
    std::uint32_t numbers[kGhostRays], owners[kGhostRays];
    const std::uint32_t zero[kGhostRays] = {};
    float x[kGhostRays], y[kGhostRays];
    for (int i = 0; i < whole; ++i) {
      const int pixel = std::min(first + i, count - 1), column = pixel % box.columns, row = pixel / box.columns;
      owners[i] = static_cast<std::uint32_t>(pixel);
      numbers[i] = number_of(box.column + column, box.row + row);
      x[i] = (static_cast<float>(column) - 0.5F * static_cast<float>(box.columns)) * blocks.start.pixel_pitch_x;
      y[i] = (static_cast<float>(row) - 0.5F * static_cast<float>(box.rows)) * blocks.start.pixel_pitch_y;
    }
    // A lattice, shifted for each pixel and group.
    kernels.philox(work.words, numbers, zero, blocks.stream, low_word(seed), high_word(seed), whole);
    for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(samples); ++sample) {
      for (int i = 0; i < whole; ++i) {
        block.u0[i] = work.words.u0[i] + sample * kLatticeSteps[0];
        block.u1[i] = work.words.u1[i] + sample * kLatticeSteps[1];
        block.u2[i] = work.words.u2[i] + sample * kLatticeSteps[2];
        block.u3[i] = work.words.u3[i] + sample * kLatticeSteps[3];
      }
      std::copy_n(x, whole, block.pixel_x);
      std::copy_n(y, whole, block.pixel_y);
      work.blocks.launch(owners, here);
    }
  }
  work.blocks.finish();
  for (int i = 0; i < count; ++i)
    *values++ = static_cast<float>(area / samples * work.sums[static_cast<std::size_t>(i)]);
}

}  // namespace relign::imaging
