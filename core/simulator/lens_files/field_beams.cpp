#include "lens_files/field_beams.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lens_files/axial_rays.h"

namespace relign::lens_files {
namespace {

constexpr double kDegrees = 57.29577951308232;  // of one radian

// The part of the pupil that the beam of a field fills, from -1 to 1 along the field's direction.
struct PupilRange {
  double from = -1, to = 1;
};

PupilRange range_of(const FieldBeam& field, bool object_heights) {
  if (field.x == 0 && field.y == 0) {
    const double most = 1 - std::min({field.cut_left, field.cut_right, field.cut_below, field.cut_above});
    return {-most, most};
  }
  if (field.x != 0 && field.y != 0) return {};  // only rays in the two symmetry planes are traced
  const bool upright = field.x == 0;
  const double below = upright ? field.cut_below : field.cut_left, above = upright ? field.cut_above : field.cut_right;
  // Rays are traced for positive angles: a negative angle is mirrored, and so is a positive object height.
  const bool turned = ((upright ? field.y : field.x) < 0) != object_heights;
  return turned ? PupilRange{above - 1, 1 - below} : PupilRange{below - 1, 1 - above};
}

double angle_of(const FieldBeam& field, FieldSize::Kind kind, double half_field_deg) {
  const double part = std::min(std::hypot(field.x, field.y), 1.0);
  return kind == FieldSize::angle_deg ? part * half_field_deg
                                      : std::atan(part * std::tan(half_field_deg / kDegrees)) * kDegrees;
}

}  // namespace

std::optional<double> field_of_real_height(const LensDesign& design, const optics::Prescription& lens, double height_mm,
                                           double paraxial_deg) {
  constexpr int kMarch = 48, kHalvings = 30;
  constexpr double kWidest_deg = 89, kClose = 1e-6;
  const double distance = design.beam_distance_mm();
  const auto height = [&](double field_deg) {
    const std::vector<FanRay> rays = beam(lens, field_deg, distance);
    for (std::size_t i = 0; i + 1 < rays.size(); ++i) {
      const double a = rays[i].stop_height_mm, b = rays[i + 1].stop_height_mm;
      if ((a <= 0) != (b <= 0))
        return std::fabs(rays[i].traced.image.y + (rays[i + 1].traced.image.y - rays[i].traced.image.y) * a / (a - b));
    }
    return std::numeric_limits<double>::infinity();  // no chief ray: too far out
  };
  // Beyond the design's field heights may decrease again: takes the first crossing.
  const double widest = std::min(1.5 * paraxial_deg, kWidest_deg);
  double low = 0, high = widest;
  for (int i = 1; i <= kMarch; ++i) {
    high = widest * i / kMarch;
    if (!(height(high) < height_mm)) break;
    low = high;
  }
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (height(middle) < height_mm ? low : high) = middle;
  }
  if (std::fabs(height(low) - height_mm) > kClose * height_mm) return std::nullopt;
  return low;
}

std::vector<double> needed_radii(const LensDesign& design, const optics::Prescription& lens) {
  constexpr double kEdge = 1e-3;  // of the pupil's radius: distance between two rays of a fan
  const double distance = design.beam_distance_mm();
  std::vector<double> needed;
  for (const optics::Element& element : lens.elements) needed.resize(needed.size() + element.faces.size());
  const auto add = [&](double field_deg, const PupilRange& range) {
    const std::vector<FanRay> rays = beam(lens, field_deg, distance);
    if (rays.empty()) return;
    // A stop behind a crossing of the rays appears inverted in the entrance pupil.
    const double sign = rays.back().stop_height_mm < rays.front().stop_height_mm ? -1 : 1;
    const double opening = lens.aperture_stop().opening_radius_mm;
    for (const FanRay& ray : rays) {
      const double pupil = sign * ray.stop_height_mm / opening;
      if (pupil < range.from - kEdge || pupil > range.to + kEdge) continue;
      for (std::size_t i = 0; i < needed.size(); ++i) needed[i] = std::max(needed[i], std::fabs(ray.traced.hits[i].y));
    }
  };
  const bool vignetted =
      std::any_of(design.fields.begin(), design.fields.end(), [](const FieldBeam& field) { return field.is_cut(); });
  if (!vignetted) {
    for (const double part : {0.0, 0.5, 0.7, 0.85, 1.0}) add(part * lens.half_field_deg, {});
    return needed;
  }
  for (const FieldBeam& field : design.fields)
    add(angle_of(field, design.field.kind, lens.half_field_deg),
        range_of(field, design.field.kind == FieldSize::object_height_mm));
  return needed;
}

}  // namespace relign::lens_files
