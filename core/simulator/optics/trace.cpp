#include "optics/trace.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "optics/face_shape.h"
#include "optics/first_order.h"

namespace relign::optics {
namespace {

// A ray in lens coordinates.
struct RayState {
  Vec3 at;
  Vec3 direction;  // unit
  double transmittance = 1;
  double optical_path_mm = 0;
};

std::string face_name(const Element& element, std::size_t face) {
  if (element.faces.size() == 1) return element.name;
  if (face == 0) return element.name + " front";
  if (face + 1 == element.faces.size()) return element.name + " back";
  return element.name + " face " + std::to_string(face + 1);
}

// Returns the reason why the ray is lost, or empty.
std::string refract(RayState& ray, const Face& face, const FaceBounds& bounds, double index_before,
                    const Motion& placement, Apertures apertures, double stop_radius, Vec3& hit_in_lens) {
  const Motion into = inverse(placement);
  const Vec3 p = into.point(ray.at) - Vec3{0, 0, face.z_mm};
  const Vec3 l = into.direction(ray.direction);
  const std::optional<FacePoint> met = intersect(face, bounds, p, l);
  if (!met)
    return apertures == Apertures::mesh && !face.is_conic() ? "misses the face within its clear aperture"
                                                            : "misses the face";
  const Vec3 normal = index_before < 0 ? -1.0 * met->normal : met->normal;  // along the light
  const double cosine = dot(l, normal);
  if (!(cosine > 0)) return "misses the face";
  const Vec3& hit = met->at;
  if (apertures != Apertures::none) {
    const double clear = face.clear_radius(apertures);
    if (hit.x * hit.x + hit.y * hit.y > clear * clear) return "outside the clear aperture";
  }
  if (hit.x * hit.x + hit.y * hit.y > stop_radius * stop_radius) return "outside the opening of its stop";
  const double before = std::fabs(index_before), behind = std::fabs(face.index_after), ratio = before / behind;
  const double refracted = 1 - ratio * ratio * (1 - cosine * cosine);
  if (!(refracted > 0)) return "total reflection";
  const double cosine_behind = std::sqrt(refracted);
  const double across = (before * cosine - behind * cosine_behind) / (before * cosine + behind * cosine_behind);
  const double along = (before * cosine_behind - behind * cosine) / (before * cosine_behind + behind * cosine);
  if (!face.mirror) ray.transmittance *= 1 - (across * across + along * along) / 2;
  const double g = face.mirror ? -2 * cosine : cosine_behind - ratio * cosine;
  const Vec3 turned = ratio * l + g * normal;
  hit_in_lens = placement.point(hit + Vec3{0, 0, face.z_mm});
  ray.optical_path_mm += before * dot(hit_in_lens - ray.at, ray.direction);
  ray.at = hit_in_lens;
  ray.direction = placement.direction(turned);
  return "";
}

Vec3 at_plane(const RayState& ray, double z) { return ray.at + ((z - ray.at.z) / ray.direction.z) * ray.direction; }

}  // namespace

TracedRay trace(const Assembly& assembly, const Ray& start, Apertures apertures) {
  const Prescription& lens = assembly.lens();
  TracedRay result;
  RayState ray{start.start, unit(start.direction)};
  if (!(ray.direction.z > 0)) {
    result.lost_at = "the start: the ray must travel towards +z";
    return result;
  }
  const auto blocks_rays = [&](const Stop& stop) {
    return apertures == Apertures::mesh || (apertures == Apertures::listing && stop.in_listing);
  };
  const auto pass_stops_before = [&](std::size_t face) -> bool {
    for (const Stop& stop : lens.stops) {
      if (stop.on_face || !blocks_rays(stop) || lens.faces_before(stop) != face) continue;
      const Vec3 hit = at_plane(ray, stop.z_mm);
      if (hit.x * hit.x + hit.y * hit.y > stop.opening_radius_mm * stop.opening_radius_mm) {
        result.lost_at = stop.name + ": outside the opening";
        return false;
      }
    }
    return true;
  };
  const auto stop_on = [&](std::size_t face) {
    double radius = 1e300;
    for (const Stop& stop : lens.stops)
      if (stop.on_face && blocks_rays(stop) && *stop.before_face == face)
        radius = std::min(radius, stop.opening_radius_mm);
    return radius;
  };
  double index = 1;
  std::size_t number = 0;  // of the face, over all elements
  for (std::size_t e = 0; e < lens.elements.size(); ++e) {
    const Element& element = lens.elements[e];
    for (std::size_t f = 0; f < element.faces.size(); ++f, ++number) {
      if (!pass_stops_before(number)) return result;
      Vec3 hit;
      const std::string lost = refract(ray, element.faces[f], assembly.bounds(e, f, apertures), index,
                                       assembly.placement(e), apertures, stop_on(number), hit);
      if (!lost.empty()) {
        result.lost_at = face_name(element, f) + ": " + lost;
        return result;
      }
      result.hits.push_back(hit);
      index = element.faces[f].index_after;
    }
  }
  if (!pass_stops_before(number)) return result;
  if (!(index * ray.direction.z > 0)) {
    result.lost_at = std::string("behind the last face: the ray does not travel towards ") + (index < 0 ? "-z" : "+z");
    return result;
  }
  result.passed = true;
  result.image = at_plane(ray, lens.image_z_mm);
  result.exit_direction = ray.direction;
  result.transmittance = ray.transmittance;
  result.path_to_last_mm = ray.optical_path_mm;
  result.optical_path_mm = ray.optical_path_mm + dot(result.image - ray.at, ray.direction);
  return result;
}

Ray chief_ray(const Prescription& lens, double field_deg) {
  const SineCosine field = sine_cosine_of_degrees(field_deg);
  const double start_z = lens.elements.front().faces.front().z_mm - 1;
  const double height = -(first_order(lens).entrance_pupil_z - start_z) * field.sine / field.cosine;
  return {{0, height, start_z}, {0, field.sine, field.cosine}};
}

double distortion(const Prescription& lens, double field_deg) {
  const TracedRay traced = trace(Assembly(lens), chief_ray(lens, field_deg), Apertures::none);
  if (!traced.passed)
    throw Error(ErrorKind::bad_input, "the chief ray at " + shortest(field_deg) + " degrees does not pass '" +
                                          lens.name + "': " + traced.lost_at);
  // The paraxial chief ray leaves the centre of the exit pupil; it crosses the focal plane at f tan(field) and the
  // image plane in proportion to the distances.
  const FirstOrder data = first_order(lens);
  const SineCosine field = sine_cosine_of_degrees(field_deg);
  const double last = lens.elements.back().faces.back().z_mm;
  const double paraxial = data.focal_length * field.sine / field.cosine * (lens.image_z_mm - data.exit_pupil_z) /
                          (last + data.back_focal_length - data.exit_pupil_z);
  return traced.image.y / paraxial - 1;
}

}  // namespace relign::optics
