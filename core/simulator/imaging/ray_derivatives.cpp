#include "imaging/ray_derivatives.h"

#include <algorithm>

#include "imaging/ray_source.h"

namespace relign::imaging {
namespace {

using optics::kBlockRays;
using optics::kWrenchNumbers;

constexpr double kFarthestPupil = 1e4;  // mm: telecentric lenses have theirs at infinity

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

void PartReadings::place(const MovingParts& parts, const optics::BackwardPath& path, std::size_t op_count,
                         const optics::Motion& lens_to_world, double pupil_z_mm, double pitch_mm) {
  places_.clear();
  parts_.clear();
  follows_ = parts.lens;
  const optics::Motion into_lens = inverse(lens_to_world);
  const auto axis = [&](const optics::Vec3& world, float (&in_lens)[3]) {
    const optics::Vec3 there = into_lens.direction(world);
    in_lens[0] = static_cast<float>(there.x);
    in_lens[1] = static_cast<float>(there.y);
    in_lens[2] = static_cast<float>(there.z);
  };
  axis({1, 0, 0}, steps_.x);
  axis({0, 1, 0}, steps_.y);
  steps_.pitch_x = static_cast<float>(pitch_mm);
  steps_.pitch_y = static_cast<float>(-pitch_mm);
  const optics::ReadingPlace start = reading_place(0, inverse(after(path.into_first_frame, lens_to_world)));
  places_.push_back(start);
  if (parts.lens) {  // once more: at the first place the rays follow the pupil
    places_.push_back(start);
    pupil_.z = static_cast<float>(std::clamp(pupil_z_mm, -kFarthestPupil, kFarthestPupil));
    axis({0, 0, 1}, pupil_.across);
  }
  const std::size_t start_count = places_.size();
  std::vector<std::size_t> elements = parts.elements;
  std::sort(elements.begin(), elements.end(), std::greater<>());  // as rays meet them
  for (const std::size_t e : elements) {
    const auto& into = path.into_element[e];
    const auto& out = path.out_of_element[e];
    places_.push_back(reading_place(into.before, into.to_lens));
    places_.push_back(reading_place(out.before, out.to_lens));
  }
  if (parts.lens) {
    places_.push_back(reading_place(op_count, into_lens));
    parts_.push_back({1, static_cast<std::int32_t>(places_.size()) - 1});
  }
  for (const std::size_t e : parts.elements) {
    const auto at = std::find(elements.begin(), elements.end(), e) - elements.begin();
    const auto into = static_cast<std::int32_t>(start_count) + 2 * static_cast<std::int32_t>(at);
    parts_.push_back({into, into + 1});
  }
}

void RayDerivatives::start_tile(const PartReadings& readings, int pixels) {
  readings_ = &readings;
  stride_ = readings.parts().size() * kWrenchNumbers;
  sums_.assign(static_cast<std::size_t>(pixels) * stride_, 0.0F);
  wrenches_.resize(readings.places().size() * optics::kPlaceNumbers * kBlockRays);
  derivatives_.resize(stride_ * kBlockRays);
}

void RayDerivatives::trace(optics::RayBlock& block, const RayPath& path, double bound, int count) {
  const optics::BlockKernels& kernels = optics::block_kernels();
  record_.resize((static_cast<std::size_t>(path.op_count) + 1) * optics::kStateNumbers * kBlockRays);
  kernels.trace_recorded(block, path.ops, path.op_count, path.fresnel, count, record_.data());
  kernels.look_up(block, *path.emitter, count);
  kernels.adjoints->trace_back(path.ops, path.op_count, path.fresnel, record_.data(), path.emitter->distance_z,
                               readings_->places().data(), static_cast<int>(readings_->places().size()),
                               readings_->follow(), wrenches_.data(), count);
  kernels.adjoints->differentiate(block, *path.emitter, path.fresnel, static_cast<float>(bound), readings_->steps(),
                                  wrenches_.data() + readings_->sensor() * optics::kPlaceNumbers * kBlockRays, wrenches_.data(), readings_->parts().data(),
                                  static_cast<int>(readings_->parts().size()), derivatives_.data(), count);
}

void RayDerivatives::add(const std::uint32_t* owner, int count) {
  for (int i = 0; i < count; ++i) {
    float* const sums = sums_.data() + owner[i] * stride_;
    for (std::size_t k = 0; k < stride_; ++k) sums[k] += derivatives_[k * kBlockRays + static_cast<std::size_t>(i)];
  }
}

}  // namespace relign::imaging
