#include "imaging/ray_bundle.h"

#include <algorithm>
#include <cmath>

#include "optics/first_order.h"
#include "optics/trace.h"

namespace relign::imaging {
namespace {

constexpr double kReach = 3;        // largest semi-diameters
constexpr int kCellsPerRadius = 4;  // of the paraxial pupil, in the search for passing rays
constexpr double kFirstWindow = 2;  // paraxial radii

}  // namespace

double scattered(int cell, int which) {
  constexpr double kSteps[2] = {0.7548776662466927, 0.5698402909980532};  // of the R2 sequence (plastic number)
  const double value = 0.5 + kSteps[which] * cell;
  return value - std::floor(value);
}

PupilAim pupil_aim(const SceneFile& scene) {
  const optics::FirstOrder data = optics::first_order(scene.lens);
  double widest = 0;
  for (const optics::Element& element : scene.lens.elements)
    for (const optics::Face& face : element.faces) widest = std::max(widest, face.clear_radius_mm);
  // If the pupil is far away (telecentric in object space), rays are aimed at the plane of the first vertex.
  const double first_z = scene.lens.elements.front().faces.front().z_mm;
  const bool near = std::fabs(data.entrance_pupil_z - first_z) < 10 * (data.overall_length + widest) &&
                    data.entrance_pupil_diameter > 0;
  PupilAim aim;
  aim.reach_mm = kReach * widest;
  aim.z_mm = near ? data.entrance_pupil_z : first_z;
  aim.radius_mm = std::min(near ? data.entrance_pupil_diameter / 2 : widest, widest);
  return aim;
}

RayBundle::RayBundle(const SceneFile& scene, const optics::Assembly& assembly, const std::vector<double>& true_pose,
                     const std::array<double, 2>& from, double pupil_z, double wavelength_nm)
    : scene_(scene),
      assembly_(assembly),
      to_world_(scene.lens_to_world(true_pose)),
      into_lens_(optics::inverse(to_world_)),
      start_(into_lens_.point({from[0], from[1], scene.emitter.z_mm})),
      pupil_z_(pupil_z),
      wavelength_nm_(wavelength_nm > 0 ? wavelength_nm : scene.lens.wavelength_nm) {}

RayBundle::Light RayBundle::at(double u_mm, double v_mm, bool fresnel) const {
  Light light;
  const optics::Vec3 way = optics::Vec3{u_mm, v_mm, pupil_z_} - start_;
  if (!(way.z > 0)) return light;
  const optics::TracedRay ray = optics::trace(assembly_, {start_, way}, optics::Apertures::mesh);
  if (!ray.passed || !passes_bore(ray.hits.back(), ray.exit_direction)) return light;
  const optics::Vec3 last = to_world_.point(ray.hits.back());
  const optics::Vec3 out = to_world_.direction(ray.exit_direction);
  if (!(out.z > 0)) return light;
  const double on = (scene_.sensor.z_mm - last.z) / out.z;
  light.x_mm = last.x + on * out.x;
  light.y_mm = last.y + on * out.y;
  light.p = out.x;
  light.q = out.y;
  light.path_mm = ray.optical_path_mm - optics::dot(ray.image - ray.hits.back(), ray.exit_direction) + on;
  // An emitter of uniform radiance: light is proportional to the projected solid angle.
  const double length2 = optics::dot(way, way);
  const double off_the_emitter = to_world_.direction(way).z;
  light.weight = std::max(0.0, off_the_emitter) * way.z / (length2 * length2) * (fresnel ? ray.transmittance : 1);
  return light;
}

bool RayBundle::passes_bore(const optics::Vec3& last, const optics::Vec3& direction) const {
  const auto& barrel = assembly_.lens().barrel;
  if (!barrel) return true;
  const double on = (barrel->to_z_mm - last.z) / direction.z;
  const double x = last.x + on * direction.x, y = last.y + on * direction.y;
  return x * x + y * y <= barrel->bore_radius_mm * barrel->bore_radius_mm;
}

Window passing(const RayBundle& bundle, const PupilAim& aim) {
  const double cell = aim.radius_mm / kCellsPerRadius, reach = aim.reach_mm;
  for (double half = std::min(kFirstWindow * aim.radius_mm, reach);; half = std::min(2 * half, reach)) {
    const int most = static_cast<int>(std::ceil(half / cell));
    Window found{1e300, -1e300, 1e300, -1e300};
    for (int i = -most; i <= most; ++i)
      for (int j = -most; j <= most; ++j) {
        if (!bundle.passes(i * cell, j * cell)) continue;
        found = {std::min(found.low_u, i * cell), std::max(found.high_u, i * cell), std::min(found.low_v, j * cell),
                 std::max(found.high_v, j * cell)};
      }
    const double rim = (most - 0.5) * cell;
    const bool inside =
        found.low_u > -rim && found.high_u < rim && found.low_v > -rim && found.high_v < rim && found.low_u < 1e300;
    if (inside || half >= reach)
      return {found.low_u - cell, found.high_u + cell, found.low_v - cell, found.high_v + cell};
  }
}

}  // namespace relign::imaging
