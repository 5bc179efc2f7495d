#include "optics/ray_fan.h"

#include <algorithm>
#include <utility>

#include "optics/first_order.h"

namespace relign::optics {
namespace {

constexpr int kHalfScan = 1000;   // heights scanned on either side of the axis
constexpr double kScanReach = 3;  // range of the scan, in largest semi-diameters
constexpr int kFanBisections = 40;
constexpr double kFarStart = 1;  // largest semi-diameters between first vertex and start

// Rays of one object point, by their height in the pupil's plane.
class Pencil {
 public:
  Pencil(const Assembly& assembly, double field_deg, std::optional<double> object_z_mm)
      : assembly_(assembly), field_(sine_cosine_of_degrees(field_deg)), object_z_(object_z_mm) {
    pupil_z_ = first_order(assembly.lens()).entrance_pupil_z;
    for (const Element& element : assembly.lens().elements)
      for (const Face& face : element.faces) radius_ = std::max(radius_, face.clear_radius_mm);
  }

  double reach() const { return kScanReach * radius_; }

  FanRay at(double height) const {
    const double tangent = field_.sine / field_.cosine;
    FanRay ray;
    if (object_z_) {
      ray.start.start = {0, -tangent * (pupil_z_ - *object_z_), *object_z_};
      ray.start.direction = Vec3{0, height, pupil_z_} - ray.start.start;
    } else {
      // Far enough in front for tilted elements.
      const double start_z = std::min(pupil_z_, 0.0) - kFarStart * radius_;
      ray.start.start = {0, height - tangent * (pupil_z_ - start_z), start_z};
      ray.start.direction = {0, field_.sine, field_.cosine};
    }
    if (ray.start.direction.z > 0) ray.traced = trace(assembly_, ray.start, Apertures::mesh);
    return ray;
  }
  bool passes(double height) const { return at(height).traced.passed; }

  // The last height that passes between one that does and one that does not.
  double rim(double inside, double outside) const {
    for (int i = 0; i < kFanBisections; ++i) {
      const double middle = (inside + outside) / 2;
      (passes(middle) ? inside : outside) = middle;
    }
    return inside;
  }

 private:
  const Assembly& assembly_;
  SineCosine field_;
  std::optional<double> object_z_;
  double pupil_z_ = 0;
  double radius_ = 0;
};

}  // namespace

std::vector<FanRay> ray_fan(const Assembly& assembly, double field_deg, std::optional<double> object_z_mm, int count) {
  const Pencil pencil(assembly, field_deg, object_z_mm);
  const double step = pencil.reach() / kHalfScan;
  // The largest run of neighbours that pass; [first, second).
  std::pair<int, int> run{0, 0}, best{0, 0};
  for (int i = -kHalfScan; i <= kHalfScan; ++i) {
    if (!pencil.passes(i * step)) {
      run = {i + 1, i + 1};
      continue;
    }
    if (run.second != i) run.first = i;
    run.second = i + 1;
    if (run.second - run.first > best.second - best.first) best = run;
  }
  if (best.first == best.second) return {};
  const double low = pencil.rim(best.first * step, (best.first - 1) * step);
  const double high = pencil.rim((best.second - 1) * step, best.second * step);
  std::vector<FanRay> fan;
  for (int i = 0; i < count; ++i) {
    const double share = count == 1 ? 0.5 : static_cast<double>(i) / (count - 1);
    // Exact at both ends, which pass by bisection; their neighbours need not.
    FanRay ray = pencil.at((1 - share) * low + share * high);
    if (ray.traced.passed) fan.push_back(std::move(ray));
  }
  return fan;
}

}  // namespace relign::optics
