#include "report/page_data.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "records/results_folder.h"
#include "report/verdict.h"
#include "stats/curves.h"

namespace relign::report {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kDigits = 5;
constexpr std::size_t kTrialsNamedPerFailure = 5;

using GroupKey = std::tuple<std::string, std::string, std::string>;  // scene, noise level, protocol

template <typename Record>
GroupKey key_of(const Record& record) {
  return {record.scene, record.noise_level, record.protocol};
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(rounded(value, kDigits)) : Json(); }

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
    for (const records::TrialRecord& trial : results.trials) {
      if (by_name.count(trial.algorithm) > 0) continue;
      add({{"name", trial.algorithm},
           {"id", trial.algorithm_id},
           {"protocol", trial.protocol},
           {"knows", Json::array()},
           {"oracle", trial.algorithm_id == "home" && trial.protocol == "blind"},
           {"steps", trial.budget},
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
  std::set<std::uint64_t> instances;                                  // any trial's
  std::map<std::string, std::set<std::uint64_t>> finished_instances;  // per method, failed ones left out
  std::vector<double> start, measured_start;                          // one value an instance
  std::set<std::uint64_t> started;
};

std::map<GroupKey, Group> gather(const LoadedResults& results, std::vector<GroupKey>& order) {
  std::map<GroupKey, Group> groups;
  for (const records::TrialRecord& trial : results.trials) {
    const GroupKey key = key_of(trial);
    add_once(order, key);
    Group& group = groups[key];
    group.instances.insert(trial.instance);
    std::set<std::uint64_t>& finished = group.finished_instances[trial.algorithm];
    if (records::ended_well(trial.end)) finished.insert(trial.instance);
    if (!trial.steps.empty() && trial.steps.front().step == 0 && group.started.insert(trial.instance).second) {
      const std::optional<double> truth = stats::track_value(trial, stats::Track::commanded, 0);
      group.start.push_back(truth.value_or(kNone));
      group.measured_start.push_back(stats::track_value(trial, stats::Track::measured, 0).value_or(kNone));
    }
  }
  return groups;
}

Json groups_json(const LoadedResults& results, const Methods& methods) {
  std::vector<GroupKey> order;
  const std::map<GroupKey, Group> groups = gather(results, order);
  std::set<std::string> scenes, protocols;
  for (const auto& [scene, level, protocol] : order) scenes.insert(scene), protocols.insert(protocol);
  std::set<std::string> stations;
  for (const Json& scene : list_of(results.manifest, "scenes"))
    if (flag_of(scene, "owns_stage")) stations.insert(text_of(scene, "name"));
  const std::vector<stats::Curve> curves = stats::make_curves(results.trials);
  const std::vector<stats::RankingRow> rows = stats::ranking(curves, results.trials, results.times);

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
    entry["same_instances"] =
        std::all_of(group.finished_instances.begin(), group.finished_instances.end(),
                    [&](const auto& method) { return method.second == group.finished_instances.begin()->second; });
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
    for (const stats::Curve& curve : curves)
      if (key_of(curve) == key && curve.trials > 0) entry["curves"].push_back(curve_json(curve));
    list.push_back(std::move(entry));
  }
  return list;
}

// One entry per method and message, so that a thousand equal failures stay one line.
Json failures_json(const std::vector<records::TrialRecord>& trials, const std::filesystem::path& folder) {
  std::map<std::pair<std::string, std::string>, std::size_t> place;
  Json list = Json::array();
  for (const records::TrialRecord& trial : trials) {
    if (records::ended_well(trial.end)) continue;
    const auto [found, is_new] = place.try_emplace({trial.algorithm, trial.message}, list.size());
    if (is_new)
      list.push_back(
          {{"method", trial.algorithm}, {"message", trial.message}, {"count", 0}, {"trials", Json::array()}});
    Json& entry = list[found->second];
    entry["count"] = entry["count"].get<std::size_t>() + 1;
    if (entry["trials"].size() >= kTrialsNamedPerFailure) continue;
    const std::string log = records::log_file(trial.trial);
    std::error_code code;
    entry["trials"].push_back({{"trial", trial.trial},
                               {"scene", trial.scene},
                               {"noise_level", trial.noise_level},
                               {"protocol", trial.protocol},
                               {"instance", trial.instance},
                               {"steps", trial.steps.empty() ? 0u : trial.steps.back().step}});
    if (std::filesystem::exists(folder / log, code)) entry["trials"].back()["log"] = log;
  }
  return list;
}

Json warnings_json(const std::vector<records::TrialRecord>& trials) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (const records::TrialRecord& trial : trials)
    for (const std::string& warning : trial.warnings) ++counts[{trial.algorithm, warning}];
  Json list = Json::array();
  for (const auto& [what, count] : counts)
    list.push_back({{"method", what.first}, {"message", what.second}, {"count", count}});
  return list;
}

Json ran_json(const LoadedResults& results) {
  const auto failed = static_cast<std::size_t>(std::count_if(results.trials.begin(), results.trials.end(),
                                                             [](const auto& trial) { return !records::ended_well(trial.end); }));
  const std::size_t ended = results.trials.size();
  std::size_t planned = list_of(results.manifest, "order").size();
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

double best_measured_rmse(const records::TrialRecord& trial) {
  if (trial.steps.empty()) return kNone;
  return stats::track_value(trial, stats::Track::best, trial.steps.back().step).value_or(kNone);
}

double recommended_rmse(const records::TrialRecord& trial) {
  if (trial.steps.empty()) return kNone;
  return stats::track_value(trial, stats::Track::recommended, trial.steps.back().step).value_or(kNone);
}

double rounded(double value, int digits) {
  if (!std::isfinite(value)) return value;
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, digits - 1);
  double result = value;
  std::from_chars(buffer, end.ptr, result);
  return result;
}

Json page_data(const LoadedResults& results) {
  const Json& manifest = results.manifest;
  const Methods methods(results);
  std::vector<std::string> scenes, levels, protocols;
  std::set<std::uint64_t> instances;
  unsigned least_steps = std::numeric_limits<unsigned>::max(), most_steps = 0;
  for (const records::TrialRecord& trial : results.trials) {
    add_once(scenes, trial.scene);
    add_once(levels, trial.noise_level);
    add_once(protocols, trial.protocol);
    instances.insert(trial.instance);
    least_steps = std::min(least_steps, trial.budget);
    most_steps = std::max(most_steps, trial.budget);
  }
  Json data = {{"format", 1}, {"scenes", scenes}, {"noise_levels", levels}, {"protocols", protocols}};
  data["steps"] = results.trials.empty() ? Json::array() : Json{least_steps, most_steps};
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
  data["methods"] = methods.list;
  data["groups"] = groups_json(results, methods);
  data["failures"] = failures_json(results.trials, results.folder);
  data["warnings"] = warnings_json(results.trials);
  data["verdict"] = verdict(data);
  data["beware"] = beware(data);
  return data;
}

}  // namespace relign::report
