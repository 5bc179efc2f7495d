#include "lens_files/axial_rays.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "optics/first_order.h"

namespace relign::lens_files {
namespace {

using optics::Vec3;

// y at plane z of the straight line through two hits, extended beyond them if needed.
double height_at(const Vec3& a, const Vec3& b, double z) {
  return std::fabs(b.z - a.z) < 1e-12 ? a.y : a.y + (b.y - a.y) * (z - a.z) / (b.z - a.z);
}

double stop_height(const optics::Prescription& lens, const Vec3& start, const optics::TracedRay& ray) {
  const double z = lens.aperture_stop().z_mm;
  if (lens.aperture_stop().on_face) return ray.hits[*lens.aperture_stop().before_face].y;
  const std::size_t before = lens.faces_before(lens.aperture_stop());
  const Vec3& a = before == 0 ? start : ray.hits[before - 1];
  const Vec3& b = before == ray.hits.size() ? ray.image : ray.hits[before];
  return height_at(a, b, z);
}

// tan(field), up to 89 degrees: emitters are flat.
double tangent(double field_deg) {
  constexpr double kSteepest_deg = 89;
  const optics::SineCosine field = optics::sine_cosine_of_degrees(std::clamp(field_deg, 0.0, kSteepest_deg));
  return field.sine / field.cosine;
}

constexpr int kRays = 1601;

// Files print semi-diameters of the axial beam with few digits.
constexpr double kRounding = 0.99;

bool within_semi_diameters(const optics::Prescription& lens, const optics::TracedRay& ray) {
  std::size_t i = 0;
  for (const optics::Element& element : lens.elements)
    for (const optics::Face& face : element.faces)
      if (kRounding * std::hypot(ray.hits[i].x, ray.hits[i].y) > face.clear_radius_mm)
        return false;
      else
        ++i;
  return true;
}

// Rays across the front of the lens that reach the image plane. `step`: their distance.
std::vector<FanRay> fan(const optics::Prescription& lens, double slope, double distance_mm, double& step) {
  const optics::FirstOrder data = optics::first_order(lens);
  const optics::Assembly assembly(lens);
  const optics::Face& front = lens.elements.front().faces.front();
  // Real entrance pupils of wide-angle lenses are far from the paraxial one: scan the whole front.
  double reach = std::fabs(data.entrance_pupil_z) * slope + 2 * std::fabs(data.entrance_pupil_diameter);
  if (front.curvature != 0) reach = std::min(reach, std::fabs(1 / front.curvature));
  step = 2 * reach / (kRays - 1);
  const double object_height = -slope * (distance_mm + data.entrance_pupil_z);
  const double start_z = distance_mm > 0 ? -distance_mm : -1 - reach;
  std::vector<FanRay> rays;
  for (int i = 0; i < kRays; ++i) {
    FanRay ray;
    ray.front_height_mm = reach * (2.0 * i / (kRays - 1) - 1);
    Vec3 start{0, object_height, start_z}, direction{0, ray.front_height_mm - object_height, -start_z};
    if (distance_mm <= 0) {
      direction = {0, slope, 1};
      start = {0, ray.front_height_mm + slope * start_z, start_z};
    }
    ray.traced = optics::trace(assembly, {start, direction}, optics::Apertures::none);
    if (!ray.traced.passed) continue;
    ray.stop_height_mm = stop_height(lens, start, ray.traced);
    rays.push_back(std::move(ray));
  }
  return rays;
}

}  // namespace

std::vector<FanRay> beam(const optics::Prescription& lens, double field_deg, double distance_mm) {
  const double slope = tangent(field_deg);
  const double aim = -optics::first_order(lens).entrance_pupil_z * slope;
  const double opening = lens.aperture_stop().opening_radius_mm;
  double step = 0;
  const std::vector<FanRay> rays = fan(lens, slope, distance_mm, step);
  const auto neighbours = [&](std::size_t i) {
    return rays[i + 1].front_height_mm - rays[i].front_height_mm < 1.5 * step;
  };
  // Rays far from the lens may hit the stop, too: the beam is around the chief ray, which of several rays through the
  // stop's centre is the one closest to the paraxial chief ray.
  std::size_t chief = rays.size();
  for (std::size_t i = 0; i + 1 < rays.size(); ++i) {
    const bool crosses = (rays[i].stop_height_mm <= 0) != (rays[i + 1].stop_height_mm <= 0);
    if (crosses && neighbours(i) &&
        (chief == rays.size() ||
         std::fabs(rays[i].front_height_mm - aim) < std::fabs(rays[chief].front_height_mm - aim)))
      chief = i;
  }
  if (chief == rays.size()) return {};
  // Keeps the two rays beside the chief ray, however narrow the stop.
  std::size_t first = chief, last = chief + 1;
  const auto inside = [&](std::size_t i) { return std::fabs(rays[i].stop_height_mm) <= opening; };
  while (first > 0 && neighbours(first - 1) && inside(first - 1)) --first;
  while (last + 1 < rays.size() && neighbours(last) && inside(last + 1)) ++last;
  return {rays.begin() + static_cast<std::ptrdiff_t>(first), rays.begin() + static_cast<std::ptrdiff_t>(last + 1)};
}

std::optional<double> largest_field(const optics::Prescription& lens, double field_deg, double distance_mm) {
  constexpr int kSteps = 100, kCoarse = 10;
  constexpr int kMin = kSteps / 2;  // of the field: less indicates a misread file
  const auto passes = [&](int i) { return !beam(lens, field_deg * i / kSteps, distance_mm).empty(); };
  // Coarse first: where no ray passes, fine steps only cost time.
  int above = kSteps;
  while (above >= kMin && !passes(above)) above -= kCoarse;
  if (above < kMin) return std::nullopt;
  for (int i = std::min(above + kCoarse - 1, kSteps); i > above; --i)
    if (passes(i)) return field_deg * i / kSteps;
  return field_deg * above / kSteps;
}

double best_focus_z(const optics::Prescription& lens, double distance_mm) {
  // In a round pupil a ring at height h has weight h: minimise sum |h| (y + s (z - image_z))^2.
  double weights = 0, mean_y = 0, mean_s = 0;
  std::vector<std::array<double, 3>> lines;
  for (const FanRay& ray : beam(lens, 0, distance_mm)) {
    if (!within_semi_diameters(lens, ray.traced)) continue;
    const double weight = std::fabs(ray.stop_height_mm);
    const double slope = ray.traced.exit_direction.y / ray.traced.exit_direction.z;
    lines.push_back({weight, ray.traced.image.y, slope});
    weights += weight;
    mean_y += weight * ray.traced.image.y;
    mean_s += weight * slope;
  }
  double mixed = 0, steep = 0;
  for (const auto& [weight, y, slope] : lines) {
    mixed += weight * (y - mean_y / weights) * (slope - mean_s / weights);
    steep += weight * (slope - mean_s / weights) * (slope - mean_s / weights);
  }
  if (!(steep > 0))
    throw Error(ErrorKind::bad_input, "no light of a point on the axis, " + shortest(distance_mm) +
                                          " mm in front of the first vertex, passes the stop and converges");
  return lens.image_z_mm - mixed / steep;
}

double image_height(const optics::Prescription& lens, double field_deg, double distance_mm, double z_mm) {
  const std::vector<FanRay> rays = beam(lens, field_deg, distance_mm);
  const auto height = [&](const FanRay& ray) {
    return ray.traced.image.y + (z_mm - lens.image_z_mm) * ray.traced.exit_direction.y / ray.traced.exit_direction.z;
  };
  for (std::size_t i = 0; i + 1 < rays.size(); ++i) {
    const double a = rays[i].stop_height_mm, b = rays[i + 1].stop_height_mm;
    if ((a <= 0) != (b <= 0) || a == 0)
      return std::fabs(a == b ? height(rays[i])
                              : height(rays[i]) + (height(rays[i + 1]) - height(rays[i])) * a / (a - b));
  }
  throw Error(ErrorKind::bad_input, "no ray at " + shortest(field_deg) + " degrees passes the centre of the stop");
}

}  // namespace relign::lens_files
