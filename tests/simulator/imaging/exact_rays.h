// Expected values of images from single rays in double: an independent computation without blocks, tiles or samplers.
#pragma once

#include <algorithm>
#include <cmath>

#include "imaging/scene_file.h"
#include "optics/pi.h"
#include "optics/trace.h"

namespace relign::imaging {

using optics::kPi;

// Share of the light that all faces transmit: uncoated glass, unpolarised.
inline double transmittance(const optics::Assembly& assembly, const optics::Ray& start, const optics::TracedRay& ray) {
  const std::vector<optics::Element>& elements = assembly.lens().elements;
  double share = 1, before = 1;
  optics::Vec3 from = start.start, direction = optics::unit(start.direction);
  std::size_t hit = 0;
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (const optics::Face& face : elements[e].faces) {
      const optics::Vec3 at = ray.hits[hit];
      const optics::Vec3 next =
          hit + 1 < ray.hits.size() ? optics::unit(ray.hits[hit + 1] - at) : optics::unit(ray.exit_direction);
      const optics::Vec3 local = optics::inverse(assembly.placement(e)).point(at) - optics::Vec3{0, 0, face.z_mm};
      const optics::Vec3 normal = assembly.placement(e).direction(
          optics::unit({-face.curvature * local.x, -face.curvature * local.y, 1 - face.curvature * local.z}));
      if (hit > 0) direction = optics::unit(at - from);
      const double in = std::fabs(optics::dot(direction, normal)), out = std::fabs(optics::dot(next, normal));
      const double s = (before * in - face.index_after * out) / (before * in + face.index_after * out);
      const double p = (before * out - face.index_after * in) / (before * out + face.index_after * in);
      share *= 1 - (s * s + p * p) / 2;
      before = face.index_after;
      from = at;
      ++hit;
    }
  return share;
}

// The lens seen from behind: z runs from the sensor (0) to the object, which is at image_z_mm.
inline optics::Prescription turned_round(const SceneFile& scene) {
  const optics::Prescription& lens = scene.lens;
  optics::Prescription turned = lens;
  const double sensor_z = scene.sensor.z_mm + scene.pivot_behind_first_vertex_mm;
  turned.elements.clear();
  for (auto element = lens.elements.rbegin(); element != lens.elements.rend(); ++element) {
    optics::Element behind{element->name, {element->faces.rbegin(), element->faces.rend()}};
    for (std::size_t f = 0; f < behind.faces.size(); ++f) {
      optics::Face& face = behind.faces[f];
      face.z_mm = sensor_z - face.z_mm;
      face.curvature = -face.curvature;
      face.r2_term = -face.r2_term;
      for (std::vector<double>* terms : {&face.even_asphere, &face.odd_asphere, &face.over_root})
        for (double& term : *terms) term = -term;
      face.index_after = f + 1 < behind.faces.size() ? behind.faces[f + 1].index_after : 1;
    }
    turned.elements.push_back(behind);
  }
  for (optics::Stop& stop : turned.stops) {
    stop.z_mm = sensor_z - stop.z_mm;
    if (stop.before_face) stop.before_face = lens.face_count() - *stop.before_face - (stop.on_face ? 1 : 0);
  }
  turned.image_z_mm = sensor_z - (scene.emitter.z_mm + scene.pivot_behind_first_vertex_mm);
  return turned;
}

// Irradiance of the sensor `height_mm` off the axis for an endless emitter of radiance 1, perfect lens at the nominal
// pose: the integral of the transmittance over the direction cosines that pass. Apertures leave a star-shaped region:
// every line from its middle crosses its rim once.
inline double exact_irradiance(const optics::Assembly& turned, double height_mm, optics::Apertures apertures,
                               bool fresnel) {
  const auto share = [&](double p, double q) {
    const double r2 = p * p + q * q;
    if (!(r2 < 1)) return 0.0;
    const optics::Ray ray{{0, height_mm, 0}, {p, q, std::sqrt(1 - r2)}};
    const optics::TracedRay traced = optics::trace(turned, ray, apertures);
    if (!traced.passed) return 0.0;
    return fresnel ? transmittance(turned, ray, traced) : 1.0;
  };
  double count = 0, middle_p = 0, middle_q = 0;
  constexpr int kGrid = 60;
  for (int i = -kGrid; i <= kGrid; ++i)
    for (int j = -kGrid; j <= kGrid; ++j) {
      const double p = static_cast<double>(i) / kGrid, q = static_cast<double>(j) / kGrid;
      if (share(p, q) == 0) continue;
      count += 1;
      middle_p += p;
      middle_q += q;
    }
  if (count == 0) return 0;
  middle_p /= count;
  middle_q /= count;
  constexpr int kAzimuths = 180, kRings = 10;
  double sum = 0;
  for (int a = 0; a < kAzimuths; ++a) {
    const optics::SineCosine azimuth = optics::sine_cosine_of_degrees(360.0 * a / kAzimuths);
    const auto at = [&](double r) { return share(middle_p + r * azimuth.cosine, middle_q + r * azimuth.sine); };
    double inside = 0, outside = 1;
    for (int step = 0; step < 30; ++step) {
      const double r = (inside + outside) / 2;
      (at(r) > 0 ? inside : outside) = r;
    }
    for (int ring = 0; ring < kRings; ++ring)  // rings of one area
      sum += at(inside * std::sqrt((ring + 0.5) / kRings)) * inside * inside;
  }
  return sum * kPi / (kAzimuths * kRings);
}

// Visits the rays from a place of the emitter through a lens at a pose: visit(hit on the sensor's plane, world; its
// light). Light of an emitter of radiance 1 is even in the direction cosines: a ray through dA of a plane parallel to
// the emitter carries cos^4 dA, that is dA / length^4, times the transmittance.
template <class Visit>
void for_bundle(const SceneFile& scene, const optics::Assembly& assembly, const std::vector<double>& pose,
                const optics::Vec3& from, const Visit& visit) {
  const optics::Motion to_world = scene.lens_to_world(pose), into_lens = optics::inverse(to_world);
  constexpr double kPupilZ = 5.82, kHalf = 1.6;  // the entrance pupil, with room for its way at the field's edge
  constexpr int kGrid = 60;
  for (int i = -kGrid; i <= kGrid; ++i)
    for (int j = -kGrid; j <= kGrid; ++j) {
      const optics::Vec3 aim = to_world.point({kHalf * i / kGrid, kHalf * j / kGrid, kPupilZ});
      const optics::Vec3 way = aim - from;
      const optics::Ray ray{into_lens.point(from), into_lens.direction(way)};
      const optics::TracedRay traced = optics::trace(assembly, ray, optics::Apertures::mesh);
      if (!traced.passed) continue;
      const optics::Vec3 last = to_world.point(traced.hits.back()), out = to_world.direction(traced.exit_direction);
      const double length2 = optics::dot(way, way);
      visit(last + ((scene.sensor.z_mm - last.z) / out.z) * out,
            transmittance(assembly, ray, traced) / (length2 * length2));
    }
}

struct PixelPlace {
  double x = 0, y = 0;  // 0 = middle of the first column and the top row
};

inline PixelPlace pixel_of(const Sensor& sensor, const optics::Vec3& world) {
  return {(world.x - sensor.left_mm) / sensor.pitch_mm - 0.5, (sensor.top_mm - world.y) / sensor.pitch_mm - 0.5};
}

// Mean hit on the sensor of the light from a point of the emitter.
inline PixelPlace bundle_centroid(const SceneFile& scene, const optics::Assembly& assembly,
                                  const std::vector<double>& pose, const optics::Vec3& from) {
  double sum = 0;
  optics::Vec3 middle;
  for_bundle(scene, assembly, pose, from, [&](const optics::Vec3& hit, double light) {
    sum += light;
    middle = middle + light * hit;
  });
  return pixel_of(scene.sensor, (1 / sum) * middle);
}

}  // namespace relign::imaging
