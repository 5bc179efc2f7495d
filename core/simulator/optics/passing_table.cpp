#include "optics/passing_table.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "optics/backward_path.h"

namespace relign::optics {
namespace {

// Of tables of direction cosines:
constexpr int kBisections = 10;
constexpr int kMaxProbes = 6;
constexpr double kWindowWidening = 1.25, kProbeWidening = 1.6;
static_assert(kCoarsePlaces == kBlockRays);

}  // namespace

const Azimuths& azimuths() {
  static const Azimuths table = [] {
    Azimuths made{};
    for (int k = 0; k < kAzimuths; ++k) {
      const SineCosine angle = sine_cosine_of_degrees(360.0 * k / kAzimuths);
      made.cosine[static_cast<std::size_t>(k)] = angle.cosine;
      made.sine[static_cast<std::size_t>(k)] = angle.sine;
    }
    return made;
  }();
  return table;
}

PassingTable::PassingTable(const Assembly& assembly, const PupilSearch& search)
    : path_(backward_path(assembly, {})), search_(&search) {}

void PassingTable::add_missing(const Vec3& place, std::vector<int>& missing) {
  if (regions_.empty()) {
    regions_.resize(static_cast<std::size_t>(grid().places()));
    requested_.resize(regions_.size());
  }
  PassingCell cell;
  if (!find_cell(grid(), place, cell)) return;
  for (int corner = 0; corner < 8; ++corner) {
    const int index = cell.place(grid(), corner);
    char& requested = requested_[static_cast<std::size_t>(index)];
    if (!requested) missing.push_back(index);
    requested = 1;
  }
}

void PassingTable::fill(int missing, RayBlock& block) {
  const Vec3 place = grid().place(missing);
  PassingRegion& region = regions_[static_cast<std::size_t>(missing)];
  if (!grid().on_plane) {
    region = directions_from(place, block);
    return;
  }
  RegionSearch work;
  std::array<double, kCoarsePlaces> plane_z;
  plane_z.fill(grid().plane_z);
  const auto probe = [&](int count) {
    aim_rays(block, path_, place, place, work.x, work.y, plane_z.data(), count);
    block_kernels().trace(block, path_.ops.data(), static_cast<int>(path_.through_aperture), false, count);
    for (int i = 0; i < count; ++i) work.passed[i] = block.margin[i] > 0;
  };
  find_region(OneThread(), grid(), azimuths(), work, probe, region);
}

namespace {

// cos and sin of 2 pi k / n for n = kSupports or kAzimuths.
std::array<double, 2> support_direction(int k, int n) {
  const auto at = static_cast<std::size_t>(k * (kAzimuths / n));
  return {azimuths().cosine[at], azimuths().sine[at]};
}

}  // namespace

// Like find_region() in direction cosines, with a window that follows the passing rays: a lens as built passes other
// directions than the design.
PassingRegion PassingTable::directions_from(const Vec3& place, RayBlock& block) const {
  PassingRegion region;
  const DirectionWindow window = search_->window(place);
  if (window.empty) return region;
  const double radius = std::sqrt(place.x * place.x + place.y * place.y);
  const double cosine = radius > 0 ? place.x / radius : 1, sine = radius > 0 ? place.y / radius : 0;
  double middle[2], half[2];
  for (int axis = 0; axis < 2; ++axis) {
    middle[axis] = (window.low[axis] + window.high[axis]) / 2;
    half[axis] = kWindowWidening * (window.high[axis] - window.low[axis]) / 2;
  }
  std::array<double, kBlockRays> p{}, q{};
  std::array<bool, kBlockRays> passed{};
  int count = 0;
  for (int probe = 0; probe < kMaxProbes; ++probe) {
    for (std::size_t i = 0; i < kBlockRays; ++i) {
      const double away = middle[0] + half[0] * (2 * (static_cast<double>(i % kCoarse) + 0.5) / kCoarse - 1);
      const double across = middle[1] + half[1] * (2 * (static_cast<double>(i / kCoarse) + 0.5) / kCoarse - 1);
      p[i] = cosine * away - sine * across;
      q[i] = sine * away + cosine * across;
    }
    probe_directions(path_, place, p.data(), q.data(), kBlockRays, passed.data(), block);
    count = 0;
    int low[2] = {kCoarse, kCoarse}, high[2] = {-1, -1};
    for (int i = 0; i < kBlockRays; ++i) {
      if (!passed[static_cast<std::size_t>(i)]) continue;
      ++count;
      const int at[2] = {i % kCoarse, i / kCoarse};
      for (int axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], at[axis]);
        high[axis] = std::max(high[axis], at[axis]);
      }
    }
    if (count == 0) {
      for (double& side : half) side *= kProbeWidening;
      continue;
    }
    bool holds_all = true;
    for (int axis = 0; axis < 2; ++axis) {
      if (low[axis] > 0 && high[axis] < kCoarse - 1) continue;
      holds_all = false;
      middle[axis] += half[axis] * ((low[axis] + high[axis] + 1.0) / kCoarse - 1);
      half[axis] *= kProbeWidening;
    }
    if (holds_all) break;
  }
  if (count == 0) return region;
  region.empty = false;
  for (std::size_t i = 0; i < kBlockRays; ++i)
    if (passed[i]) {
      region.middle[0] += p[i] / count;
      region.middle[1] += q[i] / count;
    }
  const auto widen = [&](double a, double b) {
    for (int k = 0; k < kSupports; ++k) {
      const auto direction = support_direction(k, kSupports);
      region.supports[static_cast<std::size_t>(k)] =
          std::max(region.supports[static_cast<std::size_t>(k)],
                   (a - region.middle[0]) * direction[0] + (b - region.middle[1]) * direction[1]);
    }
  };
  for (std::size_t i = 0; i < kBlockRays; ++i)
    if (passed[i]) widen(p[i], q[i]);
  std::array<double, kAzimuths> inner{}, outer{};
  outer.fill(2 * std::sqrt(half[0] * half[0] + half[1] * half[1]));
  for (int step = 0; step < kBisections; ++step) {
    for (int k = 0; k < kAzimuths; ++k) {
      const auto direction = support_direction(k, kAzimuths);
      const auto at = static_cast<std::size_t>(k);
      p[at] = region.middle[0] + 0.5 * (inner[at] + outer[at]) * direction[0];
      q[at] = region.middle[1] + 0.5 * (inner[at] + outer[at]) * direction[1];
    }
    probe_directions(path_, place, p.data(), q.data(), kAzimuths, passed.data(), block);
    for (std::size_t k = 0; k < kAzimuths; ++k) (passed[k] ? inner : outer)[k] = 0.5 * (inner[k] + outer[k]);
  }
  for (int k = 0; k < kAzimuths; ++k) {
    const auto direction = support_direction(k, kAzimuths);
    const double length = outer[static_cast<std::size_t>(k)];
    widen(region.middle[0] + length * direction[0], region.middle[1] + length * direction[1]);
  }
  return region;
}

}  // namespace relign::optics
