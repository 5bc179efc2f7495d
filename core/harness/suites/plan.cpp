#include "suites/plan.h"

#include <algorithm>
#include <map>

#include "base/criteria.h"
#include "base/hash.h"
#include "base/seeds.h"

namespace relign::suites {
namespace {

// Part of every id. Change it only when the same suite would give different results, because no published
// result can be resumed after that.
constexpr int kTrialIdVersion = 1;

// Only what the suite's specification adds to the measurements. Its limits do not matter, and a scene's own
// specification is part of the scene's data.
Json measured_mtf(const Suite& suite) {
  const auto mtf = suite.spec.is_object() ? suite.spec.find("mtf") : suite.spec.end();
  return mtf != suite.spec.end() && mtf->is_object() ? mtf->value("lp_per_mm", Json()) : Json();
}

// What of the suite's specification is judged after every step, and with the limits of MTF, which decide the own
// optimum. Other limits do not matter.
Json judged_criteria(const Suite& suite) {
  if (!suite.spec.is_object()) return nullptr;
  Json criteria = Json::object();
  for (const Criterion one : kCriteria)
    if (const std::string key(entry_of(one).key); !key.empty() && suite.spec.contains(key))
      criteria[key] = one == Criterion::field_mtf ? suite.spec[key] : Json(true);
  return criteria.empty() ? Json() : criteria;
}

std::string instance_set_hash(const Suite& suite, const std::vector<std::string>& scene_identity) {
  std::vector<std::string> scenes, levels;
  for (std::size_t index = 0; index < suite.scenes.size(); ++index)
    scenes.push_back(suite.scenes[index].choice.identity + "\n" + scene_identity[index]);
  for (const LevelEntry& level : suite.levels) levels.push_back(level.choice.identity);
  // The set does not depend on the order of lists in the suite.
  std::sort(scenes.begin(), scenes.end());
  std::sort(levels.begin(), levels.end());
  return short_hash(canonical_json({{"instance_set", kTrialIdVersion},
                                    {"scenes", scenes},
                                    {"noise_levels", levels},
                                    {"seed", suite.seed_json()},
                                    {"first_instance", suite.first_instance},
                                    {"instances", suite.instances}}));
}

}  // namespace

Json identity_json(const std::string& identity) {
  Json parsed = parsed_json(identity);
  return parsed.is_discarded() ? Json(identity) : parsed;
}

std::string effective_merit(const AlgorithmEntry& algorithm) {
  if (!algorithm.merit.empty()) return algorithm.merit;
  return algorithm.protocol == "blind" ? "rmse" : "combined";
}

bool is_oracle(const AlgorithmEntry& algorithm) {
  // The paper's protocol grants the start to every optimizer, so that there are no oracles.
  const bool start_is_granted = algorithm.protocol == "paper";
  return algorithm.choice.plugin->oracle && !start_is_granted;
}

Plan make_plan(Suite suite, const std::vector<std::string>& scene_identity, const std::atomic<bool>* stop) {
  if (scene_identity.size() != suite.scenes.size())
    throw Error(ErrorKind::internal, "make_plan needs one identity per scene");
  Plan plan;
  plan.instance_set = instance_set_hash(suite, scene_identity);
  const Json machine_time = json_of(suite.machine_time), mtf = measured_mtf(suite);
  const Json criteria = judged_criteria(suite);
  for (std::size_t scene = 0; scene < suite.scenes.size(); ++scene) {
    for (std::size_t level = 0; level < suite.levels.size(); ++level) {
      for (std::size_t algorithm = 0; algorithm < suite.algorithms.size(); ++algorithm) {
        const AlgorithmEntry& entry = suite.algorithms[algorithm];
        Json ingredients = {{"trial", kTrialIdVersion},
                            {"scene", identity_json(suite.scenes[scene].choice.identity)},
                            {"scene_data", identity_json(scene_identity[scene])},
                            {"noise_level", identity_json(suite.levels[level].choice.identity)},
                            {"suite_seed", suite.seed_json()},
                            {"limits", suite.limits},
                            {"machine_time", machine_time},
                            {"algorithm", identity_json(entry.choice.identity)},
                            {"label", entry.name},
                            {"protocol", entry.protocol},
                            {"merit", effective_merit(entry)},
                            {"budget", entry.steps}};
        if (!mtf.is_null()) ingredients["mtf_lp_per_mm"] = mtf;
        if (!criteria.is_null()) ingredients["criteria"] = criteria;
        // The limits are part of this merit. Those of a scene's own specification are part of the scene's data.
        if (effective_merit(entry) == "mtf" && suite.spec.is_object() && !suite.spec.empty())
          ingredients["merit_limits"] = suite.spec.value("mtf", Json());
        for (unsigned count = 0; count < suite.instances; ++count) {
          PlannedTrial trial;
          trial.scene = scene;
          trial.level = level;
          trial.algorithm = algorithm;
          trial.instance = std::uint64_t{suite.first_instance} + count;
          if (stop && stop->load()) throw Error(ErrorKind::stopped, "stopped before the first trial");
          ingredients["instance"] = trial.instance;
          if (suite.commitment.empty())
            ingredients["algorithm_seed"] = algorithm_seed(suite.seed, entry.name, trial.instance);
          trial.id = short_hash(canonical_json(ingredients));
          plan.trials.push_back(std::move(trial));
        }
      }
    }
  }
  plan.suite = std::move(suite);
  return plan;
}

}  // namespace relign::suites
