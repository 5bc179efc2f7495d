#include "records/specification.h"

#include <algorithm>
#include <cmath>

#include "base/json_members.h"

namespace relign::records {
namespace {

double number(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : std::numeric_limits<double>::quiet_NaN();
}

bool includes_diffraction(const Json& spec) { return flag_of(member(spec, "mtf"), "diffraction"); }

FieldLimits limits_of(const Json& object, const FieldLimits& otherwise) {
  FieldLimits found = otherwise;
  if (object.is_string()) found.name = object.get<std::string>();
  if (!object.is_object()) return found;
  found.name = text_of(object, "name");
  if (object.contains("tangential")) found.tangential = number(object, "tangential");
  if (object.contains("sagittal")) found.sagittal = number(object, "sagittal");
  return found;
}

const Json& stated(const Json& of_suite, const Json& of_scene) {
  return of_suite.is_object() && !of_suite.empty() ? of_suite : of_scene;
}

bool at_least(double value, double limit) { return std::isnan(limit) || value >= limit; }

}  // namespace

bool Specification::limits_mtf() const { return measures_mtf() && !(std::isnan(mtf_centre) && std::isnan(mtf_corner)); }

bool Specification::limits_anything() const { return limits_mtf() || limits_criteria() || !std::isnan(score); }

bool Specification::limits_criteria() const {
  return std::any_of(limits.values.begin(), limits.values.end(), [](double limit) { return !std::isnan(limit); });
}

bool Specification::meets(Criterion criterion, double value) const {
  return std::isnan(limits[criterion]) || value <= limits[criterion];
}

bool Specification::criteria_met_by(const ByCriterion<double>& values) const {
  return std::all_of(kCriteria.begin(), kCriteria.end(), [&](Criterion one) { return meets(one, values[one]); });
}

bool Specification::mtf_met_by(double centre, double corner) const {
  return !limits_mtf() || (at_least(centre, mtf_centre) && at_least(corner, mtf_corner));
}

bool Specification::met_by(double of_score, double centre, double corner) const {
  return (std::isnan(score) || of_score <= score) && mtf_met_by(centre, corner);
}

std::string unknown_further_score(const Json& of_suite, const Json& of_scene, const SceneScore& score) {
  for (const auto& [name, limit] : object_of(stated(of_suite, of_scene), "further_scores").items())
    if (std::none_of(score.further.begin(), score.further.end(),
                     [&name = name](const FurtherScore& one) { return one.name == name; }))
      return name;
  return "";
}

Specification specification_of(const Json& of_suite, const Json& of_scene, const SceneScore& score) {
  Specification found;
  const Json& spec = stated(of_suite, of_scene);
  if (!spec.is_object()) return found;
  found.score = number(spec, spec.contains("score") ? "score" : "rmse");
  for (const Criterion criterion : kCriteria)
    if (criterion != Criterion::field_mtf && !is_further_score(criterion))
      found.limits[criterion] = number(spec, std::string(entry_of(criterion).key).c_str());
  for (std::size_t i = 0; i < score.further.size(); ++i)
    found.limits[further_score(i)] = number(object_of(spec, "further_scores"), score.further[i].name.c_str());
  const bool diffraction = includes_diffraction(of_scene) || includes_diffraction(of_suite);
  if (const Json& fields = member(spec, "field_mtf"); fields.is_object()) {
    found.diffraction = diffraction;
    found.limits[Criterion::field_mtf] = 0;
    found.field_mtf.lp_per_mm = number(fields, "lp_per_mm");
    found.field_mtf.every = limits_of(fields, {});
    for (const Json& field : list_of(fields, "fields"))
      found.field_mtf.fields.push_back(limits_of(field, found.field_mtf.every));
  }
  const auto mtf = spec.find("mtf");
  if (mtf == spec.end() || !mtf->is_object()) return found;
  found.lp_per_mm = number(*mtf, "lp_per_mm");
  found.diffraction = diffraction;
  found.mtf_centre = number(*mtf, "centre");
  found.mtf_corner = number(*mtf, "corner");
  return found;
}

}  // namespace relign::records
