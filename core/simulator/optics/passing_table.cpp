#include "optics/passing_table.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "optics/backward_path.h"

namespace relign::optics {
namespace {

constexpr int kCoarse = 16;  // coarse places per pupil side
constexpr int kAzimuths = 2 * kSupports;
constexpr int kBisections = 10;
constexpr double kGridStep = 0.5;         // mm between places, for a lens whose pupil is so far from its image:
constexpr double kPupilOfGridStep = 8.5;  // mm
constexpr int kMinHeights = 5;
constexpr double kRelativeMargin = 0.03;  // of the supports
// Of tables of direction cosines:
constexpr int kHalfGrid = 20;          // places from the axis to the end of the range
constexpr double kSpreadMargin = 0.5;  // of what neighbours differ by
constexpr int kMaxProbes = 6;
constexpr double kWindowWidening = 1.25, kProbeWidening = 1.6;
static_assert(kCoarse * kCoarse == kBlockRays);

// Traces rays from one point to points of the pupil plane.
class Prober {
 public:
  Prober(const BackwardPath& path, double pupil_z, RayBlock& block) : path_(path), block_(block) {
    pupil_z_.fill(pupil_z);
  }

  // passed[i] for `count` (a multiple of 16) points (x, y) on the pupil plane.
  void probe(const Vec3& place, const double* x, const double* y, int count, bool* passed) {
    aim_rays(block_, path_, place, place, x, y, pupil_z_.data(), count);
    block_kernels().trace(block_, path_.ops.data(), static_cast<int>(path_.through_aperture), false, count);
    for (int i = 0; i < count; ++i) passed[i] = block_.margin[i] > 0;
  }

 private:
  const BackwardPath& path_;
  std::array<double, kBlockRays> pupil_z_{};
  RayBlock& block_;
};

// Cosines and sines of 2 pi k / kAzimuths.
struct Azimuths {
  std::array<double, kAzimuths> cosine{}, sine{};
};

const Azimuths& azimuths() {
  static const Azimuths table = [] {
    Azimuths made;
    for (int k = 0; k < kAzimuths; ++k) {
      const SineCosine angle = sine_cosine_of_degrees(360.0 * k / kAzimuths);
      made.cosine[static_cast<std::size_t>(k)] = angle.cosine;
      made.sine[static_cast<std::size_t>(k)] = angle.sine;
    }
    return made;
  }();
  return table;
}

PassingRegion probe_region(Prober& prober, const Vec3& place, double reach) {
  std::array<double, kBlockRays> x{}, y{};
  std::array<bool, kBlockRays> passed{};
  const double cell = 2 * reach / kCoarse;
  for (int i = 0; i < kBlockRays; ++i) {
    x[i] = -reach + cell * (i % kCoarse + 0.5);
    y[i] = -reach + cell * (i / kCoarse + 0.5);
  }
  prober.probe(place, x.data(), y.data(), kBlockRays, passed.data());
  PassingRegion region;
  double sum_x = 0, sum_y = 0;
  int count = 0;
  for (int i = 0; i < kBlockRays; ++i)
    if (passed[i]) {
      sum_x += x[i];
      sum_y += y[i];
      ++count;
    }
  if (count == 0) return region;
  region.empty = false;
  region.middle = {sum_x / count, sum_y / count};

  // Bisect between the middle (passes) and twice the reach (does not) along each azimuth.
  const auto& [cosine, sine] = azimuths();
  std::array<double, kAzimuths> inner{}, outer{};
  outer.fill(2 * reach);
  for (int step = 0; step < kBisections; ++step) {
    for (int k = 0; k < kAzimuths; ++k) {
      const double length = 0.5 * (inner[k] + outer[k]);
      x[k] = region.middle[0] + length * cosine[k];
      y[k] = region.middle[1] + length * sine[k];
    }
    prober.probe(place, x.data(), y.data(), kAzimuths, passed.data());
    for (int k = 0; k < kAzimuths; ++k) (passed[k] ? inner : outer)[k] = 0.5 * (inner[k] + outer[k]);
  }
  for (int i = 0; i < kAzimuths; ++i) {
    const double edge[2] = {outer[i] * cosine[i], outer[i] * sine[i]};
    for (int k = 0; k < kSupports; ++k)
      region.supports[k] = std::max(region.supports[k], edge[0] * cosine[2 * k] + edge[1] * sine[2 * k]);
  }
  return region;
}

}  // namespace

std::array<double, 2> support_direction(int k, int n) {
  const auto at = static_cast<std::size_t>(k * (kAzimuths / n));
  return {azimuths().cosine[at], azimuths().sine[at]};
}

PassingTable::PassingTable(const Assembly& assembly, const PupilSearch& search)
    : path_(backward_path(assembly, {})), search_(&search) {
  const PlaceRange& range = search.range();
  int half = kHalfGrid;
  if (search.on_plane()) {
    // Halved or doubled with the size of the lens.
    step_ = kGridStep;
    const double distance = assembly.lens().image_z_mm - search.plane_z();
    while (step_ / kGridStep < distance / kPupilOfGridStep) step_ *= 2;
    while (step_ / kGridStep >= 2 * distance / kPupilOfGridStep) step_ /= 2;
    half = static_cast<int>(std::ceil(range.half_width / step_));
    count_z_ = std::max(kMinHeights, 1 + static_cast<int>(std::ceil((range.z_high - range.z_low) / (2 * step_))));
  } else {
    step_ = range.half_width / half;
    count_z_ = kMinHeights;
  }
  count_ = 2 * half + 1;
  low_ = -half * step_;
  low_z_ = range.z_low;
  step_z_ = (range.z_high - range.z_low) / (count_z_ - 1);
  nodes_.resize(static_cast<std::size_t>(count_ * count_ * count_z_));
  requested_.resize(nodes_.size());
}

bool PassingTable::find_cell(const Vec3& place, Cell& cell) const {
  const double u = (place.x - low_) / step_, v = (place.y - low_) / step_, w = (place.z - low_z_) / step_z_;
  if (!(u >= 0 && u <= count_ - 1 && v >= 0 && v <= count_ - 1)) return false;
  const double wc = std::clamp(w, 0.0, count_z_ - 1.0);
  cell.ix = std::min(static_cast<int>(u), count_ - 2);
  cell.iy = std::min(static_cast<int>(v), count_ - 2);
  cell.iz = std::min(static_cast<int>(wc), count_z_ - 2);
  cell.fu = u - cell.ix;
  cell.fv = v - cell.iy;
  cell.fw = wc - cell.iz;
  return true;
}

void PassingTable::add_missing(const Vec3& place, std::vector<int>& missing) {
  Cell cell;
  if (!find_cell(place, cell)) return;
  for (int corner = 0; corner < 8; ++corner) {
    const int node = node_index(cell.ix + (corner & 1), cell.iy + (corner >> 1 & 1), cell.iz + (corner >> 2));
    char& requested = requested_[static_cast<std::size_t>(node)];
    if (!requested) missing.push_back(node);
    requested = 1;
  }
}

void PassingTable::fill(int missing, RayBlock& block) {
  const int ix = missing % count_, iy = missing / count_ % count_, iz = missing / count_ / count_;
  const Vec3 place{low_ + ix * step_, low_ + iy * step_, low_z_ + iz * step_z_};
  PassingRegion& node = nodes_[static_cast<std::size_t>(missing)];
  if (!search_->on_plane()) {
    node = directions_from(place, block);
    return;
  }
  Prober prober(path_, search_->plane_z(), block);
  node = probe_region(prober, place, search_->reach());
}

// Like probe_region() in direction cosines, with a window that follows the passing rays: a lens as built passes other
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

PassingRegion PassingTable::at(const Vec3& place) const {
  PassingRegion result;
  Cell cell;
  if (!find_cell(place, cell)) return result;

  // Weighted over the corners where light passes.
  double total = 0;
  std::array<double, kSupports> lowest{}, highest{};
  lowest.fill(1e300);
  for (int corner = 0; corner < 8; ++corner) {
    const PassingRegion& region = nodes_[static_cast<std::size_t>(
        node_index(cell.ix + (corner & 1), cell.iy + (corner >> 1 & 1), cell.iz + (corner >> 2)))];
    if (region.empty) continue;
    const double weight = (corner & 1 ? cell.fu : 1 - cell.fu) * (corner & 2 ? cell.fv : 1 - cell.fv) *
                              (corner & 4 ? cell.fw : 1 - cell.fw) +
                          1e-9;
    total += weight;
    for (int axis = 0; axis < 2; ++axis) result.middle[axis] += weight * region.middle[axis];
    for (int k = 0; k < kSupports; ++k) {
      result.supports[k] += weight * region.supports[k];
      lowest[k] = std::min(lowest[k], region.supports[k]);
      highest[k] = std::max(highest[k], region.supports[k]);
    }
  }
  if (total == 0) return result;
  result.empty = false;
  for (double& value : result.middle) value /= total;
  double largest = 0;
  for (double& value : result.supports) {
    value /= total;
    largest = std::max(largest, value);
  }
  for (double& value : result.supports) value += kRelativeMargin * largest;
  if (!search_->on_plane())
    for (int k = 0; k < kSupports; ++k) result.supports[k] += kSpreadMargin * (highest[k] - lowest[k]);
  return result;
}

}  // namespace relign::optics
