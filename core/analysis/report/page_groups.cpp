#include "report/page_groups.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "base/displayed_rmse.h"
#include "base/json_members.h"
#include "report/rules_data.h"
#include "report/scene_bounds.h"
#include "report/statistics_data.h"

namespace relign::report {
namespace {

using GroupKey = std::tuple<std::string, std::string, std::string>;  // scene, noise level, protocol

template <typename Record>
GroupKey key_of(const Record& record) {
  return {record.scene, record.noise_level, record.protocol};
}

Row row_of(const statistics::RankingRow& from, const Method& method, bool station) {
  Row row;
  row.method = from.algorithm;
  row.merit = method.merit;
  row.key = method.key;
  row.training_tag = method.training_tag;
  row.of_class = method.of_class;
  row.observes = observed_words(method, from.protocol != "blind" && !station);
  row.trials = from.trials;
  row.failed = from.failed;
  row.step = from.step;
  row.recommended = score_of(from.recommended);
  row.commanded = score_of(from.commanded);
  if (from.measured_only) row.measured = score_of(from.best_measured);
  if (from.score().n > 0) row.machine_seconds = shown(from.machine_seconds_median);
  row.algorithm_ms_per_step = shown(from.algorithm_ms_per_step_median);
  return row;
}

// The parts of the key that differ between groups. A station has no noise level.
std::string group_label(const Group& group, bool scenes_differ, bool protocols_differ) {
  return (group.station ? group.scene : (scenes_differ ? group.scene + ", " : "") + group.noise_level) +
         (protocols_differ ? ", " + group.protocol : "");
}

// The trials of a group.
struct Gathered {
  std::set<std::uint64_t> instances;                        // of any trial
  bool same_instances = true;                               // all methods have finished the same instances
  std::vector<double> start, measured_start, start_excess;  // one value per instance
};

std::vector<std::uint64_t> finished_instances(const statistics::TrialTable& trials, const statistics::Series& series) {
  std::vector<std::uint64_t> instances;
  for (const std::uint32_t row : series.trials) instances.push_back(trials.rows[row].instance);
  std::sort(instances.begin(), instances.end());
  return instances;
}

std::map<GroupKey, Gathered> gather(const statistics::TrialTable& trials) {
  std::map<GroupKey, Gathered> groups;
  std::map<GroupKey, std::vector<std::uint64_t>> finished_by_the_first;
  std::vector<Gathered*> group_of;
  for (const statistics::Series& series : trials.series) {
    const GroupKey key = key_of(series);
    Gathered& group = groups[key];
    group_of.push_back(&group);
    std::vector<std::uint64_t> finished = finished_instances(trials, series);
    const auto [first, is_first] = finished_by_the_first.try_emplace(key, finished);
    if (!is_first && first->second != finished) group.same_instances = false;
  }
  std::map<const Gathered*, std::set<std::uint64_t>> started, with_excess;
  for (const statistics::TrialRow& trial : trials.rows) {
    Gathered& group = *group_of[trial.series];
    group.instances.insert(trial.instance);
    const double start_mse = trial.start_commanded * trial.start_commanded;
    if (const double excess = displayed_rmse(start_mse - trial.own_optimum_mse);
        !std::isnan(excess) && with_excess[&group].insert(trial.instance).second)
      group.start_excess.push_back(excess);
    if ((std::isnan(trial.start_commanded) && std::isnan(trial.start_measured)) ||
        !started[&group].insert(trial.instance).second)
      continue;
    group.start.push_back(trial.start_commanded);
    group.measured_start.push_back(trial.start_measured);
  }
  return groups;
}

double median_of(const std::vector<double>& values) {
  const statistics::Quantiles found = statistics::quantiles(values);
  return found.n > 0 ? shown(found.median) : kMissing;
}

}  // namespace

std::vector<Group> page_groups(const LoadedResults& results, const statistics::Study& study, const Methods& methods,
                               double smallest_relevant_ratio) {
  const std::map<GroupKey, Gathered> gathered = gather(results.trials);
  std::set<std::string> scenes, protocols, stations;
  for (const auto& [key, group] : gathered) scenes.insert(std::get<0>(key)), protocols.insert(std::get<2>(key));
  for (const Json& scene : list_of(results.manifest, "scenes"))
    if (flag_of(scene, "owns_stage")) stations.insert(text_of(scene, "name"));
  const std::vector<statistics::RankingRow> ranking = statistics::ranking(results.trials, study.rule);
  const std::map<std::string, std::vector<SceneAxis>> axes = scene_axes(results.folder, results.manifest);

  std::vector<Group> groups;
  for (const statistics::GroupStudy& found : study.groups) {
    const GroupKey key = key_of(found);
    const Gathered& trials = gathered.at(key);
    Group group;
    group.scene = found.scene;
    group.noise_level = found.noise_level;
    group.protocol = found.protocol;
    group.station = stations.count(group.scene) > 0;
    group.label = group_label(group, scenes.size() > 1, protocols.size() > 1);
    group.instances = trials.instances.size();
    group.same_instances = trials.same_instances;
    bool measured = false, ground_truth = false;
    for (const statistics::RankingRow& row : ranking) {
      if (key_of(row) != key) continue;
      group.rows.push_back(row_of(row, methods.of(row.algorithm, row.protocol), group.station));
      measured = measured || row.measured_only;
      ground_truth = ground_truth || row.recommended.n > 0;
    }
    group.measured_only = measured && !ground_truth;
    group.start = median_of(group.measured_only ? trials.measured_start : trials.start);
    group.start_excess = median_of(trials.start_excess);
    const auto of_scene = axes.find(group.scene);
    add_statistics(group, found, study, of_scene == axes.end() ? std::vector<SceneAxis>() : of_scene->second,
                   next_image_excess(results.folder, results.manifest, found.scene, found.noise_level),
                   smallest_relevant_ratio);
    if (!group.measured_only) add_rules(group, found, study, smallest_relevant_ratio);
    groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace relign::report
