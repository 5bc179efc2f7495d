// MTF of a lens as built at points of the field, from rays in double: geometric, or with diffraction at the lens's own
// pupil (wave_pupil.h).
//
// For comparing lenses with a specification. MTF of the lens alone: no noise, no pixels, no stray light. The MTF of
// images also has factors of the pixel and the target (images/measures.h).
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "imaging/ray_bundle.h"
#include "imaging/scene_file.h"
#include "optics/assembly.h"

namespace relign::imaging {

// Position of the field corners, as a fraction of the distance from the centre to the corner of the part of the target
// whose ideal image is on the sensor.
inline constexpr double kCornerField = 0.8;

struct FieldPoint {
  double x_mm = 0, y_mm = 0;          // on the emitter
  double radial_x = 1, radial_y = 0;  // unit: away from the middle of the field; along the rows in the middle itself
};

// The centre of the field, then its four corners. Ideal means without distortion: first-order magnification, which
// depends only on the scene's design. Throws Error(bad_input) if no part of the target is imaged onto the sensor.
std::array<FieldPoint, 5> field_points(const SceneFile& scene);

struct FieldMtf {
  double centre = 0;
  double corner = 0;  // the lowest of the four
};

// For spatial frequencies along the radial direction (tangential lines) and across it (sagittal lines).
struct Modulation {
  double tangential = 0, sagittal = 0;
  double x_mm = std::numeric_limits<double>::quiet_NaN(), y_mm = x_mm;  // centroid of the light; NaN: none arrives
};

class FieldMtfMeter {
 public:
  // `scene` must outlive it. fresnel: weight rays by the transmittance of uncoated faces. diffraction: at the
  // wavelengths of the scene, or that of the lens file. cells: rays a side of the pupil's window, without diffraction.
  FieldMtfMeter(const SceneFile& scene, bool fresnel, bool diffraction = false, int cells = 100);

  // MTF of a field point in the sensor's plane (also beside the sensor) at lp_per_mm: the lower of the radial direction
  // and across it. 0 if no light arrives. For several wavelengths the transfer functions are added with their phases,
  // by weight and transmittance. A pure function of its arguments. assembly: at the lens's own wavelength.
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
  int cells_;
  std::array<FieldPoint, 5> points_;
  PupilAim aim_;
};

}  // namespace relign::imaging
