#include "report/page_groups.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "base/error.h"
#include "base/json_members.h"
#include "base/shell_words.h"
#include "report/rules_data.h"
#include "report/scene_data.h"
#include "report/statistics_data.h"
#include "report/verdict_cases.h"

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
    const SceneScore& score = trials.series_of(trial).score;
    const double start = score.squared ? trial.start_commanded * trial.start_commanded : trial.start_commanded;
    if (const double excess = score.shown(start - trial.own_optimum_mse);
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
  for (const records::ManifestScene& scene : results.manifest.scenes)
    if (scene.owns_stage) stations.insert(scene.name);
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
    group.scored_by = results.trials.series[found.series.front()].score;
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

namespace {

// In the units of `axes`; poses are shares of the travel.
std::vector<ResidualAxis> residual_axes(const std::vector<statistics::Quantiles>& residual,
                                        const std::vector<SceneAxis>& axes) {
  std::vector<ResidualAxis> list;
  if (axes.size() != residual.size()) return {};
  for (std::size_t axis = 0; axis < residual.size(); ++axis) {
    const double travel = axes[axis].upper - axes[axis].lower;
    if (!(travel > 0)) return {};
    if (!axes[axis].observable) continue;
    list.push_back({axes[axis].name, axes[axis].unit, shown(travel * residual[axis].median),
                    shown(travel * residual[axis].q75), shown(travel)});
  }
  return list;
}

statistics::Interval shown_arrivals(const statistics::Interval& interval) {
  return {shown_arrival(interval.low), shown_arrival(interval.high)};
}

TimeToSpec time_of(const statistics::ExpectedSteps& expected, const statistics::Band& steps,
                   const statistics::Band& seconds) {
  return {expected.successes,
          expected.trials,
          shown_arrival(steps.estimate),
          shown_arrival(expected.steps),
          shown_arrival(seconds.estimate),
          shown_arrivals(steps.interval)};
}

void add_to_row(Row& row, const statistics::SeriesStudy& study, const std::vector<SceneAxis>& axes,
                const records::Specification& spec) {
  row.recommended.interval = shown(study.recommended_median.interval);
  for (std::size_t k = 0; k < row.finals.size(); ++k) row.finals[k] = shown(study.finals[k]);
  row.commanded.interval = shown(study.commanded_median.interval);
  row.residual = residual_axes(study.residual, axes);
  for (const statistics::ExcessAfter& from : study.excess) {
    ExcessAfter& after = row.excess.emplace_back();
    after.images = from.images;
    for (const statistics::Rule rule : statistics::kRules) {
      after.rules[rule] = score_of(from.rules[rule].values);
      after.rules[rule].interval = shown(from.rules[rule].interval);
    }
  }
  row.costs = study.costs;
  for (const statistics::Band& band : study.further) row.further.push_back(shown(band));
  if (study.mtf_centre.n > 0) row.mtf = {score_of(study.mtf_centre), score_of(study.mtf_corner)};
  if (!spec.limits_anything() || study.yield.n == 0) return;
  row.yield = {share_of(study.in_spec, study.yield), std::nullopt};
  if (study.yield_uncured.n > 0) row.yield->uncured = share_of(study.in_spec_uncured, study.yield_uncured);
  // Without criteria of every step: MTF is not known per step.
  if (spec.limits_criteria() ? study.to_specification.empty() : std::isnan(spec.score)) return;
  row.to_spec = time_of(study.expected_to_spec, study.steps_to_spec, study.seconds_to_spec);
  row.to_spec->cycle = shown_arrival(study.cycle_to_spec.estimate);
  for (const statistics::ArrivalStudy& arrival : study.to_specification)
    row.to_specification.push_back({arrival.name, share_of(arrival.in_spec, arrival.share),
                                    time_of(arrival.expected, arrival.steps, arrival.seconds),
                                    shown_arrivals(arrival.seconds.interval)});
}

CurveTrack track_of(const statistics::Curve& curve, std::size_t track) {
  CurveTrack made;
  bool any = false, any_interval = false;
  for (const statistics::CurvePoint& point : curve.points) {
    const Score score = score_of(point.tracks[track]);
    const statistics::Interval interval = shown(point.bands[track]);
    any = any || score.n > 0;
    any_interval = any_interval || point.bands[track].exists();
    made.median.push_back(score.median);
    made.q25.push_back(score.q25);
    made.q75.push_back(score.q75);
    made.low.push_back(interval.low);
    made.high.push_back(interval.high);
  }
  if (!any) return {};
  if (!any_interval) made.low = made.high = {};
  return made;
}

Curve curve_of(const statistics::Curve& from, double algorithm_ms_per_step) {
  Curve curve;
  curve.method = from.algorithm;
  curve.trials = from.trials;
  curve.first_step = from.points.empty() ? 0 : from.points.front().step;
  for (std::size_t track = 0; track < curve.tracks.size(); ++track) curve.tracks[track] = track_of(from, track);
  for (const statistics::CurvePoint& point : from.points) {
    curve.machine_seconds.push_back(shown(point.machine_seconds));
    if (std::isfinite(algorithm_ms_per_step))
      curve.algorithm_seconds.push_back(shown(0.001 * algorithm_ms_per_step * point.step));
  }
  return curve;
}

Ecdf ecdf_of(const statistics::SeriesStudy& study) {
  Ecdf ecdf = {study.curve.algorithm, {}};
  double before = -1;
  for (std::size_t step = 0; step < study.targets_reached.size(); ++step) {
    const bool last = step + 1 == study.targets_reached.size();
    if (study.targets_reached[step] == before && !last) continue;
    before = study.targets_reached[step];
    ecdf.points.emplace_back(step, shown(before));
  }
  return ecdf;
}

records::Specification shown_spec(records::Specification spec) {
  for (double& limit : spec.limits.values) limit = shown(limit);
  for (double* limit : {&spec.score, &spec.lp_per_mm, &spec.mtf_centre, &spec.mtf_corner}) *limit = shown(*limit);
  return spec;
}

}  // namespace

Score score_of(const statistics::Quantiles& values) {
  if (values.n == 0) return {};
  return {values.n, shown(values.median), shown(values.q25), shown(values.q75), {}};
}

Share share_of(std::size_t in, const statistics::Band& share) {
  return {in, share.n, shown(share.estimate), shown(share.interval)};
}

const statistics::SeriesStudy* find_series(const statistics::Study& study, const statistics::GroupStudy& group,
                                           const std::string& method) {
  for (const std::size_t series : group.series)
    if (study.series[series].curve.algorithm == method) return &study.series[series];
  return nullptr;
}

void add_statistics(Group& group, const statistics::GroupStudy& found, const statistics::Study& study,
                    const std::vector<SceneAxis>& axes, double next_image, double smallest_relevant_ratio) {
  for (Row& row : group.rows)
    if (const statistics::SeriesStudy* series = find_series(study, found, row.method))
      add_to_row(row, *series, axes, found.spec);
  for (const std::size_t index : found.series) {
    const statistics::SeriesStudy& series = study.series[index];
    if (series.curve.trials == 0) continue;
    const auto row = std::find_if(group.rows.begin(), group.rows.end(),
                                  [&](const Row& one) { return one.method == series.curve.algorithm; });
    group.curves.push_back(curve_of(series.curve, row == group.rows.end() ? kMissing : row->algorithm_ms_per_step));
    if (!group.measured_only) group.ecdf.push_back(ecdf_of(series));
  }
  if (found.own_optimum.n > 0) {
    const double best = found.own_optimum.median;
    group.own_optimum = shown(best);
    if (group.scored_by.squared) group.next_image = shown(std::sqrt(best * best + next_image));
  }
  for (const statistics::Quantiles& values : found.further_at_optimum)
    group.further_at_optimum.push_back(shown(statistics::Band{values.n, values.median, {}}));
  group.spec = shown_spec(found.spec);
  group.prices = study.prices;
  if (found.spec.limits_anything()) {
    group.cannot_meet_spec = found.cannot_meet_spec;
    group.infeasible = found.infeasible;
  }
  for (const statistics::PairStudy& pair : found.pairs)
    group.pairs.push_back(pair_of(pair, study, smallest_relevant_ratio));
  if (found.friedman.mean_ranks.size() > 2) group.friedman = {shown(found.friedman.f_p), found.friedman.instances};
}

Difference difference_of(const statistics::PairedComparison& from, double smallest_relevant_ratio) {
  const statistics::Interval& interval = from.difference.interval;
  Difference made;
  made.n = from.difference.n;
  made.ratio = shown(std::exp(from.difference.estimate));
  made.interval = shown(statistics::Interval{std::exp(interval.low), std::exp(interval.high)});
  made.improvement = shown(from.probability_of_improvement.estimate);
  made.p = shown(from.test.p);
  made.verdict = from.verdict;
  made.reason = undecided_reason(made, smallest_relevant_ratio);
  return made;
}

Pair pair_of(const statistics::PairStudy& from, const statistics::Study& study, double smallest_relevant_ratio) {
  Pair pair;
  static_cast<Difference&>(pair) = difference_of(from.comparison, smallest_relevant_ratio);
  pair.a = study.series[from.first].curve.algorithm;
  pair.b = study.series[from.second].curve.algorithm;
  pair.p_holm = shown(from.corrected_p);
  pair.planned = from.planned;
  if (!from.planned) return pair;
  pair.p_planned = shown(from.planned_p);
  const statistics::PairedShares& yields = from.yields;
  if (yields.n > 0)
    pair.yields = {yields.n,
                   yields.first,
                   yields.second,
                   yields.first_alone,
                   yields.second_alone,
                   shown(yields.p),
                   shown(from.planned_yield_p)};
  return pair;
}

statistics::StudyOptions study_options(const LoadedResults& results, std::optional<statistics::Rule> rule) {
  const records::Manifest& manifest = results.manifest;
  const AnalysisPlan plan = manifest.analysis.value_or(AnalysisPlan());
  statistics::StudyOptions options;
  options.rule = rule ? *rule : statistics::rule_named(plan.rule).value_or(statistics::Rule::own);
  const Methods methods(results);
  for (const Method& method : methods.list())
    options.classes[{method.name, method.protocol}] = class_name(method.of_class);
  if (manifest.analysis) options.smallest_relevant_ratio = plan.smallest_relevant_ratio;
  for (const auto& [a, b] : plan.contrasts) options.contrasts.emplace_back(a, b);
  options.seed = manifest.seed;
  options.targets = manifest.targets;
  options.cycle = statistics::cycle_of(manifest.cycle);
  options.prices = manifest.cost.value_or(Prices());
  options.spec = records::specification_of(manifest.spec, Json(), SceneScore());
  for (const records::ManifestScene& scene : manifest.scenes)
    options.spec_of_scene[scene.name] =
        records::specification_of(manifest.spec, manifest.spec.empty() ? scene.spec : Json(), scene.score);
  return options;
}

}  // namespace relign::report
