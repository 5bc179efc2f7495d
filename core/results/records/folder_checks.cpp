#include "records/folder_checks.h"

#include <algorithm>

#include "base/error.h"
#include "base/seeds.h"
#include "base/text.h"
#include "records/difference.h"
#include "records/line_files.h"
#include "records/manifest_check.h"
#include "records/results_folder.h"
#include "records/score_checks.h"
#include "records/stored_trials.h"
#include "records/trial_ends.h"

namespace relign::records {
namespace {

std::string trial_text(const TrialRecord& closing) { return "trial " + closing.trial + " (" + label_of(closing) + ")"; }

bool is_end(const std::string& end) {
  return std::any_of(kTrialEnds.begin(), kTrialEnds.end(), [&](const Explanation& known) {
    return known.code == "crashed" ? end.starts_with("crashed(") && end.ends_with(')') : end == known.code;
  });
}

bool on_one_processor(const Manifest& manifest) {
  const std::vector<const Machine*> machines = manifest.machines();
  return std::all_of(machines.begin(), machines.end(),
                     [&](const Machine* one) { return one->same_processor(*machines.front()); });
}

}  // namespace

void Check::add(std::string finding) {
  if (findings.size() < kMostFindings)
    findings.push_back(std::move(finding));
  else
    ++more;
}

bool any_failed(const Checks& checks) {
  return std::any_of(checks.begin(), checks.end(), [](const Check& one) { return one.failed(); });
}

std::vector<std::string> findings_of(const Checks& checks) {
  std::vector<std::string> texts;
  for (const Check& check : checks) {
    for (const std::string& finding : check.findings) texts.push_back(check.name + ": " + finding);
    if (check.more > 0) texts.push_back(check.name + ": and " + std::to_string(check.more) + " more");
  }
  return texts;
}

std::string summary_of(const Checks& checks) {
  std::vector<std::string> made, others;
  for (const Check& check : checks)
    check.not_made.empty() ? made.push_back(check.name)
                           : others.push_back(check.name + " not (" + check.not_made + ")");
  std::string text = join(made, ", ") + " checked";
  if (!others.empty()) text += ", " + join(others, ", ");
  return text;
}

Check made_by(const PlanCheck& plan, const Manifest& manifest) {
  if (plan) return plan(manifest);
  Check check;
  check.name = "plan";
  check.not_made = "this command looks for no plugins";
  return check;
}

FolderChecks::FolderChecks(const Manifest& manifest, const std::filesystem::path& folder)
    : of_instances_(!on_one_processor(manifest), manifest.suites.size() > 1 || manifest.builds().size() > 1) {
  manifest_.name = "manifest";
  trials_.name = "trials";
  steps_.name = "steps";
  scores_.name = "scores";
  instances_.name = "instances";
  if (!manifest.has_suites()) manifest_.not_made = "it lacks the text of its suite";
  for (const char* lines : {"trials", "times"})
    for (std::string& finding : odd_line_files(folder / lines)) trials_.add(std::move(finding));
  for (const ManifestScene& scene : manifest.scenes)
    scenes_.emplace(
        scene.name,
        Scene{scenes_.size(), scene.truth, scene.owns_stage,
              (scene.machine_time.settle_ms.value_or(0) + scene.machine_time.exposure_ms.value_or(0)) / 1000,
              scene.score.squared, scene.score.resolution, 0});
  for (const ManifestLevel& level : manifest.noise_levels) levels_.emplace(level.name, levels_.size());
  for (const ManifestMethod& method : manifest.algorithms) {
    const ManifestMethod::OfList list = method.of_list.value_or(ManifestMethod::OfList{});
    methods_.emplace(std::pair(method.name, method.protocol),
                     Method{methods_.size(), method.id, list.method, list.training, method.steps,
                            method.merit != "mtf" && method.merit != "edge_energy", method.merit == "rmse"});
  }
  several_suites_ = manifest.suites.size() > 1;
  sealed_ = manifest.sealed();
  seed_ = manifest.seed;
  first_instance_ = manifest.first_instance;
  instance_count_ = manifest.instances;
  for (const std::string& id : manifest.order) order_.emplace(id, order_.size());
  known_.resize(order_.size());
  has_order_ = !order_.empty();
}

void FolderChecks::add(const TrialRecord& closing, const std::vector<StepNumbers>& steps) {
  auto planned = order_.find(closing.trial);
  if (planned == order_.end()) {
    if (has_order_) return;
    planned = order_.emplace(closing.trial, known_.size()).first;
    known_.emplace_back();
  }
  Known& known = known_[planned->second];
  if (known.recorded) return trials_.add(trial_text(closing) + " is recorded twice");
  known.recorded = true;
  known.ended_well = ended_well(closing.end);
  known.steps = static_cast<std::uint32_t>(steps.size());
  check_trial(closing, known);
  check_steps(closing, steps);
  check_scores(closing, steps);
}

void FolderChecks::check_trial(const TrialRecord& closing, Known& known) {
  const auto complain = [&](const std::string& what) { trials_.add(trial_text(closing) + " " + what); };
  const auto scene = scenes_.find(closing.scene);
  const auto level = levels_.find(closing.noise_level);
  const auto method = methods_.find({closing.algorithm, closing.protocol});
  if (!scenes_.empty() && scene == scenes_.end())
    complain("is on the scene " + in_quotes(closing.scene) + ", which the manifest does not have");
  if (!levels_.empty() && level == levels_.end())
    complain("has the noise level " + in_quotes(closing.noise_level) + ", which the manifest does not have");
  if (!methods_.empty() && method == methods_.end())
    complain("is of the method " + in_quotes(closing.algorithm) + " under the protocol " + in_quotes(closing.protocol) +
             ", which the manifest does not have");
  if (!is_end(closing.end)) complain("ended by " + in_quotes(closing.end) + ", which is not an end of a trial");
  if (method != methods_.end()) {
    const Method& of = method->second;
    if (of.steps != closing.budget)
      complain("has a budget of " + counted(closing.budget, "step") + ", the manifest " + std::to_string(of.steps));
    if (of.id != closing.algorithm_id)
      complain("is of the algorithm " + in_quotes(closing.algorithm_id) + ", the manifest has " + in_quotes(of.id));
    // A manifest of several suites has the list of one of them.
    if (!several_suites_ && (of.list != closing.method || of.training != closing.training))
      complain("is of the training " + in_quotes(closing.training) + " of " + in_quotes(closing.method) +
               ", the manifest has " + in_quotes(of.training) + " of " + in_quotes(of.list));
  }
  if (closing.instance < first_instance_ || closing.instance - first_instance_ >= instance_count_)
    complain("is on instance " + std::to_string(closing.instance) + ", but the manifest has " +
             std::to_string(first_instance_) + " to " +
             std::to_string(first_instance_ + std::max<std::uint64_t>(instance_count_, 1) - 1));
  // Of a sealed suite the records state none.
  if (sealed_ && closing.instance_seed != 0) complain("states the seed of its instance, although the suite is sealed");
  if (!sealed_ && closing.instance_seed != 0 && scene != scenes_.end() && !scene->second.is_station)
    if (const std::uint64_t own = instance_seed(seed_, SeedDomain::benchmark, closing.instance);
        own != closing.instance_seed)
      complain("has the instance seed " + std::to_string(closing.instance_seed) + ", but the seed of the suite gives " +
               std::to_string(own));
  if (scene == scenes_.end() || level == levels_.end() || method == methods_.end()) return;
  known.in_place = true;
  known.place = {scene->second.place, level->second, method->second.place, closing.instance};
}

// Step 0 is the capture at the start, which is not part of the budget.
void FolderChecks::check_steps(const TrialRecord& closing, const std::vector<StepNumbers>& steps) {
  const auto complain = [&](const std::string& what) { steps_.add(trial_text(closing) + " " + what); };
  const std::size_t most = std::size_t{closing.budget} + 1, count = steps.size();
  const std::string found = " has " + counted(count, "step line") + " and ended by " + in_quotes(closing.end) +
                            ", which with a budget of " + std::to_string(closing.budget) + " means ";
  if ((closing.end == "budget_spent" || closing.end == "overspent") && count != most)
    steps_.add(trial_text(closing) + found + std::to_string(most));
  else if (closing.end == "finished" && (count == 0 || count >= most))
    steps_.add(trial_text(closing) + found + "1 to " + std::to_string(most - 1));
  else if (count > most)
    steps_.add(trial_text(closing) + found + "at most " + std::to_string(most));
  for (std::size_t i = 0; i < count; ++i)
    if (steps[i].step != i)
      return complain("has step " + std::to_string(steps[i].step) + " where " + std::to_string(i) + " is due");
}

void FolderChecks::check_scores(const TrialRecord& closing, const std::vector<StepNumbers>& steps) {
  const auto found = scenes_.find(closing.scene);
  const auto method = methods_.find({closing.algorithm, closing.protocol});
  Scene of_closing, &scene = found == scenes_.end() ? of_closing : found->second;
  if (scene.axes == 0 && !steps.empty()) scene.axes = steps.front().commanded_pose.size();
  const ScoreTerms terms = {found != scenes_.end(),
                            scene.has_truth && !scene.is_station,
                            scene.is_station,
                            method == methods_.end() || method->second.merit_has_rmse,
                            method != methods_.end() && method->second.merit_is_rmse,
                            scene.axes,
                            scene.squared,
                            scene.resolution,
                            scene.step_seconds};
  if (const std::string flaw = flaw_of_scores(closing, steps, terms); !flaw.empty())
    return scores_.add(trial_text(closing) + " " + flaw);
  if (scene.is_station) return;
  if (const std::string flaw = of_instances_.add(closing, steps); !flaw.empty())
    instances_.add(trial_text(closing) + " " + flaw);
}

void FolderChecks::add(const TrialTimes& times) {
  const auto planned = order_.find(times.trial);
  if (planned == order_.end()) return;
  Known& known = known_[planned->second];
  known.timed = true;
  for (const std::vector<double>* values :
       {&times.algorithm_seconds, &times.simulation_seconds, &times.truth_seconds}) {
    if (known.ended_well && values->size() != known.steps)
      return steps_.add("the times of trial " + times.trial + " are of " + counted(values->size(), "step") +
                        ", but it has " + std::to_string(known.steps));
  }
  if (const std::string flaw = flaw_of_times(times); !flaw.empty())
    scores_.add("the line of trial " + times.trial + " in times/ " + flaw);
}

Checks FolderChecks::result(Check plan, bool all_times) {
  const Place* before = nullptr;
  for (const Known& known : known_) {
    if (!known.in_place) continue;
    if (before && !(*before < known.place)) {
      trials_.add("'order' lists instance " + std::to_string(std::get<3>(known.place)) +
                  " of a method after a later trial, or twice; a plan is sorted by scene, noise level, method and "
                  "instance");
      break;
    }
    before = &known.place;
  }
  for (std::string& finding : of_instances_.findings()) instances_.add(std::move(finding));
  const auto without = static_cast<std::size_t>(
      std::count_if(known_.begin(), known_.end(), [](const Known& one) { return one.recorded && !one.timed; }));
  if (all_times && has_order_ && without > 0)
    trials_.add(counted(without, "trial") + (without == 1 ? " lacks its line" : " lack their lines") + " in times/");
  return {std::move(manifest_), std::move(plan),    std::move(trials_),
          std::move(steps_),    std::move(scores_), std::move(instances_)};
}

Checks check_folder(const std::filesystem::path& folder, const PlanCheck& plan, std::vector<Damage>* damaged) {
  require_results(folder);
  const Manifest manifest = manifest_of(folder);
  require_consistent(manifest, folder);
  FolderChecks checks(manifest, folder);
  for_each_with_steps(
      folder,
      [&checks](const TrialRecord& closing, const StoredTrial&, const std::vector<StepNumbers>& steps) {
        checks.add(closing, steps);
      },
      {}, damaged);
  for_each_times(
      folder, [&checks](const TrialTimes& times) { checks.add(times); }, damaged);
  return checks.result(made_by(plan, manifest), !damaged || damaged->empty());
}

void require_checked(const std::filesystem::path& folder, const PlanCheck& plan, const std::string& what,
                     std::vector<Damage>* damaged) {
  const std::vector<std::string> findings = findings_of(check_folder(folder, plan, damaged));
  if (!findings.empty())
    throw Error(ErrorKind::bad_input, what + " '" + folder.string() + "', because checks of its records failed:\n  " +
                                          join(findings, "\n  "));
}

}  // namespace relign::records
