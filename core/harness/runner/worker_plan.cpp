#include "runner/worker_plan.h"

#include <utility>

#include "base/error.h"
#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"

namespace relign::runner {
namespace {

template <class Entry>
Json named(const Entry& entry) {
  return {{"name", entry.name}, {"choice", plugin_host::to_json(entry.choice)}};
}

void check(const plugin_host::Choice& choice, WorkerPlan& plan) {
  const std::string& library = choice.plugin->library.string();
  if (plan.checked.insert(library).second && plugin_host::plugin_hash(*choice.plugin) != plan.hashes.at(library))
    throw Error(
        ErrorKind::plugin_rejected,
        library + " has changed during this run; run the same command again, which repeats the affected trials");
  for (const auto& [name, inner] : choice.algorithms) check(*inner, plan);
}

}  // namespace

Json to_json(const PreparedPlan& prepared, const LibraryHashes& hashes) {
  const suites::Suite& suite = prepared.plan.suite;
  Json scenes = Json::array(), levels = Json::array(), algorithms = Json::array();
  for (std::size_t index = 0; index < suite.scenes.size(); ++index) {
    Json scene = named(suite.scenes[index]);
    scene["description"] = prepared.scenes[index].text;
    scenes.push_back(std::move(scene));
  }
  for (const suites::LevelEntry& entry : suite.levels) levels.push_back(named(entry));
  for (const suites::AlgorithmEntry& entry : suite.algorithms) {
    Json algorithm = named(entry);
    algorithm["protocol"] = entry.protocol;
    algorithm["merit"] = entry.merit;
    algorithm["steps"] = entry.steps;
    algorithm["method"] = entry.method;
    algorithm["training"] = entry.training;
    algorithms.push_back(std::move(algorithm));
  }
  const suites::Seeds seeds = suite.draw_seeds();
  return {{"seeds", {seeds.instances, seeds.algorithms}},
          {"commitment", suite.commitment},
          {"limits", suite.limits},
          {"spec", suite.spec},
          {"machine_time", json_of(suite.machine_time)},
          {"scenes", std::move(scenes)},
          {"levels", std::move(levels)},
          {"algorithms", std::move(algorithms)},
          {"libraries", hashes}};
}

WorkerPlan worker_plan_from_json(const Json& json) {
  WorkerPlan plan;
  suites::Suite& suite = plan.prepared.plan.suite;
  suite.seeds = {json.at("seeds").at(0).get<std::uint64_t>(), json.at("seeds").at(1).get<std::uint64_t>()};
  suite.commitment = json.at("commitment").get<std::string>();
  suite.limits = json.at("limits").get<std::string>();
  suite.spec = json.at("spec");
  suite.machine_time = read_described<MachineTimeKeys>(json.at("machine_time"), "the plan");
  for (const Json& scene : json.at("scenes")) {
    suite.scenes.push_back({scene.at("name").get<std::string>(), plugin_host::choice_from_json(scene.at("choice"))});
    plan.prepared.scenes.push_back(
        trials::read_scene_facts(scene.at("description").get<std::string>(), suite.scenes.back().choice.id));
  }
  for (const Json& level : json.at("levels"))
    suite.levels.push_back({level.at("name").get<std::string>(), plugin_host::choice_from_json(level.at("choice"))});
  for (const Json& algorithm : json.at("algorithms")) {
    suites::AlgorithmEntry entry;
    entry.name = algorithm.at("name").get<std::string>();
    entry.choice = plugin_host::choice_from_json(algorithm.at("choice"));
    entry.protocol = algorithm.at("protocol").get<std::string>();
    entry.merit = algorithm.at("merit").get<std::string>();
    entry.steps = algorithm.at("steps").get<unsigned>();
    entry.method = algorithm.at("method").get<std::string>();
    entry.training = algorithm.at("training").get<std::string>();
    suite.algorithms.push_back(std::move(entry));
  }
  plan.hashes = json.at("libraries").get<LibraryHashes>();
  return plan;
}

void WorkerPlan::check_libraries(const suites::PlannedTrial& trial) {
  const suites::Suite& suite = prepared.plan.suite;
  check(suite.scenes.at(trial.scene).choice, *this);
  check(suite.levels.at(trial.level).choice, *this);
  check(suite.algorithms.at(trial.algorithm).choice, *this);
}

Json to_json(const suites::PlannedTrial& trial) {
  return {{"id", trial.id},
          {"scene", trial.scene},
          {"level", trial.level},
          {"algorithm", trial.algorithm},
          {"instance", trial.instance}};
}

suites::PlannedTrial planned_trial_from_json(const Json& json) {
  suites::PlannedTrial trial;
  trial.id = json.at("id").get<std::string>();
  trial.scene = json.at("scene").get<std::size_t>();
  trial.level = json.at("level").get<std::size_t>();
  trial.algorithm = json.at("algorithm").get<std::size_t>();
  trial.instance = json.at("instance").get<std::uint64_t>();
  return trial;
}

}  // namespace relign::runner
