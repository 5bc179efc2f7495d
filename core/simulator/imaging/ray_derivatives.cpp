#include "imaging/ray_derivatives.h"

#include <algorithm>

#include "imaging/ray_source.h"
#include "optics/first_order.h"

namespace relign::imaging {
namespace {

using optics::kBlockRays;
using optics::kWrenchNumbers;

// z of a plane, in lens coordinates, of which passing rays keep their points when the lens moves a little: that of the
// exit pupil. Telecentric lenses have it at infinity, and lenses of a model may have it at the sensor, where no plane
// can be: then it is that of the last face. Any plane gives the same derivatives, with more noise.
double plane_of_pupil(const optics::Prescription& lens) {
  constexpr double kFarthest = 1e4;  // mm
  const double last = lens.elements.back().faces.back().z_mm, pupil = optics::first_order(lens).exit_pupil_z;
  const bool in_front = lens.image_z_mm - pupil > 0.5 * (lens.image_z_mm - last);
  return in_front ? std::max(pupil, -kFarthest) : pupil > lens.image_z_mm + kFarthest ? kFarthest : last;
}

optics::ReadingPlace reading_place(std::size_t before, const optics::Motion& to_lens) {
  optics::ReadingPlace place{};
  place.before = static_cast<std::int32_t>(before);
  for (std::size_t k = 0; k < 9; ++k) place.rotation[k] = static_cast<float>(to_lens.rotation[k]);
  place.translation[0] = static_cast<float>(to_lens.translation.x);
  place.translation[1] = static_cast<float>(to_lens.translation.y);
  place.translation[2] = static_cast<float>(to_lens.translation.z);
  return place;
}

}  // namespace

void PartReadings::place(const MovingParts& parts, const optics::Prescription& lens, const optics::BackwardPath& path,
                         std::size_t op_count, const optics::Motion& lens_to_world, double pitch_mm) {
  const auto set = [](const optics::Vec3& from, float(&to)[3]) {
    to[0] = static_cast<float>(from.x);
    to[1] = static_cast<float>(from.y);
    to[2] = static_cast<float>(from.z);
  };
  const optics::Motion& into_first = path.into_first_frame;  // from the world
  const optics::Motion first_of_lens = after(into_first, lens_to_world);
  set(into_first.direction({pitch_mm, 0, 0}), view_.u);
  set(into_first.direction({0, -pitch_mm, 0}), view_.v);
  view_.cells = static_cast<float>(parts.cells);
  set(into_first.direction({0, 0, 1}), view_.pupil.across);
  const optics::Vec3 axis = first_of_lens.direction({0, 0, 1});
  set(axis, view_.pupil.normal);
  view_.pupil.distance = static_cast<float>(dot(axis, first_of_lens.point({0, 0, plane_of_pupil(lens)})));

  places_.clear();
  parts_.clear();
  follows_ = parts.lens;
  places_.push_back(reading_place(0, inverse(first_of_lens)));
  std::vector<std::size_t> elements = parts.elements;
  std::sort(elements.begin(), elements.end(), std::greater<>());  // as rays meet them
  for (const std::size_t e : elements) {
    const auto& into = path.into_element[e];
    const auto& out = path.out_of_element[e];
    places_.push_back(reading_place(into.before, into.to_lens));
    places_.push_back(reading_place(out.before, out.to_lens));
  }
  if (parts.lens) {
    places_.push_back(reading_place(op_count, inverse(lens_to_world)));
    parts_.push_back({0, static_cast<std::int32_t>(places_.size()) - 1});
  }
  for (const std::size_t e : parts.elements) {
    const auto at = static_cast<std::int32_t>(std::find(elements.begin(), elements.end(), e) - elements.begin());
    parts_.push_back({1 + 2 * at, 2 + 2 * at});
  }
}

void RayDerivatives::start_tile(const PartReadings& readings, int pixels) {
  readings_ = &readings;
  stride_ = readings.parts().size() * kWrenchNumbers;
  sums_.assign(static_cast<std::size_t>(pixels) * stride_, 0.0F);
  adjoints_.resize(readings.places().size() * optics::kPlaceNumbers * kBlockRays);
  derivatives_.resize(stride_ * kBlockRays);
}

void RayDerivatives::trace(optics::RayBlock& block, const RayPath& path, double bound, int count) {
  const optics::BlockKernels& kernels = optics::block_kernels();
  record_.resize((static_cast<std::size_t>(path.op_count) + 1) * optics::kStateNumbers * kBlockRays);
  kernels.trace_recorded(block, path.ops, path.op_count, path.fresnel, count, record_.data());
  kernels.look_up(block, *path.emitter, count);
  const std::vector<optics::ReadingPlace>& places = readings_->places();
  kernels.adjoints->trace_back(path.ops, path.op_count, path.fresnel, record_.data(), path.emitter->distance_z,
                               places.data(), static_cast<int>(places.size()), adjoints_.data(), count);
  kernels.adjoints->differentiate(block, *path.emitter, path.fresnel, static_cast<float>(bound), record_.data(),
                                  adjoints_.data(), readings_->view(), places.data(), readings_->parts().data(),
                                  static_cast<int>(readings_->parts().size()), readings_->follow(), derivatives_.data(),
                                  count);
}

void RayDerivatives::add(const std::uint32_t* owner, int count) {
  for (int i = 0; i < count; ++i) {
    float* const sums = sums_.data() + owner[i] * stride_;
    for (std::size_t k = 0; k < stride_; ++k) sums[k] += derivatives_[k * kBlockRays + static_cast<std::size_t>(i)];
  }
}

void RayDerivatives::add_to_frame(const PixelBox& box, double factor, int width, float* frame) const {
  int pixel = 0;
  for (int row = box.row; row < box.row + box.rows; ++row)
    for (int column = box.column; column < box.column + box.columns; ++column) {
      const float* const from = of_pixel(pixel++);
      float* const to = frame + static_cast<std::size_t>(row * width + column) * stride_;
      for (std::size_t k = 0; k < stride_; ++k) to[k] += static_cast<float>(factor * static_cast<double>(from[k]));
    }
}

}  // namespace relign::imaging
