// Derivatives of the pixels of a tile by rigid motions of the lens and of its elements: traces blocks of rays with a
// record, then back (optics/adjoint_block.h), and sums over the rays of each pixel. Internal to imaging.
#pragma once

#include <vector>

#include "imaging/pixel_grid.h"
#include "optics/backward_path.h"
#include "optics/ray_block.h"

namespace relign::imaging {

struct RayPath;

// Which parts move: the lens as a whole, and single elements by their number.
struct MovingParts {
  bool lens = true;
  std::vector<std::size_t> elements;
  // Each pixel is divided into so many cells along x and along y, over which slopes are averaged. 1: least noise; the
  // noise grows as fast as the cells, their error falls as fast (docs/derivatives.md).
  int cells = 1;
  std::size_t count() const { return (lens ? 1U : 0U) + elements.size(); }
};

// Where wrenches are read off along a path, and between which of them each part is.
class PartReadings {
 public:
  // path, lens_to_world: of the current pose. op_count: with the last, into the world. pitch_mm: of pixels.
  void place(const MovingParts& parts, const optics::Prescription& lens, const optics::BackwardPath& path,
             std::size_t op_count, const optics::Motion& lens_to_world, double pitch_mm);

  const std::vector<optics::ReadingPlace>& places() const { return places_; }
  const std::vector<optics::PartBetween>& parts() const { return parts_; }
  const optics::SensorView& view() const { return view_; }
  const optics::PupilPlane* follow() const { return follows_ ? &view_.pupil : nullptr; }

 private:
  std::vector<optics::ReadingPlace> places_;
  std::vector<optics::PartBetween> parts_;
  optics::SensorView view_{};
  bool follows_ = false;
};

// What one thread needs.
class RayDerivatives {
 public:
  // Of so many pixels, whose sums are set to 0. Until the next call `readings` must not change.
  void start_tile(const PartReadings& readings, int pixels);
  // In place of tracing and looking up. bound: of the roulette that follows, or 1.
  void trace(optics::RayBlock& block, const RayPath& path, double bound, int count);
  // Adds the latest rays to their pixels.
  void add(const std::uint32_t* owner, int count);

  // Of a pixel: the derivative of its sum of values by each part, as wrenches: 6 numbers a part.
  const float* of_pixel(int pixel) const { return sums_.data() + static_cast<std::size_t>(pixel) * stride_; }
  // Adds `factor` times that of every pixel of the tile, which are those of `box`, to a frame that is `width` wide.
  void add_to_frame(const PixelBox& box, double factor, int width, float* frame) const;

 private:
  const PartReadings* readings_ = nullptr;
  std::size_t stride_ = 0;
  std::vector<float> sums_, record_, adjoints_, derivatives_;
};

}  // namespace relign::imaging
