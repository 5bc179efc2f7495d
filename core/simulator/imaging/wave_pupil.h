// The pupil function of a lens as built, for one point of the emitter, from the same rays as its geometric MTF.
//
// The incident light is a sum of plane waves, indexed by their direction cosines in the plane of the sensor. The
// intensity of each is the rays' light per area of direction cosines, its phase the optical path to a plane
// perpendicular to the ray through one point of the image (a reference sphere of infinite radius: no exit pupil is
// needed, which vignetting, a tilted lens or a telecentric image side would leave undefined). In these coordinates the
// MTF is the autocorrelation of the pupil function at any field angle, exactly for scalar waves of one wavelength: a
// frequency of `lp_per_mm` on the sensor couples directions whose cosines differ by lp_per_mm times the wavelength.
//
// Each direction has one ray. Where an uncorrected lens sends two rays of one point into one direction, as close to the
// rim of relign_l3 at its corners (2 % of the light), one of them is ignored.
#pragma once

#include <array>
#include <vector>

#include "imaging/ray_bundle.h"

namespace relign::imaging {

class WavePupil {
 public:
  // bundle must outlive it; window: passing_window(bundle). direction: unit, on the sensor; r is along it, t across.
  WavePupil(const RayBundle& bundle, const Window& window, bool fresnel, const std::array<double, 2>& direction);

  // The pupil function at r, t (direction cosines).
  struct Sample {
    double intensity = 0;  // light per area of direction cosines; 0: none
    double path_mm = 0;    // optical path
  };
  Sample at(double r, double t) const;

  // Contains all directions that pass; empty (low > high) if hardly any ray does.
  struct Box {
    double low_r = 1, high_r = -1, low_t = 1, high_t = -1;
  };
  const Box& box() const { return box_; }

  enum Axis { along, across };
  // Total light.
  double light() const;
  // The autocorrelation at this frequency along r or t, relative to frequency 0, which is light(): 0 to 1.
  double modulation(double lp_per_mm, Axis axis, double light) const;
  // The autocorrelation itself, in units of light(). Its phase is relative to origin().
  struct Transfer {
    double cosine = 0, sine = 0;
  };
  Transfer transfer(double lp_per_mm, Axis axis) const;
  // The point of the image that phases refer to: the mean hit of the rays on the sensor, or as set. Sums over several
  // wavelengths need the same origin.
  std::array<double, 2> origin() const { return {x0_mm_, y0_mm_}; }
  void set_origin(const std::array<double, 2>& place) {
    x0_mm_ = place[0];
    y0_mm_ = place[1];
  }

 private:
  // Target point and area element of a direction, fitted by powers of r and t.
  struct Aim {
    double u_mm = 0, v_mm = 0;
    double area = 0;  // of the aiming plane per area of direction cosines
  };
  Aim aim_for(double r, double t) const;
  // Sum over the cells of the overlap of two sheared pupils, and the sides of that overlap.
  struct Overlap {
    double cosine = 0, sine = 0;
    double side_r = 0, side_t = 0;
  };
  Overlap overlap(double lp_per_mm, Axis axis) const;
  void fit_aims(const std::vector<std::array<double, 4>>& rays);

  const RayBundle& bundle_;
  bool fresnel_;
  std::array<double, 2> along_;
  Box box_;
  double x0_mm_ = 0, y0_mm_ = 0;
  int degree_ = 0;
  double middle_r_ = 0, middle_t_ = 0, half_ = 1;  // powers are of (r - middle) / half
  std::vector<double> of_u_, of_v_;
};

}  // namespace relign::imaging
