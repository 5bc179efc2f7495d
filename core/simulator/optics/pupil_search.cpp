#include "optics/pupil_search.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "optics/first_order.h"

namespace relign::optics {
namespace {

// A pupil farther from the image than this many image distances hardly moves in angle, but grows on its plane with
// aberrations: regions are then described on the plane of the last vertex.
constexpr double kFarPupil = 6;
constexpr double kReachOfLastFace = 1.3;  // semi-diameters on that plane
constexpr int kFan = 4 * kBlockRays;      // rays across the half space: f/200 is two of them wide;
constexpr int kEnoughOfFan = 12;          // if fewer pass on the axis,
constexpr int kFinest = 64;               // rays get up to this many times denser
constexpr int kCoarsePoints = 16;         // points per side of a table's first grid (passing_table.cpp)
constexpr double kMinPlaces = 3;          // of them that the widest region must cover for the plane to be useful
constexpr double kWithinReach = 0.95;
constexpr double kGridStep = 0.5;  // mm between places on a plane, for a lens whose pupil is so far from its image:
constexpr double kPupilOfGridStep = 8.5;  // mm
constexpr int kHalfGrid = 20;             // places of direction cosines from the axis to the end of the range
constexpr int kMinHeights = 5;
// Of PupilSearch::Work:
constexpr double kWorkOfPolynomial = 12, kWorkOfStep = 30;
constexpr std::uint64_t kMostSteps = 20'000'000;  // of a whole scan: seconds; usual lenses need a tenth

}  // namespace

void probe_directions(const BackwardPath& path, const Vec3& place, const double* p, const double* q, int count,
                      bool* passed, RayBlock& block) {
  std::array<double, kBlockRays> down{};
  for (int i = 0; i < count; ++i)
    down[static_cast<std::size_t>(i)] = -std::sqrt(std::max(1 - p[i] * p[i] - q[i] * q[i], 1e-9));
  aim_rays(block, path, place, {}, p, q, down.data(), count);
  for (int i = 0; i < count; ++i)
    if (!(p[i] * p[i] + q[i] * q[i] < 1)) block.margin[i] = -1;
  block_kernels().trace(block, path.ops.data(), static_cast<int>(path.through_aperture), false, count);
  for (int i = 0; i < count; ++i) passed[i] = block.margin[i] > 0;
}

PupilSearch::PupilSearch(const Prescription& lens, const PlaceRange& range) : range_(range) {
  const double last_z = lens.elements.back().faces.back().z_mm;
  choose_plane(lens);
  const BackwardPath path = backward_path(Assembly(lens), {});
  const auto block = std::make_unique<RayBlock>();
  // No point is inside the lens, whatever the travel.
  constexpr double kMinGap_mm = 1e-3;
  range_.z_high = std::max(range_.z_high, last_z + kMinGap_mm);
  const double low = std::max(range_.z_low, last_z + kMinGap_mm);
  radius_step_ = 1.4143 * range_.half_width / (kRadii - 1);
  z_step_ = (range_.z_high - low) / (kHeights - 1);
  samples_.resize(static_cast<std::size_t>(kRadii * kHeights));
  int fineness = 1, arrived = 0;
  const auto on_axis = [&] {
    probe_place(path, 0, (low + range_.z_high) / 2, fineness, *block, arrived);
    return arrived;
  };
  while (fineness < kFinest && on_axis() < kEnoughOfFan) fineness *= 4;
  grid_.on_plane = true;  // discards what the probes above found
  widest_[0] = widest_[1] = 0;
  for (int height = 0; height < kHeights; ++height)
    for (int radius = 0; radius < kRadii; ++radius)
      sample(radius, height) =
          probe_place(path, radius * radius_step_, low + height * z_step_, fineness, *block, arrived);
  measure_work(path, lens, (low + range_.z_high) / 2, *block);
  // Polynomials distort pupils: always use directions.
  for (const Element& element : lens.elements)
    for (const Face& face : element.faces) grid_.on_plane = grid_.on_plane && face.is_conic();
  for (const double width : widest_)
    grid_.on_plane = grid_.on_plane && width > kMinPlaces * 2 * grid_.reach / kCoarsePoints;
  grid_.on_plane = grid_.on_plane && set_places_on_plane(lens.image_z_mm - grid_.plane_z);
  if (grid_.on_plane) return;
  range_.z_low = low;
  grid_.step = range_.half_width / kHalfGrid;
  set_places(kHalfGrid, kMinHeights);
}

void PupilSearch::measure_work(const BackwardPath& path, const Prescription& lens, double z, RayBlock& block) {
  for (const Element& element : lens.elements)
    for (const Face& face : element.faces) work_.faces += face.is_conic() ? 1 : kWorkOfPolynomial;
  if (block.search_steps > kMostSteps) {  // the scan was given up
    work_.searches = kWorkOfStep * static_cast<double>(block.search_steps);
    return;
  }
  BackwardPath whole = path;
  whole.through_aperture = whole.ops.size();
  block.search_steps = 0;
  int rays = 0;
  std::array<double, kBlockRays> p{}, q{};
  std::array<bool, kBlockRays> passed{};
  for (int radius = 0; radius < kRadii; ++radius) {
    const DirectionWindow& window = sample(radius, kHeights / 2);
    if (window.empty) continue;
    const auto within = [&](std::size_t axis, int place) {
      return window.low[axis] + (window.high[axis] - window.low[axis]) * (place + 0.5) / kCoarsePoints;
    };
    for (int i = 0; i < kBlockRays; ++i) {
      p[static_cast<std::size_t>(i)] = within(0, i % kCoarsePoints);
      q[static_cast<std::size_t>(i)] = within(1, i / kCoarsePoints);
    }
    probe_directions(whole, {radius * radius_step_, 0, z}, p.data(), q.data(), kBlockRays, passed.data(), block);
    rays += kBlockRays;
  }
  if (rays > 0) work_.searches = kWorkOfStep * static_cast<double>(block.search_steps) / rays;
}

bool PupilSearch::set_places_on_plane(double plane_from_image) {
  if (!(plane_from_image > 0)) return false;
  // Halved or doubled with the size of the lens.
  grid_.step = kGridStep;
  while (grid_.step / kGridStep < plane_from_image / kPupilOfGridStep) grid_.step *= 2;
  while (grid_.step / kGridStep >= 2 * plane_from_image / kPupilOfGridStep) grid_.step /= 2;
  const double half = std::ceil(range_.half_width / grid_.step);
  const double heights =
      std::max<double>(kMinHeights, 1 + std::ceil((range_.z_high - range_.z_low) / (2 * grid_.step)));
  if (!((2 * half + 1) * (2 * half + 1) * heights <= range_.most_places)) return false;
  set_places(static_cast<int>(half), static_cast<int>(heights));
  return true;
}

void PupilSearch::set_places(int half, int heights) {
  grid_.count = 2 * half + 1;
  grid_.count_z = heights;
  grid_.low = -half * grid_.step;
  grid_.low_z = range_.z_low;
  grid_.step_z = (range_.z_high - range_.z_low) / (heights - 1);
}

void PupilSearch::choose_plane(const Prescription& lens) {
  const FirstOrder data = first_order(lens);
  const Face& last = lens.elements.back().faces.back();
  const double pupil_from_image = lens.image_z_mm - data.exit_pupil_z;
  if (pupil_from_image > 0 && pupil_from_image < kFarPupil * data.image_distance) {
    grid_.plane_z = data.exit_pupil_z;
    // Pupils grow off the axis and with tilts; twice the paraxial radius contains them with a margin.
    grid_.reach = std::fabs(data.exit_pupil_diameter);
  } else {
    grid_.plane_z = last.z_mm;
    grid_.reach = kReachOfLastFace * last.clear_radius_mm;
  }
}

DirectionWindow PupilSearch::probe_place(const BackwardPath& path, double radius, double z, int fineness,
                                         RayBlock& block, int& arrived) {
  const Vec3 place{radius, 0, z};
  std::array<double, kBlockRays> p{}, q{};
  std::array<bool, kBlockRays> passed{};
  const int fan = kFan * fineness;
  const double step = 2.0 / fan;
  arrived = 0;
  double plane[2][2] = {{1e300, -1e300}, {1e300, -1e300}};
  const auto see = [&](double a, double b) {
    const double away = grid_.plane_z - z, down = -std::sqrt(std::max(1 - a * a - b * b, 1e-9));
    const double at[2] = {radius + a * away / down, b * away / down};
    for (int axis = 0; axis < 2; ++axis) {
      plane[axis][0] = std::min(plane[axis][0], at[axis]);
      plane[axis][1] = std::max(plane[axis][1], at[axis]);
    }
  };
  // A fan in the meridional plane, then sagittal fans at a quarter, half and three quarters of the passing range.
  DirectionWindow window;
  double low = 1e300, high = -1e300;
  for (int first = 0; first < fan; first += kBlockRays) {
    for (int i = 0; i < kBlockRays; ++i) p[static_cast<std::size_t>(i)] = -1 + step * (first + i + 0.5);
    q.fill(0);
    if (block.search_steps > kMostSteps) return window;
    probe_directions(path, place, p.data(), q.data(), kBlockRays, passed.data(), block);
    for (std::size_t i = 0; i < kBlockRays; ++i)
      if (passed[i]) {
        low = std::min(low, p[i]);
        high = std::max(high, p[i]);
        ++arrived;
        see(p[i], 0);
      }
  }
  if (!(low <= high)) return window;
  double widest = 0;
  for (const double share : {0.25, 0.5, 0.75}) {
    p.fill(low + share * (high - low));
    // The other half is its mirror image. Narrow pupils are round: the fan need not be as wide.
    const int across = fineness == 1 ? fan / 2 : std::min(fan / 2, 16 * arrived + kBlockRays);
    for (int first = 0; first < across; first += kBlockRays) {
      if (block.search_steps > kMostSteps) return window;
      for (int i = 0; i < kBlockRays; ++i) q[static_cast<std::size_t>(i)] = step * (first + i);
      probe_directions(path, place, p.data(), q.data(), kBlockRays, passed.data(), block);
      for (std::size_t i = 0; i < kBlockRays; ++i)
        if (passed[i]) {
          widest = std::max(widest, q[i]);
          see(p[i], q[i]);
          see(p[i], -q[i]);
        }
    }
  }
  window.empty = false;
  window.low = {low - step, -widest - step};
  window.high = {high + step, widest + step};
  for (int axis = 0; axis < 2; ++axis) {
    widest_[axis] = std::max(widest_[axis], plane[axis][1] - plane[axis][0]);
    grid_.on_plane =
        grid_.on_plane && plane[axis][0] > -kWithinReach * grid_.reach && plane[axis][1] < kWithinReach * grid_.reach;
  }
  return window;
}

}  // namespace relign::optics
