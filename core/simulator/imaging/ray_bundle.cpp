#include "imaging/ray_bundle.h"

#include <algorithm>
#include <cmath>

#include "optics/first_order.h"
#include "optics/ray_block.h"
#include "optics/trace.h"

namespace relign::imaging {
namespace {

constexpr double kReach = 3;        // largest semi-diameters
constexpr int kCellsPerRadius = 4;  // of the paraxial pupil, in the search for passing rays
constexpr double kFirstWindow = 2;  // paraxial radii
constexpr int kSensorRounds = 4;    // towards a warped sensor; each leaves a hundredth of the distance, or less

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
      wavelength_nm_(wavelength_nm > 0 ? wavelength_nm : scene.lens.wavelength_nm),
      lanes_(assembly) {}

RayBundle::Light RayBundle::at(double u_mm, double v_mm, bool fresnel) const {
  const optics::Vec3 way = optics::Vec3{u_mm, v_mm, pupil_z_} - start_;
  if (!(way.z > 0)) return {};
  const optics::TracedRay ray = optics::trace(assembly_, {start_, way}, optics::Apertures::mesh);
  if (!ray.passed) return {};
  return light_of(way, ray.hits.back(), ray.exit_direction, ray.path_to_last_mm, fresnel ? ray.transmittance : 1);
}

void RayBundle::at_each(const double* u_mm, const double* v_mm, int count, bool fresnel, Light* lights) const {
  optics::RayLanes rays;
  for (int i = 0; i < count; ++i) {
    const optics::Vec3 way = optics::Vec3{u_mm[i], v_mm[i], pupil_z_} - start_;
    rays.x[i] = start_.x;
    rays.y[i] = start_.y;
    rays.z[i] = start_.z;
    rays.dx[i] = way.x;
    rays.dy[i] = way.y;
    rays.dz[i] = way.z;
  }
  lanes_.trace(rays, count, *optics::block_kernels().lanes);
  for (int i = 0; i < count; ++i) {
    lights[i] = {};
    if (!(rays.alive[i] > 0)) continue;
    const optics::Vec3 way = optics::Vec3{u_mm[i], v_mm[i], pupil_z_} - start_;
    lights[i] = light_of(way, {rays.x[i], rays.y[i], rays.z[i]}, {rays.dx[i], rays.dy[i], rays.dz[i]}, rays.path_mm[i],
                         fresnel ? rays.transmittance[i] : 1);
  }
}

RayBundle::Light RayBundle::light_of(const optics::Vec3& way, const optics::Vec3& last_in_lens,
                                     const optics::Vec3& direction, double path_mm, double transmittance) const {
  Light light;
  if (!passes_bore(last_in_lens, direction)) return light;
  const optics::Vec3 last = to_world_.point(last_in_lens);
  const optics::Vec3 out = to_world_.direction(direction);
  if (!(out.z > 0)) return light;
  double on = 0;
  double z = scene_.sensor.z_mm, before = 0;
  for (int round = 0; round < kSensorRounds && z != before; ++round) {
    on = (z - last.z) / out.z;
    light.x_mm = last.x + on * out.x;
    light.y_mm = last.y + on * out.y;
    before = z;
    z = scene_.sensor.z_at(light.x_mm, light.y_mm);
  }
  light.p = out.x;
  light.q = out.y;
  light.path_mm = path_mm + on;
  // An emitter of uniform radiance: light is proportional to the projected solid angle.
  const double length2 = optics::dot(way, way);
  const double off_the_emitter = to_world_.direction(way).z;
  light.weight = std::max(0.0, off_the_emitter) * way.z / (length2 * length2) * transmittance;
  return light;
}

bool RayBundle::passes_bore(const optics::Vec3& last, const optics::Vec3& direction) const {
  const auto& barrel = assembly_.lens().barrel;
  if (!barrel) return true;
  const double on = (barrel->to_z_mm - last.z) / direction.z;
  const double x = last.x + on * direction.x, y = last.y + on * direction.y;
  return x * x + y * y <= barrel->bore_radius_mm * barrel->bore_radius_mm;
}

Window passing_window(const RayBundle& bundle, const PupilAim& aim) {
  const double cell = aim.radius_mm / kCellsPerRadius, reach = aim.reach_mm;
  for (double half = std::min(kFirstWindow * aim.radius_mm, reach);; half = std::min(2 * half, reach)) {
    const int most = static_cast<int>(std::ceil(half / cell));
    Window found{1e300, -1e300, 1e300, -1e300};
    const int side = 2 * most + 1, all = side * side;
    for (int from = 0; from < all; from += optics::kLanes) {
      const int count = std::min(optics::kLanes, all - from);
      double u[optics::kLanes], v[optics::kLanes];
      for (int k = 0; k < count; ++k) {
        u[k] = ((from + k) / side - most) * cell;
        v[k] = ((from + k) % side - most) * cell;
      }
      RayBundle::Light lights[optics::kLanes];
      bundle.at_each(u, v, count, false, lights);
      for (int k = 0; k < count; ++k)
        if (lights[k].weight > 0)
          found = {std::min(found.low_u, u[k]), std::max(found.high_u, u[k]), std::min(found.low_v, v[k]),
                   std::max(found.high_v, v[k])};
    }
    const double rim = (most - 0.5) * cell;
    const bool inside =
        found.low_u > -rim && found.high_u < rim && found.low_v > -rim && found.high_v < rim && found.low_u < 1e300;
    if (inside || half >= reach)
      return {found.low_u - cell, found.high_u + cell, found.low_v - cell, found.high_v + cell};
  }
}

}  // namespace relign::imaging
