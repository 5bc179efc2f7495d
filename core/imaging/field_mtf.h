// How fine lines a lens as built carries, at points of the field: its geometric MTF, from rays in double.
//
// For judging lenses against a specification. It is of the lens alone: no noise, no diffraction, no pixels, none of the
// light that faces reflect. What images show has the pixel's and the target's share besides (pixels/measures.h).
#pragma once

#include <array>
#include <vector>

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

class FieldMtfMeter {
 public:
  // `scene` outlives it. fresnel: rays are weighed by what uncoated faces let through.
  FieldMtfMeter(const SceneFile& scene, bool fresnel);

  // Where light of a field point meets the sensor's plane (also beside the sensor): of waves of lp_per_mm along the
  // radial direction and across it the modulation that is left, the lower one. 0 where no light arrives. A pure
  // function of its arguments.
  FieldMtf measure(const optics::Assembly& assembly, const std::vector<double>& true_pose, double lp_per_mm) const;
  double measure_at(const FieldPoint& point, const optics::Assembly& assembly, const std::vector<double>& true_pose,
                    double lp_per_mm) const;

 private:
  const SceneFile* scene_;
  bool fresnel_;
  std::array<FieldPoint, 5> points_;
  double pupil_z_ = 0;       // lens coordinates; rays are aimed at this plane
  double pupil_radius_ = 0;  // as first order has it
  double reach_ = 0;         // no ray farther off the axis can pass
};

}  // namespace relign::imaging
