#include "report/page_data.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "base/json_members.h"
#include "records/results_folder.h"
#include "report/statistics_data.h"
#include "report/verdict.h"

namespace relign::report {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kTrialsNamedPerFailure = 5;

using GroupKey = std::tuple<std::string, std::string, std::string>;  // scene, noise level, protocol

template <typename Record>
GroupKey key_of(const Record& record) {
  return {record.scene, record.noise_level, record.protocol};
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(rounded(value, kDataDigits)) : Json(); }

template <typename Value>
void add_once(std::vector<Value>& list, const Value& value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

// The manifest's entry of a method shown under this name, else what its trials tell.
struct Methods {
  explicit Methods(const LoadedResults& results) {
    for (const Json& entry : list_of(results.manifest, "algorithms")) {
      const std::string name = text_of(entry, "name");
      if (name.empty() || by_name.count(name) > 0) continue;
      Json method = {{"name", name}};
      for (const char* key : {"id", "kind", "protocol", "summary", "reproducible", "plugin_hash"})
        method[key] = text_of(entry, key);
      method["knows"] = Json::array();
      for (const Json& known : list_of(entry, "knows"))
        if (known.is_string()) method["knows"].push_back(known);
      method["oracle"] = flag_of(entry, "oracle");
      method["steps"] = count_of(entry, "steps");
      method["parameters"] = object_of(entry, "parameters");
      add(std::move(method));
    }
    for (const stats::Series& series : results.trials.series) {
      if (by_name.count(series.algorithm) > 0) continue;
      add({{"name", series.algorithm},
           {"id", series.algorithm_id},
           {"protocol", series.protocol},
           {"knows", Json::array()},
           {"oracle", series.algorithm_id == "home" && series.protocol == "blind"},
           {"steps", series.largest_budget},
           {"parameters", Json::object()}});
    }
  }
  void add(Json method) {
    by_name[text_of(method, "name")] = list.size();
    list.push_back(std::move(method));
  }
  const Json& operator[](const std::string& name) const { return list[by_name.at(name)]; }

  std::vector<Json> list;
  std::map<std::string, std::size_t> by_name;
};

Json quantiles_json(const stats::Quantiles& values) {
  if (values.n == 0) return {{"n", 0}};
  return {{"n", values.n},
          {"median", number_or_null(values.median)},
          {"q25", number_or_null(values.q25)},
          {"q75", number_or_null(values.q75)}};
}

Json curve_json(const stats::Curve& curve) {
  Json tracks = Json::object();
  for (std::size_t k = 0; k < stats::kTracks.size(); ++k) {
    Json median = Json::array(), q25 = Json::array(), q75 = Json::array();
    bool any = false;
    for (const stats::CurvePoint& point : curve.points) {
      const stats::Quantiles& values = point.tracks[k];
      any = any || values.n > 0;
      median.push_back(values.n > 0 ? number_or_null(values.median) : Json());
      q25.push_back(values.n > 0 ? number_or_null(values.q25) : Json());
      q75.push_back(values.n > 0 ? number_or_null(values.q75) : Json());
    }
    if (any) tracks[stats::track_name(stats::kTracks[k])] = {{"median", median}, {"q25", q25}, {"q75", q75}};
  }
  return {{"method", curve.algorithm},
          {"trials", curve.trials},
          {"first_step", curve.points.empty() ? 0u : curve.points.front().step},
          {"tracks", tracks}};
}

// What the method was told in these trials: the manifest's words, but the start where nobody tells it.
Json told(const Json& method, bool start_is_told) {
  Json words = Json::array();
  for (const Json& word : method["knows"])
    if (word != "start" || start_is_told || flag_of(method, "oracle")) words.push_back(word);
  return words;
}

Json row_json(const stats::RankingRow& row, const Methods& methods, bool station) {
  const Json& method = methods[row.algorithm];
  Json json = {{"method", row.algorithm},
               {"oracle", method["oracle"]},
               {"knows", told(method, row.protocol != "blind" && !station)},
               {"trials", row.trials},
               {"failed", row.failed},
               {"step", row.step},
               {"recommended", quantiles_json(row.recommended)},
               {"commanded", quantiles_json(row.commanded)},
               {"machine_seconds", row.score().n > 0 ? number_or_null(row.machine_seconds_median) : Json()},
               {"algorithm_ms_per_step", number_or_null(row.algorithm_ms_per_step_median)}};
  if (row.measured_only) json["measured"] = quantiles_json(row.best_measured);
  return json;
}

// Names what tells this group from the others, and nothing that is the same everywhere. A station has no noise level.
std::string group_label(const GroupKey& key, bool station, bool scenes_differ, bool protocols_differ) {
  const auto& [scene, level, protocol] = key;
  return (station ? scene : (scenes_differ ? scene + ", " : "") + level) + (protocols_differ ? ", " + protocol : "");
}

struct Group {
  std::set<std::uint64_t> instances;          // any trial's
  bool same_instances = true;                 // every method has finished the same ones
  std::vector<double> start, measured_start;  // one value an instance
};

std::vector<std::uint64_t> finished_instances(const stats::TrialTable& trials, const stats::Series& series) {
  std::vector<std::uint64_t> instances;
  for (const std::uint32_t row : series.trials) instances.push_back(trials.rows[row].instance);
  std::sort(instances.begin(), instances.end());
  return instances;
}

std::map<GroupKey, Group> gather(const stats::TrialTable& trials, std::vector<GroupKey>& order) {
  std::map<GroupKey, Group> groups;
  std::map<GroupKey, std::vector<std::uint64_t>> finished_by_the_first;
  std::vector<Group*> group_of;
  for (const stats::Series& series : trials.series) {
    const GroupKey key = key_of(series);
    add_once(order, key);
    Group& group = groups[key];
    group_of.push_back(&group);
    std::vector<std::uint64_t> finished = finished_instances(trials, series);
    const auto [first, is_first] = finished_by_the_first.try_emplace(key, finished);
    if (!is_first && first->second != finished) group.same_instances = false;
  }
  std::map<const Group*, std::set<std::uint64_t>> started;
  for (const stats::TrialRow& trial : trials.rows) {
    Group& group = *group_of[trial.series];
    group.instances.insert(trial.instance);
    if ((std::isnan(trial.start_commanded) && std::isnan(trial.start_measured)) ||
        !started[&group].insert(trial.instance).second)
      continue;
    group.start.push_back(trial.start_commanded);
    group.measured_start.push_back(trial.start_measured);
  }
  return groups;
}

Json groups_json(const LoadedResults& results, const stats::Study& study, const Methods& methods) {
  std::vector<GroupKey> order;
  const std::map<GroupKey, Group> groups = gather(results.trials, order);
  std::set<std::string> scenes, protocols;
  for (const auto& [scene, level, protocol] : order) scenes.insert(scene), protocols.insert(protocol);
  std::set<std::string> stations;
  for (const Json& scene : list_of(results.manifest, "scenes"))
    if (flag_of(scene, "owns_stage")) stations.insert(text_of(scene, "name"));
  const std::vector<stats::RankingRow> rows = stats::ranking(results.trials);

  Json list = Json::array();
  for (const GroupKey& key : order) {
    const Group& group = groups.at(key);
    const bool station = stations.count(std::get<0>(key)) > 0;
    Json entry = {{"scene", std::get<0>(key)},
                  {"noise_level", std::get<1>(key)},
                  {"protocol", std::get<2>(key)},
                  {"label", group_label(key, station, scenes.size() > 1, protocols.size() > 1)},
                  {"instances", group.instances.size()},
                  {"rows", Json::array()},
                  {"curves", Json::array()}};
    if (station) entry["station"] = true;
    const stats::Quantiles start = stats::quantiles(group.start);
    entry["start"] = start.n > 0 ? number_or_null(start.median) : Json();
    entry["same_instances"] = group.same_instances;
    for (const stats::RankingRow& row : rows)
      if (key_of(row) == key) entry["rows"].push_back(row_json(row, methods, station));
    bool measured = false, truth = false;
    for (const Json& row : entry["rows"]) {
      measured = measured || row.contains("measured");
      truth = truth || row["recommended"]["n"] != 0;
    }
    if (measured && !truth) {
      entry["measured_only"] = true;
      const stats::Quantiles seen = stats::quantiles(group.measured_start);
      entry["start"] = seen.n > 0 ? number_or_null(seen.median) : Json();
    }
    for (const stats::SeriesStudy& series : study.series)
      if (key_of(series.curve) == key && series.curve.trials > 0) entry["curves"].push_back(curve_json(series.curve));
    list.push_back(std::move(entry));
  }
  return list;
}

// One entry per method and message, so that a thousand equal failures stay one line.
Json failures_json(const stats::TrialTable& trials) {
  std::map<std::pair<std::string, std::string>, std::size_t> place;
  Json list = Json::array();
  for (const stats::TrialRow& trial : trials.rows) {
    if (trial.ended_well) continue;
    const stats::Series& series = trials.series_of(trial);
    const std::string& message = trials.text(trial.message);
    const auto [found, is_new] = place.try_emplace({series.algorithm, message}, list.size());
    if (is_new)
      list.push_back({{"method", series.algorithm}, {"message", message}, {"count", 0}, {"trials", Json::array()}});
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

Json warnings_json(const stats::TrialTable& trials) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (const auto& [warning, count] : trials.warnings)
    counts[{trials.series[warning.series].algorithm, trials.text(warning.text)}] += count;
  Json list = Json::array();
  for (const auto& [what, count] : counts)
    list.push_back({{"method", what.first}, {"message", what.second}, {"count", count}});
  return list;
}

// What the harness itself took, over all trials that say so; null when none does.
Json harness_json(const stats::TrialTable& trials) {
  if (trials.timed_steps == 0) return nullptr;
  const double scene = trials.scene_seconds;
  return {{"microseconds_per_step", rounded(1e6 * trials.harness_seconds / static_cast<double>(trials.timed_steps), 3)},
          {"share_of_scene_time", scene > 0 ? number_or_null(trials.harness_seconds / scene) : Json()}};
}

Json ran_json(const LoadedResults& results) {
  const std::deque<stats::TrialRow>& trials = results.trials.rows;
  const auto failed = static_cast<std::size_t>(
      std::count_if(trials.begin(), trials.end(), [](const stats::TrialRow& trial) { return !trial.ended_well; }));
  const std::size_t ended = trials.size();
  std::size_t planned = results.planned;
  if (planned == 0) planned = count_of(results.manifest, "trials");
  planned = std::max(planned, ended + results.incomplete.size());
  return {{"planned", planned},
          {"finished", ended - failed},
          {"failed", failed},
          {"missing", planned - ended},  // incomplete ones among them
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

Json page_data(const LoadedResults& results) {
  return page_data(results, stats::make_study(results.trials, study_options(results)));
}

Json page_data(const LoadedResults& results, const stats::Study& study) {
  const Json& manifest = results.manifest;
  const Methods methods(results);
  std::vector<std::string> scenes, levels, protocols;
  for (const stats::Series& series : results.trials.series) {
    add_once(scenes, series.scene);
    add_once(levels, series.noise_level);
    add_once(protocols, series.protocol);
  }
  std::set<std::uint64_t> instances;
  unsigned least_steps = std::numeric_limits<unsigned>::max(), most_steps = 0;
  for (const stats::TrialRow& trial : results.trials.rows) {
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
  data["methods"] = methods.list;
  data["groups"] = groups_json(results, study, methods);
  data["failures"] = failures_json(results.trials);
  data["warnings"] = warnings_json(results.trials);
  add_statistics(data, results, study);
  data["verdict"] = verdict(data);
  data["beware"] = beware(data);
  return data;
}

}  // namespace relign::report
