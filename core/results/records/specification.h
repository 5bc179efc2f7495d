// The specification that a lens must meet: the "spec" of a suite, or of a scene, as kept in the manifest.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "base/criteria.h"
#include "base/json_source.h"
#include "base/scene_score.h"

namespace relign::records {

// Of one field; NaN: no limit.
struct FieldLimits {
  std::string name;
  double tangential = std::numeric_limits<double>::quiet_NaN(), sagittal = tangential;
};

// Limits for the lens after curing. NaN: not required.
struct Specification {
  double score = std::numeric_limits<double>::quiet_NaN();      // the scene's (base/scene_score.h), noise-free, at most
  double lp_per_mm = std::numeric_limits<double>::quiet_NaN();  // frequency of the measured MTF, with limits or without
  double mtf_centre = std::numeric_limits<double>::quiet_NaN(), mtf_corner = mtf_centre;  // at least
  bool diffraction = false;  // the MTF that is measured includes it

  // MTF by field: at least `every` in the fields of the list, or in all of the scene without a list.
  struct FieldMtf {
    double lp_per_mm = std::numeric_limits<double>::quiet_NaN();
    FieldLimits every;
    std::vector<FieldLimits> fields;  // complete: limits of `every` where a field has none
  } field_mtf;
  ByCriterion<double> limits = none();  // NaN: not required; of field_mtf 0

  static ByCriterion<double> none() {
    ByCriterion<double> limits;
    limits.values.fill(std::numeric_limits<double>::quiet_NaN());
    return limits;
  }
  bool limits_criteria() const;
  bool meets(Criterion criterion, double value) const;  // also without a limit; NaN misses one
  bool criteria_met_by(const ByCriterion<double>& values) const;

  bool measures_mtf() const { return lp_per_mm > 0; }
  bool limits_mtf() const;
  bool limits_anything() const;
  bool mtf_met_by(double centre, double corner) const;  // NaN misses a limit
  bool met_by(double of_score, double centre, double corner) const;
};

// The suite's specification if it has one, else the scene's; no limits if neither has. The scene decides whether the
// MTF includes diffraction, wherever the limits come from (runner/spec_check.h).
// `score`: of the scene, whose further scores are limited by their names; see unknown_further_score.
Specification specification_of(const Json& of_suite, const Json& of_scene, const SceneScore& score);
// The name of a limited further score that the scene does not declare; empty: none.
std::string unknown_further_score(const Json& of_suite, const Json& of_scene, const SceneScore& score);

}  // namespace relign::records
