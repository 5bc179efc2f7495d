#include "imaging/ghost_image.h"

#include "imaging/sequences.h"

namespace relign::imaging {
namespace {

using optics::kPi;

// Streams of one frame seed, see PathRandom.
enum Use : std::uint32_t { kCounts = 1, kPaths = 2, kShift = 3, kBranches = 4 };

}  // namespace

DirectionBox GhostImage::directions(const PixelBox& box) const {
  const Sensor& sensor = scene_->sensor;
  const optics::Vec3 first = sensor.place(box.column, box.row);
  const optics::Vec3 last = sensor.place(box.column + box.columns, box.row + box.rows);
  const DirectionBox found = paths_.towards_lens(first.x, last.x, last.y, first.y);
  // Corners of the box may be outside the disc of directions: samples there hit nothing.
  return found.area() < kPi ? found : DirectionBox{};
}

template <class OnePixel>
void GhostImage::for_pixels(const PixelBox& box, const OnePixel& one) const {
  for (int row = box.row; row < box.row + box.rows; ++row)
    for (int column = box.column; column < box.column + box.columns; ++column)
      one(column, row, static_cast<std::uint32_t>(row * scene_->sensor.width + column));
}

PathStart GhostImage::start(int column, int row, const DirectionBox& box, const double (&unit)[4]) const {
  const optics::Vec3 place = scene_->sensor.place(column + unit[0], row + unit[1]);
  return {place.x, place.y, box.low_p + unit[2] * (box.high_p - box.low_p),
          box.low_q + unit[3] * (box.high_q - box.low_q)};
}

void GhostImage::capture(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work, float* pixels) const {
  capture_within(directions(box), box, seed, samples, work, pixels);
}

void GhostImage::capture_everywhere(const PixelBox& box, std::uint64_t seed, int samples, Workspace& work,
                                    float* pixels) const {
  capture_within({}, box, seed, samples, work, pixels);
}

void GhostImage::capture_within(const DirectionBox& directions, const PixelBox& box, std::uint64_t seed, int samples,
                                Workspace& work, float* pixels) const {
  const double share = directions.area() / kPi;
  work.thresholds.resize(static_cast<std::size_t>(samples));
  const int levels = share < 1 ? binomial_thresholds(samples, share, work.thresholds.data()) : 0;
  for_pixels(box, [&](int column, int row, std::uint32_t pixel) {
    int count = share < 1 ? 0 : samples;
    const std::uint32_t drawn = PathRandom(seed, pixel, 0, kCounts).word();
    while (count < levels && drawn >= work.thresholds[static_cast<std::size_t>(count)]) ++count;
    double sum = 0;
    for (int sample = 0; sample < count; ++sample) {
      PathRandom random(seed, pixel, static_cast<std::uint32_t>(sample), kPaths);
      double unit[4];
      do
        for (double& value : unit) value = random.unit();
      while (share >= 1 && !start(column, row, directions, unit).is_direction());
      sum += paths_.trace(start(column, row, directions, unit), random);
    }
    pixels[pixel] = static_cast<float>(kPi / samples * sum);
  });
}

void GhostImage::ghost_part(const PixelBox& box, std::uint64_t seed, std::uint32_t group, int samples,
                            const float* straight, Workspace& work, float* values) const {
  const DirectionBox directions = this->directions(box);
  for_pixels(box, [&](int column, int row, std::uint32_t pixel) {
    PathRandom shifts(seed, pixel, group, kShift);
    std::uint32_t word[4];
    for (std::uint32_t& shift : word) shift = shifts.word();
    PathRandom random(seed, pixel, group, kBranches);
    double sum = 0;
    for (int sample = 0; sample < samples; ++sample) {
      double unit[4];
      for (int k = 0; k < 4; ++k) {
        unit[k] = PathRandom::unit(word[k]);
        word[k] += kLatticeSteps[k];
      }
      sum += paths_.ghost_part(start(column, row, directions, unit), random, straight, work.waiting);
    }
    *values++ = static_cast<float>(directions.area() / samples * sum);
  });
}

}  // namespace relign::imaging
