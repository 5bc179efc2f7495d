#include "imaging/field_mtf.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "optics/first_order.h"
#include "optics/trace.h"

namespace relign::imaging {
namespace {

constexpr double kReach = 3;        // largest clear radii
constexpr int kCellsPerRadius = 4;  // of the paraxial pupil, while looking for what passes
constexpr double kFirstWindow = 2;  // paraxial radii
constexpr int kCells = 100;         // a side, over what passes

// An even spread of numbers in 0..1 for the places in cells: rays on an even grid would be a grating, whose modulation
// comes back where the light is spread far.
double scattered(int cell, int which) {
  constexpr double kSteps[2] = {0.7548776662466927, 0.5698402909980532};  // of the R2 sequence (plastic number)
  const double value = 0.5 + kSteps[which] * cell;
  return value - std::floor(value);
}

// The rays of one place of the emitter through a lens at a pose, by where they aim in the pupil's plane.
class Bundle {
 public:
  Bundle(const SceneFile& scene, const optics::Assembly& assembly, const std::vector<double>& true_pose,
         const FieldPoint& point, double pupil_z)
      : scene_(scene),
        assembly_(assembly),
        to_world_(scene.lens_to_world(true_pose)),
        into_lens_(optics::inverse(to_world_)),
        start_(into_lens_.point({point.x_mm, point.y_mm, scene.emitter.z_mm})),
        pupil_z_(pupil_z) {}

  struct Light {
    double x_mm = 0, y_mm = 0;  // where it meets the sensor's plane
    double weight = 0;          // 0: it does not
  };
  Light at(double u_mm, double v_mm, bool fresnel) const {
    Light light;
    const optics::Vec3 way = optics::Vec3{u_mm, v_mm, pupil_z_} - start_;
    if (!(way.z > 0)) return light;
    const optics::TracedRay ray = optics::trace(assembly_, {start_, way}, optics::Apertures::mesh);
    if (!ray.passed || !passes_bore(ray)) return light;
    const optics::Vec3 last = to_world_.point(ray.hits.back());
    const optics::Vec3 out = to_world_.direction(ray.exit_direction);
    if (!(out.z > 0)) return light;
    const double on = (scene_.sensor.z_mm - last.z) / out.z;
    light.x_mm = last.x + on * out.x;
    light.y_mm = last.y + on * out.y;
    // An emitter of one radiance: light goes with the projected solid angle.
    const double length2 = optics::dot(way, way);
    const double off_the_emitter = to_world_.direction(way).z;
    light.weight = std::max(0.0, off_the_emitter) * way.z / (length2 * length2) * (fresnel ? ray.transmittance : 1);
    return light;
  }
  bool passes(double u_mm, double v_mm) const { return at(u_mm, v_mm, false).weight > 0; }

 private:
  bool passes_bore(const optics::TracedRay& ray) const {
    const auto& mount = assembly_.lens().mount;
    if (!mount) return true;
    const optics::Vec3 last = ray.hits.back();
    const double on = (mount->to_z_mm - last.z) / ray.exit_direction.z;
    const double x = last.x + on * ray.exit_direction.x, y = last.y + on * ray.exit_direction.y;
    return x * x + y * y <= mount->bore_radius_mm * mount->bore_radius_mm;
  }

  const SceneFile& scene_;
  const optics::Assembly& assembly_;
  optics::Motion to_world_, into_lens_;
  optics::Vec3 start_;
  double pupil_z_;
};

// Without the C library's sines and hypot, whose last places differ: records are compared between machines.
double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

// Sum of light over a wave's phases.
class Wave {
 public:
  Wave(double direction_x, double direction_y, double lp_per_mm)
      : per_x_(direction_x * lp_per_mm), per_y_(direction_y * lp_per_mm) {}
  void add(const Bundle::Light& light) {
    const double turns = per_x_ * light.x_mm + per_y_ * light.y_mm;
    const optics::SineCosine phase = optics::sine_cosine_of_degrees(360 * (turns - std::floor(turns)));
    cosine_ += light.weight * phase.cosine;
    sine_ += light.weight * phase.sine;
  }
  double length() const { return length_of(cosine_, sine_); }

 private:
  double per_x_, per_y_;
  double cosine_ = 0, sine_ = 0;
};

struct Window {
  double low_u = 0, high_u = 0, low_v = 0, high_v = 0;
};

// What passes, with a cell's width around it. Empty (low_u > high_u) when nothing does.
Window passing(const Bundle& bundle, double radius, double reach) {
  const double cell = radius / kCellsPerRadius;
  for (double half = std::min(kFirstWindow * radius, reach);; half = std::min(2 * half, reach)) {
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

}  // namespace

std::array<FieldPoint, 5> field_points(const SceneFile& scene) {
  const optics::FirstOrder data = optics::first_order(scene.lens);
  const double first_z = scene.lens.elements.front().faces.front().z_mm;
  const double object_z = scene.emitter.z_mm + scene.pivot_behind_first_vertex_mm;  // lens coordinates
  // Newton's equation: sizes go as the focal length to the distance from the front focal point. Upside down.
  const double image_per_object = -data.focal_length / (first_z + data.front_focal_length - object_z);
  const Sensor& sensor = scene.sensor;
  const double half_emitter = scene.emitter.side_mm / 2;
  const auto part = [&](double one_end, double other_end) {
    const double a = one_end / image_per_object, b = other_end / image_per_object;
    return std::pair(std::max(-half_emitter, std::min(a, b)), std::min(half_emitter, std::max(a, b)));
  };
  const auto [left, right] = part(sensor.left_mm, sensor.left_mm + sensor.width * sensor.pitch_mm);
  const auto [low, high] = part(sensor.top_mm, sensor.top_mm - sensor.height * sensor.pitch_mm);
  if (!(left < right && low < high))
    throw Error(ErrorKind::bad_input, "scene '" + scene.name +
                                          "': the sensor sees no part of the target, so that its "
                                          "field has neither a centre nor corners");
  std::array<FieldPoint, 5> points;
  const double x = (left + right) / 2, y = (low + high) / 2;
  points[0] = {x, y, 1, 0};
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const double dx = (corner % 2 ? 0.5 : -0.5) * (right - left), dy = (corner / 2 ? 0.5 : -0.5) * (high - low);
    const double length = length_of(dx, dy);
    points[corner + 1] = {x + kCornerField * dx, y + kCornerField * dy, dx / length, dy / length};
  }
  return points;
}

FieldMtfMeter::FieldMtfMeter(const SceneFile& scene, bool fresnel)
    : scene_(&scene), fresnel_(fresnel), points_(field_points(scene)) {
  const optics::FirstOrder data = optics::first_order(scene.lens);
  double widest = 0;
  for (const optics::Element& element : scene.lens.elements)
    for (const optics::Face& face : element.faces) widest = std::max(widest, face.clear_radius_mm);
  reach_ = kReach * widest;
  // A pupil far away, as of a lens that is telecentric in front: rays are told apart at the first vertex.
  const double first_z = scene.lens.elements.front().faces.front().z_mm;
  const bool near = std::fabs(data.entrance_pupil_z - first_z) < 10 * (data.overall_length + widest) &&
                    data.entrance_pupil_diameter > 0;
  pupil_z_ = near ? data.entrance_pupil_z : first_z;
  pupil_radius_ = std::min(near ? data.entrance_pupil_diameter / 2 : widest, widest);
}

double FieldMtfMeter::measure_at(const FieldPoint& point, const optics::Assembly& assembly,
                                 const std::vector<double>& true_pose, double lp_per_mm) const {
  const Bundle bundle(*scene_, assembly, true_pose, point, pupil_z_);
  const Window window = passing(bundle, pupil_radius_, reach_);
  if (!(window.low_u < window.high_u)) return 0;
  const double per_cell_u = (window.high_u - window.low_u) / kCells;
  const double per_cell_v = (window.high_v - window.low_v) / kCells;
  double light = 0;
  Wave radial(point.radial_x, point.radial_y, lp_per_mm), across(-point.radial_y, point.radial_x, lp_per_mm);
  for (int i = 0; i < kCells; ++i)
    for (int j = 0; j < kCells; ++j) {
      const int cell = i * kCells + j;
      const Bundle::Light ray = bundle.at(window.low_u + (i + scattered(cell, 0)) * per_cell_u,
                                          window.low_v + (j + scattered(cell, 1)) * per_cell_v, fresnel_);
      if (!(ray.weight > 0)) continue;
      light += ray.weight;
      radial.add(ray);
      across.add(ray);
    }
  return light > 0 ? std::min(1.0, std::min(radial.length(), across.length()) / light) : 0;
}

FieldMtf FieldMtfMeter::measure(const optics::Assembly& assembly, const std::vector<double>& true_pose,
                                double lp_per_mm) const {
  FieldMtf mtf;
  mtf.centre = measure_at(points_[0], assembly, true_pose, lp_per_mm);
  mtf.corner = 1;
  for (std::size_t corner = 1; corner < points_.size(); ++corner)
    mtf.corner = std::min(mtf.corner, measure_at(points_[corner], assembly, true_pose, lp_per_mm));
  return mtf;
}

}  // namespace relign::imaging
