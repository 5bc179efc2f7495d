#include "imaging/field_mtf.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "imaging/mounted_lens.h"
#include "imaging/ray_bundle.h"
#include "imaging/wave_pupil.h"
#include "optics/first_order.h"

namespace relign::imaging {
namespace {

// Avoids the C library's hypot, whose last digits differ between machines: records are compared between them.
double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

// Sum of light over a wave's phases.
class Wave {
 public:
  Wave(double direction_x, double direction_y, double lp_per_mm)
      : per_x_(direction_x * lp_per_mm), per_y_(direction_y * lp_per_mm) {}
  void add(const RayBundle::Light& light) {
    const double turns = per_x_ * light.x_mm + per_y_ * light.y_mm;
    const optics::SineCosine phase = optics::sine_cosine_of_degrees(360 * (turns - std::floor(turns)));
    sum_.cosine += light.weight * phase.cosine;
    sum_.sine += light.weight * phase.sine;
  }
  const WavePupil::Transfer& sum() const { return sum_; }

 private:
  double per_x_, per_y_;
  WavePupil::Transfer sum_;
};

// For frequencies along the radial direction and across it.
struct Transfers {
  double light = 0;
  double moment_x = 0, moment_y = 0;  // of the light, mm
  WavePupil::Transfer radial, across;

  void add(const Transfers& other, double factor) {
    light += factor * other.light;
    moment_x += factor * other.moment_x;
    moment_y += factor * other.moment_y;
    for (const auto member : {&Transfers::radial, &Transfers::across}) {
      (this->*member).cosine += factor * (other.*member).cosine;
      (this->*member).sine += factor * (other.*member).sine;
    }
  }
  Modulation modulation() const {
    if (!(light > 0)) return {};
    return {std::min(1.0, length_of(radial.cosine, radial.sine) / light),
            std::min(1.0, length_of(across.cosine, across.sine) / light), moment_x / light, moment_y / light};
  }
};

// By rays, one a cell of the window: in units of a cell's light.
Transfers geometric(const FieldPoint& point, const RayBundle& bundle, const Window& window, double lp_per_mm,
                    bool fresnel, int cells) {
  const double per_cell_u = (window.high_u - window.low_u) / cells;
  const double per_cell_v = (window.high_v - window.low_v) / cells;
  double light = 0, moment_x = 0, moment_y = 0;
  Wave radial(point.radial_x, point.radial_y, lp_per_mm), across(-point.radial_y, point.radial_x, lp_per_mm);
  for (int from = 0; from < cells * cells; from += optics::kLanes) {
    const int count = std::min(optics::kLanes, cells * cells - from);
    double u[optics::kLanes], v[optics::kLanes];
    for (int k = 0; k < count; ++k) {
      const int cell = from + k;
      u[k] = window.low_u + (cell / cells + scattered(cell, 0)) * per_cell_u;
      v[k] = window.low_v + (cell % cells + scattered(cell, 1)) * per_cell_v;
    }
    RayBundle::Light rays[optics::kLanes];
    bundle.at_each(u, v, count, fresnel, rays);
    for (int k = 0; k < count; ++k) {
      const RayBundle::Light& ray = rays[k];
      if (!(ray.weight > 0)) continue;
      light += ray.weight;
      moment_x += ray.weight * ray.x_mm;
      moment_y += ray.weight * ray.y_mm;
      radial.add(ray);
      across.add(ray);
    }
  }
  return {light, moment_x, moment_y, radial.sum(), across.sum()};
}

}  // namespace

std::array<FieldPoint, 5> field_points(const SceneFile& scene) {
  const optics::FirstOrder data = optics::first_order(scene.lens);
  const double first_z = scene.lens.elements.front().faces.front().z_mm;
  const double object_z = scene.emitter.z_mm + scene.pivot_behind_first_vertex_mm;  // lens coordinates
  // Newton's equation: the magnification is the focal length over the distance from the front focal point. Inverted.
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
                                          "': no part of the target is imaged onto the sensor, so that "
                                          "the field has no centre and no corners; check sensor and emitter");
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

FieldMtfMeter::FieldMtfMeter(const SceneFile& scene, bool fresnel, bool diffraction, int cells)
    : scene_(&scene),
      fresnel_(fresnel),
      diffraction_(diffraction),
      cells_(cells),
      points_(field_points(scene)),
      aim_(pupil_aim(scene)) {}

Modulation FieldMtfMeter::modulation_at(const FieldPoint& point, const optics::Assembly& assembly,
                                        const std::vector<double>& true_pose, double lp_per_mm) const {
  if (!scene_->wavelengths.empty()) return of_all_wavelengths(point, assembly, true_pose, lp_per_mm);
  const RayBundle bundle(*scene_, assembly, true_pose, {point.x_mm, point.y_mm}, aim_.z_mm);
  const Window window = passing_window(bundle, aim_);
  if (!(window.low_u < window.high_u)) return {};
  Modulation found = geometric(point, bundle, window, lp_per_mm, fresnel_, cells_).modulation();
  if (diffraction_) {
    const WavePupil pupil(bundle, window, fresnel_, {point.radial_x, point.radial_y});
    const double light = pupil.light();
    found.tangential = pupil.modulation(lp_per_mm, WavePupil::along, light);
    found.sagittal = pupil.modulation(lp_per_mm, WavePupil::across, light);
  }
  return found;
}

Modulation FieldMtfMeter::of_all_wavelengths(const FieldPoint& point, const optics::Assembly& assembly,
                                             const std::vector<double>& true_pose, double lp_per_mm) const {
  const std::vector<optics::Assembly> lenses = at_wavelengths(*scene_, assembly);
  Transfers sum, rays;
  std::optional<std::array<double, 2>> origin;
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    const double weight = scene_->wavelengths[i].weight;
    const RayBundle bundle(*scene_, lenses[i], true_pose, {point.x_mm, point.y_mm}, aim_.z_mm,
                           scene_->wavelengths[i].lens.wavelength_nm);
    const Window window = passing_window(bundle, aim_);
    if (!(window.low_u < window.high_u)) continue;
    const double area = (window.high_u - window.low_u) * (window.high_v - window.low_v);
    rays.add(geometric(point, bundle, window, lp_per_mm, fresnel_, cells_), weight * area);
    if (!diffraction_) continue;
    WavePupil pupil(bundle, window, fresnel_, {point.radial_x, point.radial_y});
    if (!origin) origin = pupil.origin();
    pupil.set_origin(*origin);
    sum.add({pupil.light(), 0, 0, pupil.transfer(lp_per_mm, WavePupil::along),
             pupil.transfer(lp_per_mm, WavePupil::across)},
            weight);
  }
  Modulation found = rays.modulation();
  if (diffraction_) {
    const Modulation waves = sum.modulation();
    found.tangential = waves.tangential;
    found.sagittal = waves.sagittal;
  }
  return found;
}

double FieldMtfMeter::measure_at(const FieldPoint& point, const optics::Assembly& assembly,
                                 const std::vector<double>& true_pose, double lp_per_mm) const {
  const Modulation found = modulation_at(point, assembly, true_pose, lp_per_mm);
  return std::min(found.tangential, found.sagittal);
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
