#include "optics/ghost_walk.h"

#include <algorithm>
#include <cmath>

#include "optics/elementary.h"

namespace relign::optics {
namespace {

constexpr double kNever = 1e300;
constexpr int kNothing = -1, kAbsorbed = -2;

// Of uncoated glass, averaged over both polarisations; cosines positive, ratio = index before / after.
double unpolarised_reflectance(double cosine, double cosine_after, double ratio) {
  const double s_below = ratio * cosine + cosine_after, p_below = cosine + ratio * cosine_after;
  const double s = (ratio * cosine - cosine_after) * p_below, p = (cosine - ratio * cosine_after) * s_below;
  const double below = s_below * p_below;
  return 0.5 * (s * s + p * p) / (below * below);
}

}  // namespace

bool GhostWalk::in_bore(const Vec3& at, const Vec3& direction) const {
  if (!has_barrel_) return true;
  // In front of the rim a place must be within the bore; behind it, the ray must cross the rim there.
  const double t = at.z > rim_z_ ? (rim_z_ - at.z) / direction.z : 0;
  return square(at.x + t * direction.x) + square(at.y + t * direction.y) < bore_radius2_;
}

bool GhostWalk::enter_from_image(const Vec3& at, const Vec3& direction, WalkingRay& ray) const {
  ray = {at, direction, static_cast<int>(surfaces_.size()), 0, false, -1};
  return direction.z < 0 && in_bore(at, direction);
}

bool GhostWalk::leaves_to_image(const WalkingRay& ray, const Vec3& at) const { return in_bore(at, ray.direction); }

// Only this function, the next two and arrive() depend on the shape of a face. Vertex form as in block_kernels.cpp.
bool GhostWalk::intersect(const Surface& surface, const WalkingRay& ray, double& distance) {
  const Vec3 p = ray.at - surface.vertex;
  const double c = surface.curvature;
  const double forward = dot(ray.direction, surface.axis);
  if (ray.to_image ? forward <= 0 : forward >= 0) return false;
  const double e = -dot(p, ray.direction);
  const Vec3 m = p + e * ray.direction;
  const double f = c * dot(m, m) - 2 * dot(m, surface.axis);
  const double discriminant = forward * forward - c * f;
  if (!(discriminant > 0)) return false;
  const double cosine = forward > 0 ? std::sqrt(discriminant) : -std::sqrt(discriminant);
  distance = e + f / (forward + cosine);
  if (!(distance > kNearest)) return false;
  const Vec3 hit = p + distance * ray.direction;
  return dot(hit, hit) - square(dot(hit, surface.axis)) < surface.clear_radius2;
}

// On the concave side of a face: the other end of the chord, if it is on the face and not on the rest of the sphere.
bool GhostWalk::intersect_again(const Surface& surface, const WalkingRay& ray, double& distance) {
  const double c = surface.curvature;
  if (c == 0) return false;
  const Vec3 p = ray.at - surface.vertex;
  distance = 2 * dot(ray.direction, surface.axis - c * p) / c;
  if (!(distance > kNearest)) return false;
  const Vec3 hit = p + distance * ray.direction;
  const double height = dot(hit, surface.axis);
  return c * height < 1 && dot(hit, hit) - height * height < surface.clear_radius2;
}

void GhostWalk::nearest_on_face(const Surface& surface, int number, const WalkingRay& ray, Found& found) {
  const Vec3 p = ray.at - surface.vertex;
  const double c = surface.curvature;
  const double forward = dot(ray.direction, surface.axis);
  const double e = -dot(p, ray.direction);
  const Vec3 m = p + e * ray.direction;
  const double f = c * dot(m, m) - 2 * dot(m, surface.axis);
  const double discriminant = forward * forward - c * f;
  if (!(discriminant > 0)) return;
  const double root = std::sqrt(discriminant);
  for (const double below : {forward + root, forward - root}) {
    const double distance = e + f / below;  // the second of a plane is infinite or NaN, and rejected
    if (!(distance > kNearest && distance < found.distance)) continue;
    const Vec3 hit = p + distance * ray.direction;
    const double height = dot(hit, surface.axis);
    if (c * height < 1 && dot(hit, hit) - height * height < surface.clear_radius2) found = {distance, number, {}, {}};
  }
}

void GhostWalk::nearest_on_edge(const Edge& edge, int number, const WalkingRay& ray, Found& found) {
  const Vec3 p = ray.at - edge.origin;
  const double height = dot(p, edge.axis), forward = dot(ray.direction, edge.axis);
  const Vec3 across = p - height * edge.axis, along = ray.direction - forward * edge.axis;
  // Interpolates between the normals `a` and `b`; `radial` is the direction away from the axis.
  const auto between = [&](const Normal& a, const Normal& b, double share, const Vec3& radial) {
    return unit(((1 - share) * a.radial + share * b.radial) * radial +
                ((1 - share) * a.axial + share * b.axial) * edge.axis);
  };
  const double to_ring = (edge.ring_z - height) / forward;
  if (to_ring > kNearest && to_ring < found.distance) {
    const Vec3 place = across + to_ring * along;
    const double radius = std::sqrt(dot(place, place));
    if (radius > edge.ring_inner_radius && radius < edge.radius) {
      const double share = (radius - edge.ring_inner_radius) / (edge.radius - edge.ring_inner_radius);
      found = {to_ring, number, between(edge.ring_inner, edge.ring_outer, share, (1 / radius) * place),
               (edge.ring_faces_image ? 1.0 : -1.0) * edge.axis};
    }
  }
  const double a = dot(along, along), b = dot(across, along), c = dot(across, across) - square(edge.radius);
  const double discriminant = b * b - a * c;
  if (!(a > 0 && discriminant > 0)) return;
  const double root = std::sqrt(discriminant);
  for (const double distance : {(-b - root) / a, (-b + root) / a}) {
    const double z = height + distance * forward;
    if (!(distance > kNearest && distance < found.distance && z > edge.low_z && z < edge.high_z)) continue;
    const Vec3 radial = (1 / edge.radius) * (across + distance * along);
    const double share = (z - edge.low_z) / (edge.high_z - edge.low_z);
    found = {distance, number, between(edge.cylinder_low, edge.cylinder_high, share, radial), radial};
  }
}

void GhostWalk::nearest_on_stop(const Surface& stop, const WalkingRay& ray, Found& found) {
  const double distance = dot(stop.vertex - ray.at, stop.axis) / dot(ray.direction, stop.axis);
  if (!(distance > kNearest && distance < found.distance)) return;
  const Vec3 crossing = ray.at + distance * ray.direction - stop.vertex;
  if (dot(crossing, crossing) > stop.clear_radius2) found = {distance, kAbsorbed, {}, {}};
}

void GhostWalk::nearest_on_barrel(const WalkingRay& ray, Found& found) const {
  if (!has_barrel_) return;
  const double a = square(ray.direction.x) + square(ray.direction.y);
  const double b = ray.at.x * ray.direction.x + ray.at.y * ray.direction.y;
  const double c = square(ray.at.x) + square(ray.at.y) - bore_radius2_;
  const double discriminant = b * b - a * c;
  if (!(a > 0 && discriminant > 0)) return;
  const double distance = (-b + std::sqrt(discriminant)) / a;
  const double z = ray.at.z + distance * ray.direction.z;
  if (distance < found.distance && z > front_z_ && z < rim_z_) found = {distance, kAbsorbed, {}, {}};
}

// Whether a ray of this length stays in front of a piece of glass or behind it.
bool GhostWalk::out_of_reach(const Edge& edge, const WalkingRay& ray, double distance) {
  const double from = ray.at.z, to = from + distance * ray.direction.z;
  return std::max(from, to) < edge.nearest_z || std::min(from, to) > edge.farthest_z;
}

GhostWalk::Next GhostWalk::search(WalkingRay& ray, AtFace& met) const {
  Found found{kNever, kNothing, {}, {}};
  const int count = static_cast<int>(surfaces_.size());
  if (ray.glass == 0) nearest_on_barrel(ray, found);
  for (const int stop : stops_) nearest_on_stop(surfaces_[static_cast<std::size_t>(stop)], ray, found);
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    const Edge& edge = edges_[k];
    if (ray.glass != 0 ? ray.glass != edge.gap : out_of_reach(edge, ray, found.distance)) continue;
    nearest_on_face(surfaces_[static_cast<std::size_t>(edge.gap - 1)], edge.gap - 1, ray, found);
    nearest_on_face(surfaces_[static_cast<std::size_t>(edge.gap)], edge.gap, ray, found);
    nearest_on_edge(edge, count + static_cast<int>(k), ray, found);
  }
  if (found.surface == kNothing) {
    if (ray.glass != 0) return Next::lost;
    return ray.direction.z < 0 ? Next::object_side : Next::image_side;
  }
  if (found.surface == kAbsorbed) return Next::lost;
  if (found.surface < count) {
    const Surface& surface = surfaces_[static_cast<std::size_t>(found.surface)];
    const Vec3 p = ray.at + found.distance * ray.direction - surface.vertex;
    ray.to_image = dot(ray.direction, surface.axis - surface.curvature * p) > 0;
    ray.gap = ray.to_image ? found.surface : found.surface + 1;
    return arrive(found.surface, ray, found.distance, met);
  }
  const Edge& edge = *edge_of(found.surface);
  met.surface = found.surface;
  met.at = ray.at + found.distance * ray.direction;
  met.normal = found.normal;
  met.is_edge = true;
  met.outward = found.outward;
  weigh(dot(ray.direction, met.normal) < 0 ? 1 / edge.index : edge.index, ray, met);
  return Next::face;
}

void GhostWalk::weigh(double ratio, const WalkingRay& ray, AtFace& met) {
  met.index_ratio = ratio;
  met.cosine = dot(ray.direction, met.normal);
  met.cosine_after = 0;
  met.reflectance = 1;
  const double squared = 1 - ratio * ratio * (1 - met.cosine * met.cosine);
  if (!(squared > 0)) return;
  const double after = std::sqrt(squared);
  met.cosine_after = met.cosine > 0 ? after : -after;
  met.reflectance = unpolarised_reflectance(std::fabs(met.cosine), after, ratio);
}

GhostWalk::Next GhostWalk::arrive(int number, const WalkingRay& ray, double distance, AtFace& met) const {
  const Surface& surface = surfaces_[static_cast<std::size_t>(number)];
  met.surface = number;
  met.is_edge = false;
  met.at = ray.at + distance * ray.direction;
  met.normal = surface.axis - surface.curvature * (met.at - surface.vertex);
  weigh(number == ray.gap ? surface.index_front / surface.index_back : surface.index_back / surface.index_front, ray,
        met);
  return Next::face;
}

bool GhostWalk::meets_stop_in_glass(const WalkingRay& ray, double distance) const {
  bool holds_stop = false;
  for (const Edge& edge : edges_) holds_stop |= edge.gap == ray.glass && edge.holds_stop;
  if (!holds_stop) return false;
  Found found{distance, kNothing, {}, {}};
  for (const int stop : stops_) nearest_on_stop(surfaces_[static_cast<std::size_t>(stop)], ray, found);
  return found.surface == kAbsorbed;
}

GhostWalk::Next GhostWalk::advance(WalkingRay& ray, AtFace& met) const {
  if (ray.gap < 0) return search(ray, met);
  const int count = static_cast<int>(surfaces_.size());
  const Surface* left = ray.left >= 0 ? &surfaces_[static_cast<std::size_t>(ray.left)] : nullptr;
  double again = kNever;
  if (left && !intersect_again(*left, ray, again)) again = kNever;
  while (true) {
    const int number = ray.to_image ? ray.gap : ray.gap - 1;
    if (number < 0 || number >= count)
      return again < kNever || left == nullptr ? search(ray, met) : number < 0 ? Next::object_side : Next::image_side;
    const Surface& surface = surfaces_[static_cast<std::size_t>(number)];
    double distance = 0;
    if (!surface.is_stop) {
      if (!intersect(surface, ray, distance) || again < distance) return search(ray, met);
      if (ray.glass != 0 && meets_stop_in_glass(ray, distance)) return Next::lost;
      return arrive(number, ray, distance, met);
    }
    const double forward = dot(ray.direction, surface.axis);
    distance = dot(surface.vertex - ray.at, surface.axis) / forward;
    if (!(ray.to_image ? forward > 0 : forward < 0) || !(distance > 0) || again < distance) return search(ray, met);
    const Vec3 crossing = ray.at + distance * ray.direction - surface.vertex;
    const double r2 = dot(crossing, crossing);
    if (!(r2 < surface.clear_radius2)) {
      // Directly from a face and within its aperture: no edge in between.
      return left && r2 < left->clear_radius2 ? Next::lost : search(ray, met);
    }
    // A stop does not change the medium: the ray need not be moved.
    ray.gap += ray.to_image ? 1 : -1;
  }
}

const GhostWalk::Edge* GhostWalk::edge_of(int surface) const {
  const int number = surface - static_cast<int>(surfaces_.size());
  return number < 0 ? nullptr : &edges_[static_cast<std::size_t>(number)];
}

void GhostWalk::leave_edge(const Edge& edge, const AtFace& met, WalkingRay& ray) {
  ray.glass = dot(ray.direction, met.outward) < 0 ? edge.gap : 0;
  ray.gap = ray.glass != 0 ? edge.gap : -1;
  ray.to_image = dot(ray.direction, edge.axis) > 0;
  ray.left = -1;
}

void GhostWalk::reflect(const AtFace& met, WalkingRay& ray) const {
  ray.at = met.at;
  ray.direction = ray.direction - (2 * met.cosine) * met.normal;
  if (const Edge* edge = edge_of(met.surface)) {
    leave_edge(*edge, met, ray);
  } else {
    ray.to_image = met.surface != ray.gap;
    ray.left = met.surface;
  }
}

void GhostWalk::refract(const AtFace& met, WalkingRay& ray) const {
  ray.at = met.at;
  ray.direction = met.index_ratio * ray.direction + (met.cosine_after - met.index_ratio * met.cosine) * met.normal;
  if (const Edge* edge = edge_of(met.surface)) {
    leave_edge(*edge, met, ray);
  } else {
    const bool from_front = met.surface == ray.gap;
    const Surface& surface = surfaces_[static_cast<std::size_t>(met.surface)];
    ray.gap = from_front ? ray.gap + 1 : ray.gap - 1;
    ray.glass = (from_front ? surface.index_back : surface.index_front) != 1 ? ray.gap : 0;
    ray.to_image = from_front;
    ray.left = met.surface;
  }
}

}  // namespace relign::optics
