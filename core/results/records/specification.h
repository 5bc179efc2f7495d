// What counts as good enough: the "spec" of a suite, or of a scene, as the manifest keeps it.
#pragma once

#include <limits>

#include "base/json_source.h"

namespace relign::records {

// Of the lens where the glue leaves it. What is NaN is not asked for.
struct Specification {
  double rmse = std::numeric_limits<double>::quiet_NaN();       // noise-free, at most
  double lp_per_mm = std::numeric_limits<double>::quiet_NaN();  // of the MTF that is measured, with limits or without
  double mtf_centre = std::numeric_limits<double>::quiet_NaN(), mtf_corner = mtf_centre;  // at least
  bool diffraction = false;  // the MTF that is measured includes it

  bool measures_mtf() const { return lp_per_mm > 0; }
  bool limits_mtf() const;
  bool limits_anything() const;
  bool mtf_met_by(double centre, double corner) const;  // what is asked for and NaN is missed
  bool met_by(double of_rmse, double centre, double corner) const;
};

// The suite's where it has one, else the scene's. What is no specification asks for nothing. Whether the MTF includes
// diffraction is the scene's to choose, whoever sets the limits (runner/mtf_check.h).
Specification specification_of(const Json& of_suite, const Json& of_scene);

}  // namespace relign::records
