#include "imaging/ghost_image.h"

#include <algorithm>

#include "base/error.h"
#include "imaging/binomial.h"
#include "imaging/streams.h"

namespace relign::imaging {
namespace {

using optics::kGhostRays;
using optics::kPi;

// Streams of one frame seed. PathRandom's are apart from those of the block kernels, of which others use those
// below 32.
enum Use : std::uint32_t { kPaths = 2 };
constexpr std::uint32_t kFirstGroup = 64, kStreamsPerGroup = 2;

int whole_lanes(int count) { return (count + optics::kGhostLanes - 1) / optics::kGhostLanes * optics::kGhostLanes; }

constexpr int kBoxPixels = 40;  // a side, at most

std::uint32_t low_word(std::uint64_t seed) { return static_cast<std::uint32_t>(seed); }
std::uint32_t high_word(std::uint64_t seed) { return static_cast<std::uint32_t>(seed >> 32); }

// GhostWalk intersects faces from either side and repeatedly, which is solved only for spheres, and stops only at their
// position.
void refuse_ghosts(const optics::Prescription& lens) {
  for (const optics::Stop& stop : lens.stops)
    if (stop.before_face)
      throw Error(ErrorKind::bad_input, "lens '" + lens.name + "': the stop '" + stop.name + "' has '" +
                                            (stop.on_face ? "on_face" : "before_face") +
                                            "', but transport 'ghost' supports only stops in air; use transport "
                                            "'fresnel'");
  for (const optics::Element& element : lens.elements)
    for (std::size_t f = 0; f < element.faces.size(); ++f)
      if (!element.faces[f].is_sphere())
        throw Error(ErrorKind::bad_input,
                    "lens '" + lens.name + "': face " + std::to_string(f + 1) + " of " + element.name +
                        " is aspheric, but transport 'ghost' supports only spheres and planes; use "
                        "transport 'fresnel'");
}

}  // namespace

GhostImage::GhostImage(const SceneFile& scene, double sensor_albedo) : paths_(scene, sensor_albedo) {
  refuse_ghosts(scene.lens);
  const int width = scene.sensor.width, height = scene.sensor.height;
  const int across = (width + kBoxPixels - 1) / kBoxPixels, down = (height + kBoxPixels - 1) / kBoxPixels;
  for (int row = 0; row < down; ++row)
    for (int column = 0; column < across; ++column) {
      PixelBox box;
      box.column = column * width / across;
      box.row = row * height / down;
      box.columns = (column + 1) * width / across - box.column;
      box.rows = (row + 1) * height / down - box.row;
      boxes_.push_back(box);
    }
  scene_.scene = &scene;
  scene_.albedo = sensor_albedo;
  scene_.emitter = scene.emitter.plane();
  scene_.has_bore = scene.lens.barrel.has_value();
  if (!scene_.has_bore) return;
  scene_.bore.kind = optics::Op::bore;
  scene_.bore.vertex_z = static_cast<float>(scene.lens.barrel->to_z_mm);
  scene_.bore.clear_radius2 = static_cast<float>(optics::square(scene.lens.barrel->bore_radius_mm));
}

void GhostImage::place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
                       const std::optional<optics::Motion>& into_print) {
  paths_.place(assembly, lens_to_world, into_print);
  scene_.tables.set(paths_.walk());
  path_.world_of_last_frame = lens_to_world;
  path_.into_first_frame = optics::inverse(lens_to_world);
  scene_.to_world = optics::last_frame_to_world(path_);
  scene_.to_print = optics::last_frame_to_world(path_, into_print);
}

std::uint32_t GhostImage::number_of(const PixelBox& box, int pixel) const {
  return static_cast<std::uint32_t>((box.row + pixel / box.columns) * scene_.scene->sensor.width + box.column +
                                    pixel % box.columns);
}

GhostImage::Places GhostImage::places(const PixelBox& box, const GhostBlocks::Box& blocks, int first) const {
  Places found;
  found.count = std::min(box.columns * box.rows - first, kGhostRays);
  found.whole = whole_lanes(found.count);
  for (int i = 0; i < found.whole; ++i) {
    const int pixel = std::min(first + i, box.columns * box.rows - 1);
    const int column = pixel % box.columns, row = pixel / box.columns;
    found.number[i] = number_of(box, pixel);
    found.x[i] = (static_cast<float>(column) - 0.5F * static_cast<float>(box.columns)) * blocks.start.pixel_pitch_x;
    found.y[i] = (static_cast<float>(row) - 0.5F * static_cast<float>(box.rows)) * blocks.start.pixel_pitch_y;
  }
  return found;
}

GhostBlocks::Box GhostImage::box_of(const PixelBox& box, std::uint64_t seed, double& area) const {
  const Sensor& sensor = scene_.scene->sensor;
  GhostBlocks::Box found;
  found.seed = seed;
  found.number = number_of(box, 0);
  found.centre = middle_of(sensor, box);
  set_places(found.start, sensor, box, path_.into_first_frame);
  const DirectionEllipse region =
      paths_.towards_lens(found.centre, 0.5 * box.columns * sensor.pitch_mm, 0.5 * box.rows * sensor.pitch_mm);
  area = region.area();
  found.hemisphere = !(area < kPi);
  if (found.hemisphere) area = kPi;
  found.start.centre[0] = static_cast<float>(region.centre_p);
  found.start.centre[1] = static_cast<float>(region.centre_q);
  for (int k = 0; k < 4; ++k) found.start.slope[k] = static_cast<float>(region.slope[k]);
  found.start.axes[0] = static_cast<float>(region.half_p);
  found.start.axes[3] = static_cast<float>(region.half_q);
  return found;
}

void GhostImage::capture(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work, float* pixels) const {
  const optics::BlockKernels& kernels = optics::block_kernels();
  const std::uint32_t zero[kGhostRays] = {};
  double area = 0;
  GhostBlocks::Box blocks = box_of(box, seed, area);
  blocks.stream = kGhostBlocks;
  const int count = box.columns * box.rows;
  work.thresholds.resize(static_cast<std::size_t>(samples));
  const int levels = blocks.hemisphere ? 0 : binomial_thresholds(samples, area / kPi, work.thresholds.data());
  work.sums.assign(static_cast<std::size_t>(count), 0);
  work.blocks.start(scene_, blocks, work.sums.data());
  optics::RayBlock& block = work.blocks.block();
  std::uint32_t owners[kGhostRays] = {}, numbers[kGhostRays] = {}, sample[kGhostRays] = {};
  int waiting = 0;
  const auto launch = [&] {
    kernels.philox(block, numbers, sample, kGhostStarts, low_word(seed), high_word(seed), whole_lanes(waiting));
    work.blocks.launch(owners, waiting);
    waiting = 0;
  };
  for (int first = 0; first < count; first += kGhostRays) {
    const Places here = places(box, blocks, first);
    std::uint32_t drawn[kGhostRays];
    kernels.philox(work.words, here.number, zero, kGhostCounts, low_word(seed), high_word(seed), here.whole);
    kernels.count_reached(work.words.u0, work.thresholds.data(), levels, drawn, here.whole);
    for (int i = 0; i < here.count; ++i)
      for (std::uint32_t k = 0; k < (blocks.hemisphere ? static_cast<std::uint32_t>(samples) : drawn[i]); ++k) {
        owners[waiting] = static_cast<std::uint32_t>(first + i);
        numbers[waiting] = here.number[i];
        sample[waiting] = k;
        block.pixel_x[waiting] = here.x[i];
        block.pixel_y[waiting] = here.y[i];
        if (++waiting == kGhostRays) launch();
      }
  }
  launch();
  work.blocks.finish();
  for (int i = 0; i < count; ++i)
    pixels[number_of(box, i)] = static_cast<float>(kPi / samples * work.sums[static_cast<std::size_t>(i)]);
}

void GhostImage::capture_everywhere(const PixelBox& box, std::uint64_t seed, int samples, float* pixels) const {
  for (int row = box.row; row < box.row + box.rows; ++row)
    for (int column = box.column; column < box.column + box.columns; ++column) {
      const auto pixel = static_cast<std::uint32_t>(row * scene_.scene->sensor.width + column);
      double sum = 0;
      for (int sample = 0; sample < samples; ++sample) {
        PathRandom random(seed, pixel, static_cast<std::uint32_t>(sample), kPaths);
        PathStart start{0, 0, 1, 1};
        while (!start.is_direction()) {
          const double across = random.unit(), down = random.unit();
          const optics::Vec3 place = scene_.scene->sensor.place(column + across, row + down);
          const double p = 2 * random.unit() - 1, q = 2 * random.unit() - 1;
          start = {place.x, place.y, p, q};
        }
        sum += paths_.trace(start, random);
      }
      pixels[pixel] = static_cast<float>(kPi / samples * sum);
    }
}

void GhostImage::add_ghosts(const PixelBox& box, std::uint64_t seed, std::uint32_t group, int samples,
                            const float* straight, Workspace& work, float* pixels) const {
  const optics::BlockKernels& kernels = optics::block_kernels();
  const std::uint32_t zero[kGhostRays] = {};
  double area = 0;
  GhostBlocks::Box blocks = box_of(box, seed, area);
  const std::uint32_t stream = kFirstGroup + kStreamsPerGroup * group;
  blocks.stream = stream + 1;
  blocks.straight = straight;
  const int count = box.columns * box.rows;
  work.sums.assign(static_cast<std::size_t>(count), 0);
  work.blocks.start(scene_, blocks, work.sums.data());
  optics::RayBlock& block = work.blocks.block();
  for (int first = 0; first < count; first += kGhostRays) {
    const Places here = places(box, blocks, first);
    std::uint32_t owners[kGhostRays];
    for (int i = 0; i < here.count; ++i) owners[i] = static_cast<std::uint32_t>(first + i);
    // A lattice, shifted for each pixel and group.
    kernels.philox(work.words, here.number, zero, stream, low_word(seed), high_word(seed), here.whole);
    for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(samples); ++sample) {
      for (int i = 0; i < here.whole; ++i) {
        block.u0[i] = work.words.u0[i] + sample * kLatticeSteps[0];
        block.u1[i] = work.words.u1[i] + sample * kLatticeSteps[1];
        block.u2[i] = work.words.u2[i] + sample * kLatticeSteps[2];
        block.u3[i] = work.words.u3[i] + sample * kLatticeSteps[3];
      }
      std::copy_n(here.x, here.whole, block.pixel_x);
      std::copy_n(here.y, here.whole, block.pixel_y);
      work.blocks.launch(owners, here.count);
    }
  }
  work.blocks.finish();
  for (int i = 0; i < count; ++i)
    pixels[number_of(box, i)] += static_cast<float>(area / samples * work.sums[static_cast<std::size_t>(i)]);
}

}  // namespace relign::imaging
