#include "runner/criteria.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/json_members.h"
#include "base/json_source.h"
#include "base/text.h"

namespace relign::runner {

using records::Criterion;

trials::Criteria criteria_of(const records::Specification& spec, const trials::SceneFacts& scene) {
  const auto limited = [&](Criterion criterion) { return !std::isnan(spec.limits[criterion]); };
  trials::Criteria criteria;
  criteria.centre = limited(Criterion::centre);
  criteria.rotation = limited(Criterion::rotation);
  criteria.pose = limited(Criterion::pose);
  criteria.tilt = limited(Criterion::tilt);
  if (!limited(Criterion::field_mtf)) return criteria;
  criteria.lp_per_mm = spec.field_mtf.lp_per_mm;
  std::vector<std::string> names;
  for (const images::EdgeField& field : scene.fields) names.push_back(field.name);
  if (spec.field_mtf.fields.empty())
    for (std::uint32_t i = 0; i < names.size(); ++i)
      criteria.field_mtf.push_back({i, spec.field_mtf.every.tangential, spec.field_mtf.every.sagittal});
  for (const records::FieldLimits& limits : spec.field_mtf.fields) {
    const auto found = std::find(names.begin(), names.end(), limits.name);
    if (found == names.end())
      throw Error(ErrorKind::bad_input, "the specification's 'field_mtf' has the unknown field '" + limits.name +
                                            "'; fields of the scene '" + scene.name + "': " + join(names, ", "));
    criteria.field_mtf.push_back(
        {static_cast<std::uint32_t>(found - names.begin()), limits.tangential, limits.sagittal});
  }
  return criteria;
}

std::string key_of(const trials::Criteria& criteria) {
  std::string key = shortest(criteria.lp_per_mm);
  for (const auto& limit : criteria.field_mtf)
    key += " " + std::to_string(limit.field) + " " + shortest(limit.tangential) + " " + shortest(limit.sagittal);
  return key;
}

void add(const trials::Judgement& judged, const trials::Criteria& criteria,
         records::ByCriterion<std::vector<double>>& values) {
  if (!criteria.field_mtf.empty()) values[Criterion::field_mtf].push_back(judged.field_mtf_deficit);
  if (criteria.centre) values[Criterion::centre].push_back(judged.centre_px);
  if (criteria.rotation) values[Criterion::rotation].push_back(judged.rotation_px);
  if (criteria.pose) values[Criterion::pose].push_back(judged.pose_um);
  if (criteria.tilt) values[Criterion::tilt].push_back(judged.tilt_arcmin);
}

// Criteria of every step, and with them yields and costs, are known at the method's own recommendations only.
static void check_rule(const suites::Suite& suite, const records::Specification& spec) {
  const std::string rule = text_of(suite.analysis, "rule");
  if (rule.empty() || rule == "own") return;
  std::string what;
  if (spec.limits_criteria() && text_of(suite.analysis, "primary") == "yield")
    what = "the yield by criteria of every step";
  if (suite.cost.is_object()) what = "'cost'";
  if (what.empty()) return;
  throw Error(ErrorKind::bad_input,
              JsonSource::from_text(suite.text, suite.file)
                  .problem("/analysis/rule", "found '" + rule + "', must be 'own': " + what +
                                                 " is known at the method's own recommendations only")
                  .to_string());
}

void check_criteria(const suites::Suite& suite, const std::string& name, plugin_host::Scene& scene,
                    const trials::SceneFacts& facts) {
  const records::Specification spec = records::specification_of(suite.spec, facts.spec);
  check_rule(suite, spec);
  if (!spec.limits_criteria()) return;
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorKind::bad_input, "the 'spec' cannot be judged on the scene '" + name + "': " + reason);
  };
  if (facts.owns_stage || !facts.truth)
    refuse("'field_mtf', 'centre_px', 'rotation_px', 'pose_um' and 'tilt_arcmin' need its ground truth");
  const bool places = !std::isnan(spec.limits[Criterion::centre]) || !std::isnan(spec.limits[Criterion::rotation]);
  const bool fields = places || !std::isnan(spec.limits[Criterion::field_mtf]);
  if (fields && facts.fields.empty())
    refuse(
        "'field_mtf', 'centre_px' and 'rotation_px' need its 'fields'; use a scene with the target camera_chart or "
        "slanted_edges, such as camera_2mp, or list 'fields' in the scene file");
  const trials::Criteria criteria = criteria_of(spec, facts);
  plugin_host::MountedAssembly perfect = scene.mount("{}");
  if (fields) try {
      trials::measure_fields(perfect, facts, criteria.lp_per_mm, facts.nominal_pose);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input && error.kind() != ErrorKind::plugin_failed) throw;
      refuse(error.what());
    }
  if (criteria.needs_optimum() && criteria.field_mtf.empty() && !perfect.own_optimum(1, facts.axes.size()))
    refuse("'pose_um' and 'tilt_arcmin' need its own optimum, which it does not offer");
}

}  // namespace relign::runner
