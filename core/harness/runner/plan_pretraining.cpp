#include "runner/plan_pretraining.h"

#include "base/error.h"
#include "plugin_host/training.h"

namespace relign::runner {

void PlanPretraining::prepare(const std::vector<std::size_t>& places,
                              const std::function<void(const std::string&)>& on_begin) {
  const suites::Suite& suite = plan_.plan.suite;
  try {
    for (const std::size_t place : places) {
      const suites::PlannedTrial& trial = plan_.plan.trials[place];
      const suites::AlgorithmEntry& algorithm = suite.algorithms[trial.algorithm];
      const Group group(trial.scene, trial.level, trial.algorithm);
      if (groups_.count(group) || !plugin_host::is_prepared(algorithm.choice)) continue;
      on_begin(algorithm.name);
      groups_[group] =
          make_ ? make_(trial) : pretrainer_.prepare(make_job(plan_, trial), plan_.scene_identity[trial.scene]);
    }
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::stopped) throw;
  }
}

const Pretrainer::Entries* PlanPretraining::of(const suites::PlannedTrial& trial) const {
  const auto found = groups_.find({trial.scene, trial.level, trial.algorithm});
  return found == groups_.end() ? nullptr : &found->second;
}

std::vector<records::Pretrained> PlanPretraining::recorded() const {
  const suites::Suite& suite = plan_.plan.suite;
  std::vector<records::Pretrained> list;
  for (const auto& [group, entries] : groups_) {
    const auto& [scene, level, algorithm] = group;
    for (const auto& [identity, entry] : entries)
      list.push_back({suite.scenes[scene].name, suite.levels[level].name, suite.algorithms[algorithm].name,
                      suite.algorithms[algorithm].protocol, entry.algorithm, entry.sources, entry.steps,
                      entry.data.hash, entry.data.failure});
  }
  return list;
}

}  // namespace relign::runner
