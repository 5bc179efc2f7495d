#include "records/specification.h"

#include <cmath>

#include "base/json_members.h"

namespace relign::records {
namespace {

double number(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : std::numeric_limits<double>::quiet_NaN();
}

bool includes_diffraction(const Json& spec) { return flag_of(member(spec, "mtf"), "diffraction"); }

bool at_least(double value, double limit) { return std::isnan(limit) || value >= limit; }

}  // namespace

bool Specification::limits_mtf() const { return measures_mtf() && !(std::isnan(mtf_centre) && std::isnan(mtf_corner)); }

bool Specification::limits_anything() const { return limits_mtf() || !std::isnan(rmse); }

bool Specification::mtf_met_by(double centre, double corner) const {
  return !limits_mtf() || (at_least(centre, mtf_centre) && at_least(corner, mtf_corner));
}

bool Specification::met_by(double of_rmse, double centre, double corner) const {
  return (std::isnan(rmse) || of_rmse <= rmse) && mtf_met_by(centre, corner);
}

Specification specification_of(const Json& of_suite, const Json& of_scene) {
  Specification found;
  const Json& spec = of_suite.is_object() && !of_suite.empty() ? of_suite : of_scene;
  if (!spec.is_object()) return found;
  found.rmse = number(spec, "rmse");
  const auto mtf = spec.find("mtf");
  if (mtf == spec.end() || !mtf->is_object()) return found;
  found.lp_per_mm = number(*mtf, "lp_per_mm");
  found.diffraction = includes_diffraction(of_scene) || includes_diffraction(of_suite);
  found.mtf_centre = number(*mtf, "centre");
  found.mtf_corner = number(*mtf, "corner");
  return found;
}

}  // namespace relign::records
