// Builds the surfaces of a GhostWalk from a lens; see ghost_walk.h.
#include <algorithm>
#include <cmath>

#include "optics/elementary.h"
#include "optics/ghost_walk.h"

namespace relign::optics {
namespace {

double sag_of_rim(const Face& face) {
  const double c = face.curvature, r2 = face.clear_radius_mm * face.clear_radius_mm;
  return c * r2 / (1 + std::sqrt(std::max(0.0, 1 - c * c * r2)));
}

}  // namespace

// sign: -1 for faces with the glass behind them, 1 for those with the glass in front.
GhostWalk::Normal GhostWalk::outward_at_rim(const Face& face, double sign) {
  const double slope = face.curvature * face.clear_radius_mm;
  return {-sign * slope, sign * std::sqrt(std::max(0.0, 1 - slope * slope))};
}

GhostWalk::Normal GhostWalk::halfway(const Normal& a, const Normal& b) {
  const double radial = a.radial + b.radial, axial = a.axial + b.axial;
  const double length = std::sqrt(radial * radial + axial * axial);
  return {radial / length, axial / length};
}

void GhostWalk::add_body(const Element& element, std::size_t f, const Motion& placement) {
  const Face &front = element.faces[f], &back = element.faces[f + 1];
  const double front_rim = front.z_mm + sag_of_rim(front), back_rim = back.z_mm + sag_of_rim(back);
  const bool front_is_narrow = front.clear_radius_mm < back.clear_radius_mm;
  const double radius = std::max(front.clear_radius_mm, back.clear_radius_mm);
  const double low_z = std::min(front.z_mm, front_rim), high_z = std::max(back.z_mm, back_rim);
  bodies_.push_back({placement, low_z, high_z, radius});

  Edge edge;
  edge.gap = static_cast<int>(surfaces_.size());
  edge.origin = placement.translation;
  edge.axis = placement.direction({0, 0, 1});
  edge.index = front.index_after;
  edge.radius = radius;
  edge.low_z = front_rim;
  edge.high_z = back_rim;
  edge.ring_z = front_is_narrow ? front_rim : back_rim;
  edge.ring_inner_radius = std::min(front.clear_radius_mm, back.clear_radius_mm);
  const Normal front_face = outward_at_rim(front, -1), back_face = outward_at_rim(back, 1);
  const Normal cylinder{1, 0}, ring{0, front_is_narrow ? -1.0 : 1.0};
  edge.ring_faces_image = !front_is_narrow;
  edge.ring_inner = halfway(front_is_narrow ? front_face : back_face, ring);
  edge.ring_outer = halfway(ring, cylinder);
  edge.cylinder_low = halfway(cylinder, front_is_narrow ? ring : front_face);
  edge.cylinder_high = halfway(cylinder, front_is_narrow ? back_face : ring);
  const Vec3 low = placement.point({0, 0, low_z}), high = placement.point({0, 0, high_z});
  const double reach = radius * std::sqrt(std::max(0.0, 1 - square(edge.axis.z))) + kNearest;
  edge.nearest_z = std::min(low.z, high.z) - reach;
  edge.farthest_z = std::max(low.z, high.z) + reach;
  edges_.push_back(edge);
}

void GhostWalk::set(const Assembly& assembly) {
  const Prescription& lens = assembly.lens();
  surfaces_.clear();
  edges_.clear();
  stops_.clear();
  bodies_.clear();
  has_barrel_ = lens.barrel.has_value();
  if (has_barrel_) {
    bore_radius2_ = square(lens.barrel->bore_radius_mm);
    front_z_ = lens.barrel->from_z_mm;
    rim_z_ = lens.barrel->to_z_mm;
  }
  double passed = -1e300;
  const auto pass_stops_before = [&](double z) {
    while (true) {
      const Stop* next = nullptr;
      for (const Stop& stop : lens.stops)
        if (stop.z_mm < z && stop.z_mm > passed && (!next || stop.z_mm < next->z_mm)) next = &stop;
      if (!next) return;
      Surface surface;
      surface.is_stop = true;
      surface.vertex = {0, 0, next->z_mm};
      surface.axis = {0, 0, 1};
      surface.clear_radius2 = square(next->opening_radius_mm);
      stops_.push_back(static_cast<int>(surfaces_.size()));
      surfaces_.push_back(surface);
      passed = next->z_mm;
    }
  };
  for (std::size_t e = 0; e < lens.elements.size(); ++e) {
    const Element& element = lens.elements[e];
    const Motion& placement = assembly.placement(e);
    // As for images: a stop at an element's last vertex or behind it comes after the element.
    pass_stops_before(element.faces.back().z_mm);
    double index = 1;
    for (std::size_t f = 0; f < element.faces.size(); ++f) {
      const Face& face = element.faces[f];
      Surface surface;
      surface.vertex = placement.point({0, 0, face.z_mm});
      surface.axis = placement.direction({0, 0, 1});
      surface.curvature = face.curvature;
      surface.clear_radius2 = square(face.clear_radius_mm);
      surface.index_front = index;
      surface.index_back = index = face.index_after;
      surfaces_.push_back(surface);
      if (f + 1 < element.faces.size()) add_body(element, f, placement);
    }
  }
  pass_stops_before(1e300);
  for (Edge& edge : edges_)
    for (const int stop : stops_) {
      const double z = surfaces_[static_cast<std::size_t>(stop)].vertex.z;
      if (z > edge.nearest_z && z < edge.farthest_z) edge.holds_stop = true;
    }
}

}  // namespace relign::optics
