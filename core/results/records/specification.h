// The specification that a lens must meet: the "spec" of a suite, or of a scene, as kept in the manifest.
#pragma once

#include <limits>

#include "base/json_source.h"

namespace relign::records {

// Limits for the lens after curing. NaN: not required.
struct Specification {
  double rmse = std::numeric_limits<double>::quiet_NaN();       // noise-free, at most
  double lp_per_mm = std::numeric_limits<double>::quiet_NaN();  // frequency of the measured MTF, with limits or without
  double mtf_centre = std::numeric_limits<double>::quiet_NaN(), mtf_corner = mtf_centre;  // at least
  bool diffraction = false;  // the MTF that is measured includes it

  bool measures_mtf() const { return lp_per_mm > 0; }
  bool limits_mtf() const;
  bool limits_anything() const;
  bool mtf_met_by(double centre, double corner) const;  // NaN misses a limit
  bool met_by(double of_rmse, double centre, double corner) const;
};

// The suite's specification if it has one, else the scene's; no limits if neither has. The scene decides whether the
// MTF includes diffraction, wherever the limits come from (runner/mtf_check.h).
Specification specification_of(const Json& of_suite, const Json& of_scene);

}  // namespace relign::records
