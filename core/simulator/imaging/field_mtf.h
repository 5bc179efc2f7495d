// How fine lines a lens as built carries, at points of the field: its MTF, from rays in double. Geometric, or with the
// diffraction at the lens's own pupil (wave_pupil.h).
//
// For judging lenses against a specification. It is of the lens alone: no noise, no pixels, none of the light that
// faces reflect. What images show has the pixel's and the target's share besides (pixels/measures.h).
#pragma once

#include <array>
#include <vector>

#include "imaging/ray_bundle.h"
#include "imaging/scene_file.h"
#include "optics/assembly.h"

namespace relign::imaging {

// How far out the corners of the field lie: of the way from the middle to the corner of the part of the target whose
// ideal image lies on the sensor.
inline constexpr double kCornerField = 0.8;

struct FieldPoint {
  double x_mm = 0, y_mm = 0;          // on the emitter
  double radial_x = 1, radial_y = 0;  // unit: away from the middle of the field; along the rows in the middle itself
};

// The middle of the field, then its four corners. Ideal means without distortion: magnified as first order does, which
// depends on the scene's design alone. Throws Error(bad_input) when the sensor's part of the target is empty.
std::array<FieldPoint, 5> field_points(const SceneFile& scene);

struct FieldMtf {
  double centre = 0;
  double corner = 0;  // the lowest of the four
};

// Of waves along the radial direction (tangential lines) and across it (sagittal lines).
struct Modulation {
  double tangential = 0, sagittal = 0;
};

class FieldMtfMeter {
 public:
  // `scene` outlives it. fresnel: rays are weighed by what uncoated faces let through. diffraction: at the wavelengths
  // of the scene, or the one of the lens file.
  FieldMtfMeter(const SceneFile& scene, bool fresnel, bool diffraction = false);

  // Where light of a field point meets the sensor's plane (also beside the sensor): of waves of lp_per_mm along the
  // radial direction and across it the modulation that is left, the lower one. 0 where no light arrives. Where the
  // scene has several wavelengths, waves of all of them are added with their phases, by weight and transmittance. A
  // pure function of its arguments. assembly: at the lens's own wavelength.
  FieldMtf measure(const optics::Assembly& assembly, const std::vector<double>& true_pose, double lp_per_mm) const;
  double measure_at(const FieldPoint& point, const optics::Assembly& assembly, const std::vector<double>& true_pose,
                    double lp_per_mm) const;
  // Both directions; measure_at is the lower one.
  Modulation modulation_at(const FieldPoint& point, const optics::Assembly& assembly,
                           const std::vector<double>& true_pose, double lp_per_mm) const;

 private:
  Modulation of_all_wavelengths(const FieldPoint& point, const optics::Assembly& assembly,
                                const std::vector<double>& true_pose, double lp_per_mm) const;
  const SceneFile* scene_;
  bool fresnel_, diffraction_;
  std::array<FieldPoint, 5> points_;
  PupilAim aim_;
};

}  // namespace relign::imaging
