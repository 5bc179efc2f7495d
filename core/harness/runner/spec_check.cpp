#include "runner/spec_check.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/json_members.h"
#include "base/json_source.h"
#include "base/text.h"
#include "trials/own_optimum.h"

namespace relign::runner {

std::string key_of(const trials::Criteria& criteria) {
  std::string key = shortest(criteria.lp_per_mm);
  for (const auto& limit : criteria.field_mtf)
    key += " " + std::to_string(limit.field) + " " + shortest(limit.tangential) + " " + shortest(limit.sagittal);
  return key;
}

// "'field_mtf', 'centre_px' and 'rotation_px'": all criteria, or those that need this.
static std::string keys_of(std::optional<CriterionNeeds> needs) {
  std::vector<std::string> keys;
  for (const CriterionEntry& entry : kCriterionEntries)
    if (!entry.key.empty() && (!needs || entry.needs == *needs)) keys.push_back(in_quotes(std::string(entry.key)));
  const std::string last = keys.back();
  keys.pop_back();
  return keys.empty() ? last : join(keys, ", ") + " and " + last;
}

// Criteria of every step, and with them yields and costs, are known at the method's own recommendations only.
static void check_rule(const suites::Suite& suite, const records::Specification& spec) {
  if (!suite.analysis || suite.analysis->rule == "own") return;
  std::string what;
  if (spec.limits_criteria() && suite.analysis->primary == "yield") what = "the yield by criteria of every step";
  if (suite.cost) what = "'cost'";
  if (what.empty()) return;
  throw Error(ErrorKind::bad_input,
              JsonSource::from_text(suite.text, suite.file)
                  .problem("/analysis/rule", "found '" + suite.analysis->rule + "', must be 'own': " + what +
                                                 " is known at the method's own recommendations only")
                  .to_string());
}

void check_criteria(const suites::Suite& suite, const std::string& name, plugin_host::Scene& scene,
                    const trials::SceneFacts& facts) {
  const records::Specification spec = records::specification_of(suite.spec, facts.spec, facts.score);
  check_rule(suite, spec);
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorKind::bad_input, "the 'spec' cannot be judged on the scene '" + name + "': " + reason);
  };
  const Json& limits = suite.spec.is_object() && !suite.spec.empty() ? suite.spec : facts.spec;
  const char *right = facts.score.squared ? "rmse" : "score", *wrong = facts.score.squared ? "score" : "rmse";
  if (limits.is_object() && limits.contains(wrong))
    refuse("it limits '" + std::string(wrong) + "', but the scene is judged by its " + facts.score.label() + "; use '" +
           right + "'");
  if (const std::string limited = records::unknown_further_score(suite.spec, facts.spec, facts.score);
      !limited.empty()) {
    std::vector<std::string> names;
    for (const FurtherScore& one : facts.score.further) names.push_back(in_quotes(one.name));
    refuse("it limits the further score " + in_quotes(limited) + ", which the scene does not declare; it declares " +
           (names.empty() ? "none" : join(names, ", ")));
  }
  if (facts.score.squared && !suite.targets.empty() && suite.targets.front() > 1)
    throw Error(ErrorKind::bad_input, "found the target " + shortest(suite.targets.front()) +
                                          "; targets of the scene '" + name + "', of its RMSE, are from 0 to 1");
  if (!facts.score.further.empty()) {  // before hours of trials that would fail at their end
    plugin_host::MountedAssembly perfect = scene.mount("{}");
    const trials::Criteria none;
    trials::Judge(perfect, facts, none, {}, 1).at(facts.nominal_pose, {});
  }
  if (!spec.limits_criteria()) return;
  const auto needs = [&](CriterionNeeds what) {
    return std::any_of(kCriteria.begin(), kCriteria.end(),
                       [&](Criterion one) { return !std::isnan(spec.limits[one]) && entry_of(one).needs == what; });
  };
  if (facts.owns_stage || !facts.truth) refuse(keys_of({}) + " need its ground truth");
  const bool fields = needs(CriterionNeeds::fields);
  if (fields && facts.fields.empty())
    refuse(keys_of(CriterionNeeds::fields) +
           " need its 'fields'; use a scene with the target camera_chart or slanted_edges, such as camera_2mp, or list "
           "'fields' in the scene file");
  const trials::Criteria criteria = trials::criteria_of(spec, facts);
  plugin_host::MountedAssembly perfect = scene.mount("{}");
  if (fields) try {
      trials::measure_fields(perfect, facts, criteria.lp_per_mm, facts.nominal_pose);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input && error.kind() != ErrorKind::plugin_failed) throw;
      refuse(error.what());
    }
  if (needs(CriterionNeeds::own_optimum) && criteria.field_mtf.empty() && !trials::own_optimum(perfect, facts, 1))
    refuse(keys_of(CriterionNeeds::own_optimum) + " need its optimum, which it does not offer");
}

void check_units(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts) {
  struct Limited {
    std::string label, scene;
  };
  std::map<std::string, Limited> first;  // by the limit's key
  const auto limit = [&first](const std::string& key, const Limited& here) {
    const Limited& there = first.emplace(key, here).first->second;
    if (here.label == there.label) return;
    throw Error(ErrorKind::bad_input,
                "the suite's 'spec' has one limit for different numbers: " + in_quotes(key) + " limits " + there.label +
                    " on the scene '" + there.scene + "' and " + here.label + " on '" + here.scene +
                    "'; leave it out, so that each scene's own 'spec' counts, or write a suite for each");
  };
  for (std::size_t i = 0; i < facts.size(); ++i) {
    const SceneScore& score = facts[i].score;
    const std::string& scene = suite.scenes[i].name;
    const records::Specification spec = records::specification_of(suite.spec, {}, score);
    if (!std::isnan(spec.score)) limit("score", {score.label(), scene});
    for (const Criterion one : kCriteria)
      if (const FurtherScore* further = score.further_of(one); further && !std::isnan(spec.limits[one]))
        limit(further->name, {further->label(), scene});
  }
}

std::optional<plugin_host::MountedAssembly::FieldMtf> check_mtf(const suites::Suite& suite, const std::string& name,
                                                                plugin_host::Scene& scene,
                                                                const trials::SceneFacts& facts) {
  const records::Specification spec = records::specification_of(suite.spec, facts.spec, facts.score);
  if (!spec.measures_mtf()) return std::nullopt;
  const bool suites_own = suite.spec.is_object() && !suite.spec.empty();
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorKind::bad_input, std::string(suites_own ? "the suite's 'spec'" : "the scene's own 'spec'") +
                                          " requires the MTF at " + shortest(spec.lp_per_mm) +
                                          " lp/mm, which is unavailable for the scene '" + name + "': " + reason +
                                          "; remove 'mtf' from the suite's 'spec', or use a scene that offers " +
                                          RELIGN_SCENE_MTF + ", such as those of lens_system");
  };
  if (facts.owns_stage) refuse("the pose of a station's lens is unknown");
  if (suites_own) {
    const Json& mtf = suite.spec["mtf"];
    const bool scene_has_it = records::specification_of(facts.spec, Json(), facts.score).diffraction;
    if (mtf.contains("diffraction") && mtf["diffraction"].get<bool>() != scene_has_it)
      throw Error(ErrorKind::bad_input,
                  std::string("the suite's 'spec' requires an MTF ") + (scene_has_it ? "without" : "with") +
                      " diffraction, but that of the scene '" + name + "' is " + (scene_has_it ? "with" : "without") +
                      " it; set 'diffraction' in the 'mtf' of the scene file's 'spec', or remove it from the suite's");
  }
  try {
    const auto found = scene.mount("{}").mtf(facts.nominal_pose, spec.lp_per_mm);
    if (!found) refuse("it does not offer it");
    return found;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::plugin_failed) throw;
    refuse(error.what());
  }
  return std::nullopt;
}

std::vector<std::string> mtf_warnings(const records::Specification& spec, const trials::SceneFacts& facts) {
  std::vector<std::string> warnings;
  if (!(facts.pitch_um > 0)) return warnings;
  const double nyquist = 500 / facts.pitch_um;  // lp/mm
  for (const auto& [key, lp_per_mm] : {std::pair{"mtf", spec.lp_per_mm}, {"field_mtf", spec.field_mtf.lp_per_mm}})
    if (lp_per_mm > nyquist)
      warnings.push_back(std::string("the specification's '") + key + "' is at " + shortest(lp_per_mm) +
                         " lp/mm, above the Nyquist frequency of the sensor, " + significant(nyquist, 4) +
                         " lp/mm with pixels of " + shortest(facts.pitch_um) + " um: no image shows it");
  return warnings;
}

}  // namespace relign::runner
