#include "runner/stations.h"

#include <algorithm>

#include "base/error.h"

namespace relign::runner {

void check_stations(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts) {
  std::string mistakes;
  const auto complain = [&mistakes](const std::string& message) {
    mistakes += (mistakes.empty() ? "" : "\n") + message;
  };
  for (std::size_t scene = 0; scene < facts.size(); ++scene) {
    if (!facts[scene].owns_stage) continue;
    const std::string& name = suite.scenes[scene].name;
    for (const suites::LevelEntry& level : suite.levels)
      if (level.choice.plugin->id != "none")
        complain("noise level '" + level.name + "' cannot be used with the station '" + name +
                 "', which has its own lenses, start and stage; use 'none'");
    for (const suites::AlgorithmEntry& algorithm : suite.algorithms)
      if (algorithm.merit == "combined")
        complain("'" + algorithm.name + "': merit 'combined' needs the true pose, which is unknown on the station '" +
                 name + "'; use 'rmse'");
  }
  if (!mistakes.empty()) throw Error(ErrorKind::bad_input, mistakes);
}

bool can_run_on(const suites::AlgorithmEntry& algorithm, const trials::SceneFacts& scene) {
  return !scene.owns_stage || !algorithm.choice.plugin->oracle;
}

std::vector<std::string> leave_out_told_methods(suites::Suite& suite, const std::vector<trials::SceneFacts>& facts) {
  std::vector<std::string> notes;
  for (const suites::AlgorithmEntry& algorithm : suite.algorithms)
    for (std::size_t scene = 0; scene < facts.size(); ++scene)
      if (!can_run_on(algorithm, facts[scene]))
        notes.push_back("skipping " + algorithm.name + " on the station '" + suite.scenes[scene].name +
                        "': it requires the true start pose, which is unknown there");
  const auto runs_nowhere = [&facts](const suites::AlgorithmEntry& algorithm) {
    return std::none_of(facts.begin(), facts.end(),
                        [&algorithm](const trials::SceneFacts& scene) { return can_run_on(algorithm, scene); });
  };
  suite.algorithms.erase(std::remove_if(suite.algorithms.begin(), suite.algorithms.end(), runs_nowhere),
                         suite.algorithms.end());
  if (suite.algorithms.empty())
    throw Error(ErrorKind::bad_input, "no algorithm of this suite can run:\n" + (notes.empty() ? "" : notes.front()));
  return notes;
}

void leave_out_told_trials(suites::Plan& plan, const std::vector<trials::SceneFacts>& facts) {
  const auto runs_not = [&](const suites::PlannedTrial& trial) {
    return !can_run_on(plan.suite.algorithms[trial.algorithm], facts[trial.scene]);
  };
  plan.trials.erase(std::remove_if(plan.trials.begin(), plan.trials.end(), runs_not), plan.trials.end());
}

}  // namespace relign::runner
