// The rays from one point of the emitter through a lens at a pose, in double, parametrised by their target in the plane
// of the entrance pupil. Basis of field_mtf.h and wave_pupil.h.
#pragma once

#include <array>

#include "imaging/scene_file.h"
#include "optics/assembly.h"
#include "optics/ray_lanes.h"

namespace relign::imaging {

// The plane that rays are aimed at, lens coordinates; depends only on the design.
struct PupilAim {
  double z_mm = 0;       // rays are aimed at this plane
  double radius_mm = 0;  // of the paraxial pupil
  double reach_mm = 0;   // no ray farther from the axis can pass
};

PupilAim pupil_aim(const SceneFile& scene);

class RayBundle {
 public:
  // scene and assembly must outlive it. from: a point of the emitter, mm. wavelength_nm: 0 for that of the scene's
  // lens.
  RayBundle(const SceneFile& scene, const optics::Assembly& assembly, const std::vector<double>& true_pose,
            const std::array<double, 2>& from, double pupil_z, double wavelength_nm = 0);

  struct Light {
    double x_mm = 0, y_mm = 0;  // hit on the sensor's plane, world
    double weight = 0;          // its light per area of the aiming plane; 0: it does not pass
    double p = 0, q = 0;        // its direction cosines there along world x and y
    double path_mm = 0;         // optical path from the emitter to there
  };
  Light at(double u_mm, double v_mm, bool fresnel) const;
  // The same for up to optics::kLanes targets at once, several times faster; equal bits.
  void at_each(const double* u_mm, const double* v_mm, int count, bool fresnel, Light* lights) const;

  // In the ambient medium.
  double wavelength_mm() const { return wavelength_nm_ * 1e-6 / scene_.ambient_index; }

 private:
  bool passes_bore(const optics::Vec3& last, const optics::Vec3& direction) const;
  // Of a ray that left the last face at `last` in `direction` (lens coordinates), after `path_mm` from the emitter.
  Light light_of(const optics::Vec3& way, const optics::Vec3& last, const optics::Vec3& direction, double path_mm,
                 double transmittance) const;

  const SceneFile& scene_;
  const optics::Assembly& assembly_;
  optics::Motion to_world_, into_lens_;
  optics::Vec3 start_;
  double pupil_z_, wavelength_nm_;
  optics::LanePath lanes_;
};

struct Window {
  double low_u = 0, high_u = 0, low_v = 0, high_v = 0;
};

// The bounding box of passing rays, plus one cell. Empty (low_u > high_u) if none passes.
Window passing_window(const RayBundle& bundle, const PupilAim& aim);

// A low-discrepancy sequence in 0..1 for positions in cells: rays on a regular grid would act as a grating, whose
// modulation returns for strongly spread light. which: 0 or 1, the dimension.
double scattered(int cell, int which);

}  // namespace relign::imaging
