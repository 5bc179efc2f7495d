// The checks of a results folder that need no replay. `verify`, `report`, `leaderboard build`, `merge` and `submit
// evaluate` make the same list of them:
// * manifest: it agrees with itself and with the text of its suite (manifest_check.h, which throws)
// * plan: it is what the suite gives with the installed plugins (runner/plan_check.h); needs their manifests
// * trials: each is one that the manifest plans, once, with the budget, names and place that it states, and its times
// * steps: a trial has the steps that its end implies, in order, and no more than its budget
// * scores: they are there where they are due, and every number is one that a run can write
// * instances: methods have the start and the own optimum of an instance in common, and the scores of its scene
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "records/damage.h"
#include "records/instance_checks.h"
#include "records/manifest.h"
#include "records/record.h"
#include "records/step_numbers.h"

namespace relign::records {

struct Check {
  std::string name;
  std::vector<std::string> findings;  // contradictions, as sentences without full stop; at most kMostFindings
  std::size_t more = 0;               // contradictions beyond these
  std::string not_made;               // why the check was not made; empty: it was

  static constexpr std::size_t kMostFindings = 20;
  bool failed() const { return !findings.empty(); }
  void add(std::string finding);
};
using Checks = std::vector<Check>;

// The check "plan" of a manifest, for modules that know no plugins.
using PlanCheck = std::function<Check(const Manifest& manifest)>;
// Its result; of an empty function, that it was not made.
Check made_by(const PlanCheck& plan, const Manifest& manifest);

bool any_failed(const Checks& checks);
// "steps: trial 4f1c... has 3 steps, ...", and what is beyond the list; one text per finding.
std::vector<std::string> findings_of(const Checks& checks);
// "manifest, trials, steps and scores checked, plan not (the plugin 'x' is not installed)".
std::string summary_of(const Checks& checks);

// Takes the trials of a folder one by one, so that a reader that needs them anyway reads the files once.
class FolderChecks {
 public:
  // The manifest of `folder` with its list of planned trials; require_consistent accepts it.
  FolderChecks(const Manifest& manifest, const std::filesystem::path& folder);

  // Complete trials in the order of the files. Ignores those that the plan does not have.
  void add(const TrialRecord& closing, const std::vector<StepNumbers>& steps);
  // After the trials.
  void add(const TrialTimes& times);
  // Once, after everything was added. `all_times`: no line of times/ was damaged, so that none may be missing.
  Checks result(Check plan, bool all_times = true);

 private:
  struct Method {
    std::size_t place = 0;
    std::string id, list, training;
    std::uint64_t steps = 0;
    bool merit_has_rmse = true, merit_is_rmse = false;
  };
  struct Scene {
    std::size_t place = 0;
    bool has_truth = true, is_station = false;
    double step_seconds = 0;  // at least: of settling and exposure
    bool squared = true;      // its score is the RMSE
    double resolution = 0;    // of the score
    std::size_t axes = 0;     // of its first trial; 0: none yet
  };
  using Place = std::tuple<std::size_t, std::size_t, std::size_t, std::uint64_t>;  // scene, level, method, instance
  struct Known {
    bool recorded = false, timed = false, in_place = false, ended_well = false;
    std::uint32_t steps = 0;
    Place place;
  };

  void check_trial(const TrialRecord& closing, Known& known);
  void check_steps(const TrialRecord& closing, const std::vector<StepNumbers>& steps);
  void check_scores(const TrialRecord& closing, const std::vector<StepNumbers>& steps);

  Check manifest_, trials_, steps_, scores_, instances_;
  std::map<std::string, Scene> scenes_;
  std::map<std::string, std::size_t> levels_;
  std::map<std::pair<std::string, std::string>, Method> methods_;  // by name and protocol
  bool several_suites_ = false, sealed_ = false, has_order_ = false;
  std::uint64_t seed_ = 0, first_instance_ = 0, instance_count_ = 0;
  std::unordered_map<std::string, std::size_t>
      order_;                 // from a trial to its place in the plan, or in the files without has_order_
  std::vector<Known> known_;  // by this place
  InstanceChecks of_instances_;
};

// Reads a folder for its checks alone. Throws Error as for_each_with_steps and require_consistent; `damaged`, unless
// null, takes damage instead.
Checks check_folder(const std::filesystem::path& folder, const PlanCheck& plan, std::vector<Damage>* damaged = nullptr);

// Throws Error(bad_input) with the findings of check_folder, if any. The message begins with `what`: "cannot merge".
void require_checked(const std::filesystem::path& folder, const PlanCheck& plan, const std::string& what,
                     std::vector<Damage>* damaged = nullptr);

}  // namespace relign::records
