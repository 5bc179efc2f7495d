#include "report/page_groups.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "base/hash.h"
#include "base/json_members.h"
#include "report/page_data.h"

namespace relign::report {
namespace {

using GroupKey = std::tuple<std::string, std::string, std::string>;  // scene, noise level, protocol

template <typename Record>
GroupKey key_of(const Record& record) {
  return {record.scene, record.noise_level, record.protocol};
}

Json quantiles_json(const statistics::Quantiles& values) {
  if (values.n == 0) return {{"n", 0}};
  return {{"n", values.n},
          {"median", shown_number(values.median)},
          {"q25", shown_number(values.q25)},
          {"q75", shown_number(values.q75)}};
}

Json curve_json(const statistics::Curve& curve) {
  Json tracks = Json::object();
  for (std::size_t k = 0; k < statistics::kTracks.size(); ++k) {
    Json median = Json::array(), q25 = Json::array(), q75 = Json::array();
    bool any = false;
    for (const statistics::CurvePoint& point : curve.points) {
      const statistics::Quantiles& values = point.tracks[k];
      any = any || values.n > 0;
      median.push_back(values.n > 0 ? shown_number(values.median) : Json());
      q25.push_back(values.n > 0 ? shown_number(values.q25) : Json());
      q75.push_back(values.n > 0 ? shown_number(values.q75) : Json());
    }
    if (any) tracks[statistics::track_name(statistics::kTracks[k])] = {{"median", median}, {"q25", q25}, {"q75", q75}};
  }
  return {{"method", curve.algorithm},
          {"trials", curve.trials},
          {"first_step", curve.points.empty() ? 0u : curve.points.front().step},
          {"tracks", tracks}};
}

// What the method observed in these trials: as in the manifest, but without the start if the protocol withholds it.
Json observed(const Json& method, bool start_is_observed) {
  Json names = Json::array();
  for (const Json& name : method["observes"])
    if (name != "start" || start_is_observed || flag_of(method, "oracle")) names.push_back(name);
  return names;
}

Json row_json(const statistics::RankingRow& row, const Methods& methods, bool station) {
  const Json& method = methods.of(row.algorithm, row.protocol);
  Json json = {{"method", row.algorithm},
               {"oracle", method["oracle"]},
               {"class", method["class"]},
               {"merit", method["merit"]},
               {"key", method["key"]},
               {"observes", observed(method, row.protocol != "blind" && !station)},
               {"trials", row.trials},
               {"failed", row.failed},
               {"step", row.step},
               {"recommended", quantiles_json(row.recommended)},
               {"commanded", quantiles_json(row.commanded)},
               {"machine_seconds", row.score().n > 0 ? shown_number(row.machine_seconds_median) : Json()},
               {"algorithm_ms_per_step", shown_number(row.algorithm_ms_per_step_median)}};
  if (row.measured_only) json["measured"] = quantiles_json(row.best_measured);
  return json;
}

// The parts of the key that differ between groups. A station has no noise level.
std::string group_label(const GroupKey& key, bool station, bool scenes_differ, bool protocols_differ) {
  const auto& [scene, level, protocol] = key;
  return (station ? scene : (scenes_differ ? scene + ", " : "") + level) + (protocols_differ ? ", " + protocol : "");
}

struct Group {
  std::set<std::uint64_t> instances;          // of any trial
  bool same_instances = true;                 // all methods have finished the same instances
  std::vector<double> start, measured_start;  // one value per instance
};

std::vector<std::uint64_t> finished_instances(const statistics::TrialTable& trials, const statistics::Series& series) {
  std::vector<std::uint64_t> instances;
  for (const std::uint32_t row : series.trials) instances.push_back(trials.rows[row].instance);
  std::sort(instances.begin(), instances.end());
  return instances;
}

std::map<GroupKey, Group> gather(const statistics::TrialTable& trials, std::vector<GroupKey>& order) {
  std::map<GroupKey, Group> groups;
  std::map<GroupKey, std::vector<std::uint64_t>> finished_by_the_first;
  std::vector<Group*> group_of;
  for (const statistics::Series& series : trials.series) {
    const GroupKey key = key_of(series);
    if (std::find(order.begin(), order.end(), key) == order.end()) order.push_back(key);
    Group& group = groups[key];
    group_of.push_back(&group);
    std::vector<std::uint64_t> finished = finished_instances(trials, series);
    const auto [first, is_first] = finished_by_the_first.try_emplace(key, finished);
    if (!is_first && first->second != finished) group.same_instances = false;
  }
  std::map<const Group*, std::set<std::uint64_t>> started;
  for (const statistics::TrialRow& trial : trials.rows) {
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

}  // namespace

Methods::Methods(const LoadedResults& results) {
  for (const Json& entry : list_of(results.manifest, "algorithms")) {
    const std::string name = text_of(entry, "name");
    std::set<std::string> protocols = {text_of(entry, "protocol")};
    if (protocols.count("") > 0)  // without a protocol: that of its trials
      for (const statistics::Series& series : results.trials.series)
        if (series.algorithm == name) protocols.insert(series.protocol);
    if (protocols.size() > 1) protocols.erase("");
    Json method = {{"name", name}, {"known", entry.contains("observes")}};
    for (const char* key : {"id", "kind", "protocol", "merit", "summary", "reproducible", "plugin_hash"})
      method[key] = text_of(entry, key);
    method["observes"] = Json::array();
    for (const Json& known : list_of(entry, "observes"))
      if (known.is_string()) method["observes"].push_back(known);
    method["oracle"] = flag_of(entry, "oracle");
    method["steps"] = count_of(entry, "steps");
    method["parameters"] = object_of(entry, "parameters");
    for (const std::string& protocol : protocols) {
      if (name.empty() || places_.count({name, protocol}) > 0) continue;
      method["protocol"] = protocol;
      add(method);
    }
  }
  for (const statistics::Series& series : results.trials.series) {
    if (places_.count({series.algorithm, series.protocol}) > 0) continue;
    add({{"name", series.algorithm},
         {"id", series.algorithm_id},
         {"protocol", series.protocol},
         {"merit", ""},
         {"observes", Json::array()},
         {"oracle", series.algorithm_id == "home" && series.protocol == "blind"},
         {"steps", series.largest_budget},
         {"parameters", Json::object()}});
  }
}

void Methods::add(Json method) {
  method["class"] = class_of(method);
  method.erase("known");
  method["key"] = short_hash(canonical_json({{"name", method["name"]},
                                             {"id", method["id"]},
                                             {"protocol", method["protocol"]},
                                             {"merit", method["merit"]},
                                             {"parameters", method["parameters"]}}));
  places_[{text_of(method, "name"), text_of(method, "protocol")}] = list_.size();
  list_.push_back(std::move(method));
}

std::string class_of(const Json& method) {
  if (flag_of(method, "oracle")) return "oracle";
  if (!flag_of(method, "known")) return "unknown";
  const Json& observed = list_of(method, "observes");
  const auto has = [&observed](const char* what) {
    return std::find(observed.begin(), observed.end(), what) != observed.end();
  };
  if (has("images")) return has("design") || has("level") ? "images and design" : "images";
  return has("merit") ? "merit" : "neither";
}

std::string class_title(const std::string& name) {
  if (name == "oracle") return "Oracles";
  if (name == "neither") return "Methods that observe neither images nor the merit";
  if (name == "unknown") return "Methods whose observations the manifest does not list";
  return "Methods that observe " + std::string(name == "merit"               ? "the merit alone"
                                               : name == "images and design" ? "images and the design"
                                                                             : "images");
}

std::vector<std::string> classes_in(const Json& rows) {
  std::vector<std::string> classes;
  for (const char* name : kClasses)
    if (std::any_of(rows.begin(), rows.end(), [name](const Json& row) { return text_of(row, "class") == name; }))
      classes.emplace_back(name);
  return classes;
}

void label_methods(Json& methods) {
  std::map<std::string, std::size_t> uses;
  for (const Json& method : methods) ++uses[text_of(method, "name")];
  for (Json& method : methods) {
    const std::string name = text_of(method, "name");
    method["label"] = uses[name] > 1 ? name + " (" + text_of(method, "protocol") + ")" : name;
  }
}

Json groups_json(const LoadedResults& results, const statistics::Study& study, const Methods& methods) {
  std::vector<GroupKey> order;
  const std::map<GroupKey, Group> groups = gather(results.trials, order);
  std::set<std::string> scenes, protocols;
  for (const auto& [scene, level, protocol] : order) scenes.insert(scene), protocols.insert(protocol);
  std::set<std::string> stations;
  for (const Json& scene : list_of(results.manifest, "scenes"))
    if (flag_of(scene, "owns_stage")) stations.insert(text_of(scene, "name"));
  const std::vector<statistics::RankingRow> rows = statistics::ranking(results.trials, study.rule);

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
    const statistics::Quantiles start = statistics::quantiles(group.start);
    entry["start"] = start.n > 0 ? shown_number(start.median) : Json();
    entry["same_instances"] = group.same_instances;
    for (const statistics::RankingRow& row : rows)
      if (key_of(row) == key) entry["rows"].push_back(row_json(row, methods, station));
    bool measured = false, ground_truth = false;
    for (const Json& row : entry["rows"]) {
      measured = measured || row.contains("measured");
      ground_truth = ground_truth || row["recommended"]["n"] != 0;
    }
    if (measured && !ground_truth) {
      entry["measured_only"] = true;
      const statistics::Quantiles seen = statistics::quantiles(group.measured_start);
      entry["start"] = seen.n > 0 ? shown_number(seen.median) : Json();
    }
    for (const statistics::SeriesStudy& series : study.series)
      if (key_of(series.curve) == key && series.curve.trials > 0) entry["curves"].push_back(curve_json(series.curve));
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace relign::report
