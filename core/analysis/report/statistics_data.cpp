#include "report/statistics_data.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/json_members.h"
#include "report/gates.h"
#include "report/page_data.h"
#include "report/page_groups.h"
#include "report/scene_axes.h"
#include "report/scene_bounds.h"
#include "report/spec_words.h"
#include "report/verdict_cases.h"

namespace relign::report {
namespace {

// "never" if fewer than half of the instances reach it, null if unknown.
Json arrival(double value) { return std::isinf(value) ? Json("never") : shown_number(value); }

void put_interval(Json& object, const statistics::Interval& interval, const char* low = "lo95",
                  const char* high = "hi95") {
  object[low] = shown_number(interval.low);
  object[high] = shown_number(interval.high);
}

// In the units of `axes`; poses are shares of the travel.
Json residual_json(const std::vector<statistics::Quantiles>& residual, const std::vector<SceneAxis>& axes) {
  if (residual.empty() || axes.size() != residual.size()) return nullptr;
  Json list = Json::array();
  for (std::size_t axis = 0; axis < residual.size(); ++axis) {
    const double travel = axes[axis].upper - axes[axis].lower;
    if (!(travel > 0)) return nullptr;
    list.push_back({{"name", axes[axis].name},
                    {"unit", axes[axis].unit},
                    {"median", shown_number(travel * residual[axis].median)},
                    {"q75", shown_number(travel * residual[axis].q75)}});
  }
  return {{"axes", std::move(list)}};
}

Json quartiles_json(const statistics::Quantiles& values) {
  return {{"n", values.n},
          {"median", shown_number(values.median)},
          {"q25", shown_number(values.q25)},
          {"q75", shown_number(values.q75)}};
}

void add_to_row(Json& row, const statistics::SeriesStudy& study, const std::vector<SceneAxis>& axes,
                const records::Specification& spec) {
  put_interval(row["recommended"], study.recommended_median.interval);
  row["recommended"]["iqm"] = shown_number(study.recommended_iqm.estimate);
  put_interval(row["recommended"], study.recommended_iqm.interval, "iqm_lo95", "iqm_hi95");
  put_interval(row["commanded"], study.commanded_median.interval);
  if (Json residual = residual_json(study.residual, axes); !residual.is_null()) row["residual"] = std::move(residual);
  if (study.mtf_centre.n > 0)
    row["mtf"] = {{"centre", quartiles_json(study.mtf_centre)}, {"corner", quartiles_json(study.mtf_corner)}};
  if (!spec.limits_anything() || study.yield.n == 0) return;
  row["yield"] = {{"in", study.in_spec}, {"n", study.yield.n}, {"share", shown_number(study.yield.estimate)}};
  put_interval(row["yield"], study.yield.interval);
  if (study.yield_uncured.n > 0) {
    row["yield"]["uncured"] = {{"in", study.in_spec_uncured},
                               {"n", study.yield_uncured.n},
                               {"share", shown_number(study.yield_uncured.estimate)}};
    put_interval(row["yield"]["uncured"], study.yield_uncured.interval);
  }
  if (std::isnan(spec.rmse)) return;  // MTF is not known per step
  const statistics::ExpectedSteps& expected = study.expected_to_spec;
  row["to_spec"] = {{"successes", expected.successes},
                    {"n", expected.trials},
                    {"steps", arrival(study.steps_to_spec.estimate)},
                    {"lo95", arrival(study.steps_to_spec.interval.low)},
                    {"hi95", arrival(study.steps_to_spec.interval.high)},
                    {"expected", arrival(expected.steps)},
                    {"seconds", arrival(study.seconds_to_spec.estimate)}};
}

void add_to_curve(Json& curve, const statistics::SeriesStudy& study, double algorithm_ms_per_step) {
  for (std::size_t track = 0; track < statistics::kTracks.size(); ++track) {
    const auto found = curve["tracks"].find(statistics::track_name(statistics::kTracks[track]));
    if (found == curve["tracks"].end()) continue;
    Json low = Json::array(), high = Json::array();
    bool any = false;
    for (const statistics::CurvePoint& point : study.curve.points) {
      any = any || point.bands[track].exists();
      low.push_back(shown_number(point.bands[track].low));
      high.push_back(shown_number(point.bands[track].high));
    }
    if (!any) continue;
    (*found)["lo95"] = std::move(low);
    (*found)["hi95"] = std::move(high);
  }
  Json machine = Json::array(), algorithm = Json::array();
  for (const statistics::CurvePoint& point : study.curve.points) {
    machine.push_back(shown_number(point.machine_seconds));
    algorithm.push_back(shown_number(0.001 * algorithm_ms_per_step * point.step));
  }
  curve["machine_seconds"] = std::move(machine);
  if (std::isfinite(algorithm_ms_per_step)) curve["algorithm_seconds"] = std::move(algorithm);
}

// Only the steps at which the share changes.
Json ecdf_json(const statistics::SeriesStudy& study) {
  Json steps = Json::array(), share = Json::array();
  double before = -1;
  for (std::size_t step = 0; step < study.targets_reached.size(); ++step) {
    const bool last = step + 1 == study.targets_reached.size();
    if (study.targets_reached[step] == before && !last) continue;
    before = study.targets_reached[step];
    steps.push_back(step);
    share.push_back(shown_number(before));
  }
  return {{"method", study.curve.algorithm}, {"steps", std::move(steps)}, {"share", std::move(share)}};
}

const statistics::GroupStudy* find_group(const statistics::Study& study, const Json& group) {
  for (const statistics::GroupStudy& candidate : study.groups)
    if (candidate.scene == text_of(group, "scene") && candidate.noise_level == text_of(group, "noise_level") &&
        candidate.protocol == text_of(group, "protocol"))
      return &candidate;
  return nullptr;
}

const statistics::SeriesStudy* find_series(const statistics::Study& study, const statistics::GroupStudy& group,
                                           const std::string& method) {
  for (const std::size_t series : group.series)
    if (study.series[series].curve.algorithm == method) return &study.series[series];
  return nullptr;
}

void add_to_group(Json& group, const statistics::GroupStudy& found, const statistics::Study& study,
                  const std::vector<SceneAxis>& axes, double next_image, double relevant) {
  std::map<std::string, double> algorithm_ms;
  for (Json& row : group["rows"]) {
    const std::string method = text_of(row, "method");
    if (const statistics::SeriesStudy* series = find_series(study, found, method))
      add_to_row(row, *series, axes, found.spec);
    algorithm_ms[method] =
        row["algorithm_ms_per_step"].is_number() ? row["algorithm_ms_per_step"].get<double>() : statistics::kMissing;
  }
  Json ecdf = Json::array();
  for (Json& curve : group["curves"]) {
    const std::string method = text_of(curve, "method");
    const statistics::SeriesStudy* series = find_series(study, found, method);
    if (!series) continue;
    add_to_curve(curve, *series, algorithm_ms[method]);
    if (!flag_of(group, "measured_only")) ecdf.push_back(ecdf_json(*series));
  }
  if (!ecdf.empty()) group["ecdf"] = std::move(ecdf);
  if (found.own_optimum.n > 0) {
    const double best = found.own_optimum.median;
    group["floor"] = {{"own_optimum", shown_number(best)}};
    if (!std::isnan(next_image)) group["floor"]["next_image"] = shown_number(std::sqrt(best * best + next_image));
  }
  const records::Specification& spec = found.spec;
  if (std::isfinite(spec.rmse)) group["spec_rmse"] = shown_number(spec.rmse);
  if (spec.measures_mtf()) {
    Json mtf = {{"lp_per_mm", shown_number(spec.lp_per_mm)}};
    if (std::isfinite(spec.mtf_centre)) mtf["centre"] = shown_number(spec.mtf_centre);
    if (std::isfinite(spec.mtf_corner)) mtf["corner"] = shown_number(spec.mtf_corner);
    if (spec.diffraction) mtf["diffraction"] = true;
    group["spec_mtf"] = std::move(mtf);
  }
  if (spec.limits_anything()) {
    group["cannot_meet_spec"] = found.cannot_meet_spec;
    group["infeasible"] = found.infeasible;
  }
  Json pairs = Json::array();
  for (const statistics::PairStudy& pair : found.pairs) pairs.push_back(pair_json(pair, study, relevant));
  if (!pairs.empty()) group["pairs"] = std::move(pairs);
  if (found.friedman.mean_ranks.size() > 2)
    group["friedman"] = {{"p", shown_number(found.friedman.f_p)}, {"instances", found.friedman.instances}};
}

}  // namespace

Json pair_json(const statistics::PairStudy& pair, const statistics::Study& study, double smallest_relevant_ratio) {
  const statistics::PairedComparison& comparison = pair.comparison;
  const statistics::Interval& interval = comparison.difference.interval;
  Json json = {{"a", study.series[pair.first].curve.algorithm},
               {"b", study.series[pair.second].curve.algorithm},
               {"n", comparison.difference.n},
               {"ratio", shown_number(std::exp(comparison.difference.estimate))},
               {"lo95", shown_number(std::exp(interval.low))},
               {"hi95", shown_number(std::exp(interval.high))},
               {"improvement", shown_number(comparison.probability_of_improvement.estimate)},
               {"p", shown_number(comparison.test.p)},
               {"p_holm", shown_number(pair.corrected_p)},
               {"verdict", statistics::verdict_name(comparison.verdict)}};
  if (std::string reason = undecided_reason(json, smallest_relevant_ratio); !reason.empty())
    json["reason"] = std::move(reason);
  if (!pair.planned) return json;
  json["planned"] = true;
  json["p_planned"] = shown_number(pair.planned_p);
  if (pair.yields.n > 0)
    json["yields"] = {{"n", pair.yields.n},
                      {"a", pair.yields.first},
                      {"b", pair.yields.second},
                      {"a_alone", pair.yields.first_alone},
                      {"b_alone", pair.yields.second_alone},
                      {"p", shown_number(pair.yields.p)},
                      {"p_planned", shown_number(pair.planned_yield_p)}};
  return json;
}

statistics::StudyOptions study_options(const LoadedResults& results, std::optional<statistics::Rule> rule) {
  statistics::StudyOptions options;
  const Json& plan = object_of(results.manifest, "analysis");
  options.rule = rule ? *rule : statistics::rule_named(text_of(plan, "rule")).value_or(statistics::Rule::own);
  if (options.rule != statistics::Rule::own && results.trials.without_rules > 0)
    throw Error(ErrorKind::bad_input, results.folder.string() + ": " + std::to_string(results.trials.without_rules) +
                                          " trials of an earlier version have no scores for the rule '" +
                                          statistics::rule_name(options.rule) +
                                          "'; replay them with 'relign-bench verify " + results.folder.string() +
                                          " --add-rules' to add the scores");
  const Methods methods(results);
  for (const Json& method : methods.list())
    options.classes[{text_of(method, "name"), text_of(method, "protocol")}] = text_of(method, "class");
  if (const Json& ratio = member(plan, "smallest_relevant_ratio"); ratio.is_number())
    options.smallest_relevant_ratio = std::max(1.0, ratio.get<double>());
  for (const Json& pair : list_of(plan, "contrasts"))
    if (pair.is_array() && pair.size() == 2 && pair[0].is_string() && pair[1].is_string())
      options.contrasts.emplace_back(pair[0].get<std::string>(), pair[1].get<std::string>());
  const std::string seed = text_of(results.manifest, "seed");
  if (!seed.empty() && seed.find_first_not_of("0123456789") == std::string::npos && seed.size() < 20)
    options.seed = std::stoull(seed);
  for (const Json& target : list_of(results.manifest, "targets"))
    if (target.is_number()) options.targets.push_back(target.get<double>());
  const Json& of_suite = object_of(results.manifest, "spec");
  options.spec = records::specification_of(of_suite, Json());
  if (of_suite.empty())
    for (const Json& scene : list_of(results.manifest, "scenes"))
      options.spec_of_scene[text_of(scene, "name")] = records::specification_of(of_suite, object_of(scene, "spec"));
  return options;
}

void add_statistics(Json& data, const LoadedResults& results, const statistics::Study& study) {
  const statistics::StudyOptions options = study_options(results, study.rule);
  data["rule"] = statistics::rule_name(study.rule);
  data["targets"] = options.targets.empty() ? statistics::default_targets() : options.targets;
  data["resamples"] = study.resamples;
  data["smallest_relevant_ratio"] = options.smallest_relevant_ratio;
  const std::map<std::string, std::vector<SceneAxis>> axes = scene_axes(results.folder, results.manifest);
  for (Json& group : data["groups"])
    if (const statistics::GroupStudy* found = find_group(study, group)) {
      const auto of_scene = axes.find(text_of(group, "scene"));
      add_to_group(group, *found, study, of_scene == axes.end() ? std::vector<SceneAxis>() : of_scene->second,
                   next_image_excess(results.folder, results.manifest, found->scene, found->noise_level),
                   options.smallest_relevant_ratio);
    }
  const Json& spec = object_of(results.manifest, "spec");
  if (!spec.empty()) data["spec"] = spec;
  if (std::string words = spec_sentence(data["groups"]); !words.empty()) data["spec_text"] = std::move(words);
  data["gates"] = gates_json(data, results);
}

}  // namespace relign::report
