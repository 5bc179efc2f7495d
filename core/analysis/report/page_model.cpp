#include "report/page_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/json_members.h"
#include "records/manifest_check.h"
#include "records/results_folder.h"
#include "report/aggregate_data.h"
#include "report/gates.h"
#include "report/page_groups.h"
#include "report/rules_data.h"
#include "report/scene_data.h"
#include "report/spec_words.h"
#include "report/statistics_data.h"
#include "report/training_data.h"
#include "report/verdict.h"

namespace relign::report {
namespace {

constexpr std::size_t kTrialsNamedPerFailure = 5;

template <typename Value>
void add_once(std::vector<Value>& list, const Value& value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

// One entry per method and message, so that equal failures take one line.
std::vector<Failure> failures_of(const statistics::TrialTable& trials, const std::vector<Method>& methods) {
  std::map<std::pair<std::string, std::string>, std::size_t> place;
  std::vector<Failure> list;
  for (const statistics::TrialRow& trial : trials.rows) {
    if (trial.ended_well) continue;
    const statistics::Series& series = trials.series_of(trial);
    const std::string& message = trials.text(trial.message);
    const std::string label = label_of(methods, series.algorithm, series.protocol);
    const auto [found, is_new] = place.try_emplace({label, message}, list.size());
    if (is_new) list.push_back({label, message, 0, {}});
    Failure& failure = list[found->second];
    ++failure.count;
    if (failure.trials.size() >= kTrialsNamedPerFailure) continue;
    const std::string log = records::log_file(trial.trial);
    std::error_code code;
    failure.trials.push_back({trial.trial, series.scene, series.noise_level, series.protocol, trial.instance,
                              trial.last_step, std::filesystem::exists(trials.folder / log, code) ? log : ""});
  }
  return list;
}

std::vector<PluginWarning> warnings_of(const statistics::TrialTable& trials, const std::vector<Method>& methods) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (const auto& [warning, count] : trials.warnings)
    counts[{label_of(methods, trials.series[warning.series].algorithm, trials.series[warning.series].protocol),
            trials.text(warning.text)}] += count;
  std::vector<PluginWarning> list;
  for (const auto& [what, count] : counts) list.push_back({what.first, what.second, count});
  return list;
}

RunState state_of(const LoadedResults& results) {
  const statistics::TrialTable& trials = results.trials;
  RunState ran;
  for (const statistics::TrialRow& trial : trials.rows) ++(trial.ended_well ? ran.finished : ran.failed);
  const std::size_t planned = results.planned > 0 ? results.planned : results.manifest.trials;
  ran.planned = std::max(planned, trials.rows.size() + results.incomplete.size());
  ran.missing = ran.planned - trials.rows.size();
  ran.incomplete = results.incomplete;
  ran.from_other_plans = results.from_other_plans;
  if (trials.timed_steps > 0)
    ran.harness = {rounded(1e6 * trials.harness_seconds / static_cast<double>(trials.timed_steps), 3),
                   shown(trials.harness_seconds / trials.scene_seconds)};
  return ran;
}

}  // namespace

// Missing where the scenes' scores have different ones.
static double common_resolution(const PageModel& page) {
  double resolution = page.groups.empty() ? kMissing : page.groups.front().scored_by.resolution;
  for (const Group& group : page.groups)
    if (group.scored_by.resolution != resolution) resolution = kMissing;
  return resolution;
}

SceneScore common_score(const PageModel& page) {
  SceneScore score = page.groups.empty() ? SceneScore() : page.groups.front().scored_by;
  const auto differs = [&score](const Group& group) {
    return group.scored_by.label() != score.label() || group.scored_by.squared != score.squared;
  };
  if (any_group(page, differs)) score.name = "score", score.unit.clear(), score.squared = false;
  return score;
}

SceneWords common_words(const PageModel& page) {
  SceneWords words = page.groups.empty() ? SceneWords() : page.groups.front().words;
  for (const Group& group : page.groups) words = common_words(words, group.words);
  return words;
}

PageModel page_model(const LoadedResults& results) {
  return page_model(results, statistics::make_study(results.trials, study_options(results)));
}

PageModel page_model(const LoadedResults& results, const statistics::Study& study) {
  const records::Manifest& manifest = results.manifest;
  const statistics::StudyOptions options = study_options(results, study.rule);
  const Methods methods(results);
  PageModel page;
  page.provenance = provenance_of(manifest);
  page.title = page.provenance.suite_name;
  for (const statistics::Series& series : results.trials.series) {
    add_once(page.scenes, series.scene);
    add_once(page.noise_levels, series.noise_level);
    add_once(page.protocols, series.protocol);
  }
  std::set<std::uint64_t> instances;
  for (const statistics::TrialRow& trial : results.trials.rows) {
    instances.insert(trial.instance);
    if (!page.steps) page.steps = {trial.budget, trial.budget};
    page.steps->least = std::min(page.steps->least, trial.budget);
    page.steps->most = std::max(page.steps->most, trial.budget);
  }
  page.instances = instances.size();
  page.ran = state_of(results);
  page.methods = methods.list();
  label_methods(page.methods);
  page.rule = study.rule;
  page.targets = options.targets;
  page.resamples = study.resamples;
  page.smallest_relevant_ratio = options.smallest_relevant_ratio;
  page.scene_facts = scene_facts(results.folder, manifest);
  page.groups = page_groups(results, study, methods, options.smallest_relevant_ratio);
  for (Group& group : page.groups)
    for (const SceneFacts& facts : page.scene_facts)
      if (facts.scene == group.scene) group.words = facts.words;
  if (const double resolution = common_resolution(page); page.targets.empty() && !std::isnan(resolution))
    page.targets = statistics::default_targets(resolution);
  page.failures = failures_of(results.trials, page.methods);
  page.warnings = warnings_of(results.trials, page.methods);
  page.spec = manifest.spec.is_null() ? Json::object() : manifest.spec;
  page.spec_text = spec_sentence(page.groups);
  page.without_suite = !manifest.has_suites();
  page.gates = quality_gates(page, results);
  page.aggregates = aggregates_of(results, study, page.methods);
  for (Aggregate& aggregate : page.aggregates) aggregate.resolution = common_resolution(page);
  page.training = training_costs(manifest, page.methods, page.groups);
  page.analysis = analysis_of(manifest, study.rule);
  page.rules_note = rules_note(page.groups, page.analysis.primary_is_yield);
  page.verdict = verdict(page);
  page.caveats = caveats(page);
  return page;
}

}  // namespace relign::report
