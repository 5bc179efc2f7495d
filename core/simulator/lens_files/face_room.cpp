#include "lens_files/face_room.h"

#include <algorithm>
#include <cmath>

#include "optics/face_shape.h"

namespace relign::lens_files {
namespace {

constexpr double kShare = 0.999;  // of the radius at which faces meet

double rounded_down(double radius) { return std::floor(radius * 1e6) / 1e6; }

// The distance from the axis at which the gap between two faces closes, up to `radius`.
double room_between(const optics::Face& before, const optics::Face& behind, double radius) {
  constexpr int kPlaces = 512, kBisections = 40;
  const auto open = [&](double r) {
    return before.z_mm + optics::sag(before, r) <= behind.z_mm + optics::sag(behind, r);
  };
  for (int i = 1; i <= kPlaces; ++i) {
    double outside = radius * i / kPlaces;
    if (open(outside)) continue;
    double inside = radius * (i - 1) / kPlaces;
    for (int k = 0; k < kBisections; ++k) {
      const double middle = (inside + outside) / 2;
      (open(middle) ? inside : outside) = middle;
    }
    return inside;
  }
  return radius;
}

}  // namespace

std::vector<std::string> trim_semi_diameters(const optics::Prescription& lens,
                                             std::vector<std::optional<double>>& semi_diameters) {
  std::vector<const optics::Face*> faces;
  for (const optics::Element& element : lens.elements)
    for (const optics::Face& face : element.faces) faces.push_back(&face);
  std::vector<std::string> reasons(faces.size());
  const auto trim = [&](std::size_t face, double radius, const char* why) {
    if (!(semi_diameters[face] > radius)) return;
    reasons[face] = why;
    semi_diameters[face] = radius;
  };
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const double steepest = std::sqrt(std::max(0.0, 1 + faces[i]->conic)) * std::fabs(faces[i]->curvature);
    const double part = steepest * semi_diameters[i].value_or(0);
    if (part > kShare && part < 1 / kMinRoom)
      trim(i, rounded_down(kShare / steepest),
           faces[i]->conic == 0 ? "is larger than the sphere's radius" : "is larger than the conic");
  }
  for (std::size_t i = 0; i + 1 < faces.size(); ++i) {
    const double radius = std::min(semi_diameters[i], semi_diameters[i + 1]).value_or(0);
    // Faces behind a mirror keep their semi-diameters; the lens reader rejects those that cross.
    if (!(radius > 0) || !(faces[i]->z_mm <= faces[i + 1]->z_mm) || faces[i]->index_after < 0) continue;
    const double room = room_between(*faces[i], *faces[i + 1], radius);
    if (room >= radius || room < kMinRoom * radius) continue;
    trim(i, rounded_down(kShare * room), "extends beyond where the next face crosses it");
    trim(i + 1, rounded_down(kShare * room), "extends beyond where the previous face crosses it");
  }
  return reasons;
}

}  // namespace relign::lens_files
