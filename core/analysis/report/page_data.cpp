#include "report/page_data.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <set>

#include "base/json_members.h"
#include "records/results_folder.h"
#include "report/aggregate_data.h"
#include "report/page_groups.h"
#include "report/rules_data.h"
#include "report/scene_data.h"
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
Json failures_json(const statistics::TrialTable& trials, const Json& methods) {
  std::map<std::pair<std::string, std::string>, std::size_t> place;
  Json list = Json::array();
  for (const statistics::TrialRow& trial : trials.rows) {
    if (trial.ended_well) continue;
    const statistics::Series& series = trials.series_of(trial);
    const std::string& message = trials.text(trial.message);
    const std::string label = label_of(methods, series.algorithm, series.protocol);
    const auto [found, is_new] = place.try_emplace({label, message}, list.size());
    if (is_new) list.push_back({{"method", label}, {"message", message}, {"count", 0}, {"trials", Json::array()}});
    Json& entry = list[found->second];
    entry["count"] = entry["count"].get<std::size_t>() + 1;
    if (entry["trials"].size() >= kTrialsNamedPerFailure) continue;
    const std::string log = records::log_file(trial.trial);
    std::error_code code;
    entry["trials"].push_back({{"trial", trial.trial},
                               {"scene", series.scene},
                               {"noise_level", series.noise_level},
                               {"protocol", series.protocol},
                               {"instance", trial.instance},
                               {"steps", trial.last_step}});
    if (std::filesystem::exists(trials.folder / log, code)) entry["trials"].back()["log"] = log;
  }
  return list;
}

Json warnings_json(const statistics::TrialTable& trials, const Json& methods) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (const auto& [warning, count] : trials.warnings)
    counts[{label_of(methods, trials.series[warning.series].algorithm, trials.series[warning.series].protocol),
            trials.text(warning.text)}] += count;
  Json list = Json::array();
  for (const auto& [what, count] : counts)
    list.push_back({{"method", what.first}, {"message", what.second}, {"count", count}});
  return list;
}

// Harness overhead over all trials that recorded it; null if none did.
Json harness_json(const statistics::TrialTable& trials) {
  if (trials.timed_steps == 0) return nullptr;
  const double scene = trials.scene_seconds;
  return {{"microseconds_per_step", rounded(1e6 * trials.harness_seconds / static_cast<double>(trials.timed_steps), 3)},
          {"share_of_scene_time", scene > 0 ? shown_number(trials.harness_seconds / scene) : Json()}};
}

Json ran_json(const LoadedResults& results) {
  const std::deque<statistics::TrialRow>& trials = results.trials.rows;
  const auto failed = static_cast<std::size_t>(
      std::count_if(trials.begin(), trials.end(), [](const statistics::TrialRow& trial) { return !trial.ended_well; }));
  const std::size_t ended = trials.size();
  std::size_t planned = results.planned;
  if (planned == 0) planned = count_of(results.manifest, "trials");
  planned = std::max(planned, ended + results.incomplete.size());
  return {{"planned", planned},
          {"finished", ended - failed},
          {"failed", failed},
          {"missing", planned - ended},  // includes incomplete ones
          {"incomplete", results.incomplete},
          {"from_other_plans", results.from_other_plans}};
}

}  // namespace

const Json& score_of(const Json& row) { return row.contains("measured") ? row["measured"] : row["recommended"]; }

double rounded(double value, int digits) {
  if (!std::isfinite(value)) return value;
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, digits - 1);
  double result = value;
  std::from_chars(buffer, end.ptr, result);
  return result;
}

std::string label_of(const Json& methods, const std::string& name, const std::string& protocol) {
  for (const Json& method : methods)
    if (text_of(method, "name") == name && text_of(method, "protocol") == protocol) return text_of(method, "label");
  return name;
}

double number_in(const Json& object, const char* key) {
  const Json& value = member(object, key);
  return value.is_number() ? value.get<double>() : statistics::kMissing;
}

double number_in(const Json& list, std::size_t at) {
  return list.is_array() && at < list.size() && list[at].is_number() ? list[at].get<double>() : statistics::kMissing;
}

Json shown_number(double value) { return std::isfinite(value) ? Json(rounded(value, kDataDigits)) : Json(); }

Json page_data(const LoadedResults& results) {
  return page_data(results, statistics::make_study(results.trials, study_options(results)));
}

Json page_data(const LoadedResults& results, const statistics::Study& study) {
  const Json& manifest = results.manifest;
  const Methods methods(results);
  std::vector<std::string> scenes, levels, protocols;
  for (const statistics::Series& series : results.trials.series) {
    add_once(scenes, series.scene);
    add_once(levels, series.noise_level);
    add_once(protocols, series.protocol);
  }
  std::set<std::uint64_t> instances;
  unsigned least_steps = std::numeric_limits<unsigned>::max(), most_steps = 0;
  for (const statistics::TrialRow& trial : results.trials.rows) {
    instances.insert(trial.instance);
    least_steps = std::min(least_steps, trial.budget);
    most_steps = std::max(most_steps, trial.budget);
  }
  Json data = {{"format", 1}, {"scenes", scenes}, {"noise_levels", levels}, {"protocols", protocols}};
  data["steps"] = results.trials.rows.empty() ? Json::array() : Json{least_steps, most_steps};
  data["instances"] = instances.size();
  for (const char* key : {"suite_name", "suite_file", "seed", "instance_set"}) data[key] = text_of(manifest, key);
  data["suite_text"] = text_of(manifest, "suite");
  std::string command;
  for (const Json& word : list_of(manifest, "command"))
    if (word.is_string()) command += (command.empty() ? "" : " ") + word.get<std::string>();
  data["command"] = command.empty() ? text_of(manifest, "command") : command;
  data["program"] = object_of(manifest, "program");
  data["machine"] = object_of(manifest, "machine");
  if (!list_of(manifest, "sources").empty()) {  // merged
    Json sources = Json::array();
    for (const Json& source : manifest["sources"])
      sources.push_back({{"folder", text_of(source, "folder")},
                         {"trials", count_of(source, "trials")},
                         {"cpu", text_of(object_of(source, "machine"), "cpu")},
                         {"program", text_of(object_of(source, "program"), "hash")}});
    data["sources"] = std::move(sources);
    data["merge"] = object_of(manifest, "merge");
  }
  data["ran"] = ran_json(results);
  if (Json harness = harness_json(results.trials); harness.is_object()) data["ran"]["harness"] = std::move(harness);
  data["methods"] = methods.list();
  label_methods(data["methods"]);
  data["groups"] = groups_json(results, study, methods);
  data["failures"] = failures_json(results.trials, data["methods"]);
  data["warnings"] = warnings_json(results.trials, data["methods"]);
  add_statistics(data, results, study);
  add_aggregate(data, results, study);
  data["scene_facts"] = scene_facts(results.folder, manifest);
  if (Json training = training_data(data, manifest); !training.empty()) data["training"] = std::move(training);
  add_rules(data, results, study);
  add_analysis(data, manifest);
  data["verdict"] = verdict(data);
  data["caveats"] = caveats(data);
  return data;
}

}  // namespace relign::report
