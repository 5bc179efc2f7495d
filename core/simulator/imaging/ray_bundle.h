// The rays of one place of the emitter through a lens at a pose, in double, by where they aim in the plane of the
// entrance pupil: what single-ray judgements of a lens (field_mtf.h, wave_pupil.h) are made from.
#pragma once

#include <array>

#include "imaging/scene_file.h"
#include "optics/assembly.h"

namespace relign::imaging {

// Where rays aim, lens coordinates; of the design alone.
struct PupilAim {
  double z_mm = 0;       // rays are aimed at this plane
  double radius_mm = 0;  // of the pupil, as first order has it
  double reach_mm = 0;   // no ray farther off the axis can pass
};

PupilAim pupil_aim(const SceneFile& scene);

class RayBundle {
 public:
  // scene and assembly outlive it. from: a place of the emitter, mm. wavelength_nm: 0 for that of the scene's lens.
  RayBundle(const SceneFile& scene, const optics::Assembly& assembly, const std::vector<double>& true_pose,
            const std::array<double, 2>& from, double pupil_z, double wavelength_nm = 0);

  struct Light {
    double x_mm = 0, y_mm = 0;  // where it meets the sensor's plane, world
    double weight = 0;          // its light per area of the plane that it aims at; 0: it does not pass
    double p = 0, q = 0;        // its direction cosines there along world x and y
    double path_mm = 0;         // optical path from the emitter to there
  };
  Light at(double u_mm, double v_mm, bool fresnel) const;
  bool passes(double u_mm, double v_mm) const { return at(u_mm, v_mm, false).weight > 0; }

  // In the ambient medium.
  double wavelength_mm() const { return wavelength_nm_ * 1e-6 / scene_.ambient_index; }

 private:
  bool passes_bore(const optics::Vec3& last, const optics::Vec3& direction) const;

  const SceneFile& scene_;
  const optics::Assembly& assembly_;
  optics::Motion to_world_, into_lens_;
  optics::Vec3 start_;
  double pupil_z_, wavelength_nm_;
};

struct Window {
  double low_u = 0, high_u = 0, low_v = 0, high_v = 0;
};

// What passes, with a cell's width around it. Empty (low_u > high_u) when nothing does.
Window passing(const RayBundle& bundle, const PupilAim& aim);

// An even spread of numbers in 0..1 for the places in cells: rays on an even grid would be a grating, whose modulation
// comes back where the light is spread far. which: 0 or 1.
double scattered(int cell, int which);

}  // namespace relign::imaging
