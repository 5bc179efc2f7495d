#include "report/page_json.h"

#include "report/json_put.h"

namespace relign::report {
namespace {

void put_band(Json& json, const std::string& name, const statistics::Band& band) {
  json[name] = number(band.estimate);
  json[name + "_lo95"] = number(band.interval.low);
  json[name + "_hi95"] = number(band.interval.high);
}

void put_bands(Json& json, const statistics::AggregateBands& bands) {
  put(json, "n", bands.iqm.n);
  put_band(json, "iqm", bands.iqm);
  put_band(json, "median", bands.median);
  put_band(json, "gap", bands.gap);
  put_band(json, "area", bands.area);
}

}  // namespace

// put() finds these functions by their second argument.

template <class Value>
static void write(Json& json, const statistics::ByRule<Value>& values) {
  for (const statistics::Rule rule : statistics::kRules) put(json, statistics::rule_name(rule), values[rule]);
}

static void write(Json& json, const Method& method) {
  put(json, "name", method.name, "label", method.label, "id", method.id, "protocol", method.protocol, "merit",
      method.merit, "key", method.key, "class", class_name(method.of_class), "oracle",
      method.of_class == ObservationClass::oracle, "observes", method.observes, "steps", method.steps, "parameters",
      method.parameters);
  put_filled(json, "training_tag", method.training_tag);
  if (method.in_manifest)
    put(json, "kind", method.kind, "summary", method.summary, "reproducible", method.reproducible, "plugin_hash",
        method.plugin_hash);
}

static void write(Json& json, const Score& score) {
  put(json, "n", score.n);
  if (score.n > 0) put(json, "median", score.median, "q25", score.q25, "q75", score.q75);
}

static void write(Json& json, const Share& share) {
  put(json, "in", share.in, "n", share.n, "share", share.share);
  put_interval(json, share.interval);
}

static void write(Json& json, const Yield& yield) {
  write(json, static_cast<const Share&>(yield));
  put(json, "uncured", yield.uncured);
}

static void write(Json& json, const TimeToSpec& time) {
  put(json, "successes", time.successes, "n", time.n, "steps", arrival(time.steps), "lo95", arrival(time.interval.low),
      "hi95", arrival(time.interval.high), "expected", arrival(time.expected), "seconds", arrival(time.seconds));
  if (!std::isnan(time.cycle)) put(json, "cycle", arrival(time.cycle));
}

static void write(Json& json, const CriterionScore& score) {
  put(json, "criterion", score.name, "share", score.share, "time", score.time, "seconds_lo95",
      arrival(score.seconds.low), "seconds_hi95", arrival(score.seconds.high));
}

static void write(Json& json, const MtfScores& mtf) { put(json, "centre", mtf.centre, "corner", mtf.corner); }

static void write(Json& json, const ResidualAxis& axis) {
  put(json, "name", axis.name, "unit", axis.unit, "median", axis.median, "q75", axis.q75);
}

static void write(Json& json, const RuleScore& score) {
  put(json, "n", score.median.n);
  if (score.median.n == 0) return;
  put(json, "median", score.median.estimate, "yield", score.yield);
  put_interval(json, score.median.interval);
  if (!std::isnan(score.steps)) put(json, "steps", arrival(score.steps));
}

static void write(Json& json, const ExcessAfter& after) {
  put(json, "images", after.images);
  for (const statistics::Rule rule : statistics::kRules) {
    Json& of_rule = json[statistics::rule_name(rule)];
    put_value(of_rule, after.rules[rule]);
    if (after.rules[rule].n > 0) put_interval(of_rule, after.rules[rule].interval);
  }
}

static Json arrivals(const statistics::Band& band) {
  return {{"n", band.n},
          {"estimate", arrival(shown_arrival(band.estimate))},
          {"lo95", arrival(shown_arrival(band.interval.low))},
          {"hi95", arrival(shown_arrival(band.interval.high))}};
}

static Json costs_json(const std::vector<statistics::CostStudy>& costs) {
  Json list = Json::array();
  for (const statistics::CostStudy& cost : costs) {
    Json one = {{"steps", cost.steps},
                {"met", arrivals(cost.met)},
                {"seconds", arrivals(cost.seconds)},
                {"good_per_hour", arrivals(cost.good_per_hour)},
                {"scrapped", arrivals(cost.scrapped)},
                {"per_good_module", arrivals(cost.per_good_module)}};
    if (cost.saves.n > 0) one["saves"] = arrivals(cost.saves);
    list.push_back(std::move(one));
  }
  return list;
}

static void put_medians(Json& json, const char* key, const std::vector<statistics::Band>& medians) {
  for (const statistics::Band& median : medians) {
    Json& one = json[key].emplace_back();
    put(one, "n", median.n);
    if (median.n == 0) continue;
    put(one, "median", median.estimate);
    put_interval(one, median.interval);
  }
}

static void write(Json& json, const Row& row) {
  put(json, "method", row.method, "oracle", row.oracle(), "class", class_name(row.of_class), "merit", row.merit, "key",
      row.key, "observes", row.observes, "trials", row.trials, "failed", row.failed, "step", row.step, "recommended",
      row.recommended, "commanded", row.commanded, "measured", row.measured, "machine_seconds", row.machine_seconds,
      "algorithm_ms_per_step", row.algorithm_ms_per_step, "yield", row.yield, "to_spec", row.to_spec, "mtf", row.mtf,
      "rules", row.rules);
  put_interval(json["recommended"], row.recommended.interval);
  for (std::size_t k = 0; k < row.finals.size(); ++k)
    put_band(json["recommended"], statistics::kFinalStatistics[k].key, row.finals[k]);
  put_interval(json["commanded"], row.commanded.interval);
  put_filled(json, "training_tag", row.training_tag);
  put_filled(json, "excess", row.excess);
  put_filled(json, "to_specification", row.to_specification);
  put_medians(json, "further_scores", row.further);
  if (!row.costs.empty()) json["costs"] = costs_json(row.costs);
  if (!row.residual.empty()) put(json["residual"], "axes", row.residual);
}

static void write(Json& json, const CurveTrack& track) {
  put(json, "median", track.median, "q25", track.q25, "q75", track.q75);
  put_filled(json, "lo95", track.low);
  put_filled(json, "hi95", track.high);
}

static void write(Json& json, const Curve& curve) {
  put(json, "method", curve.method, "trials", curve.trials, "first_step", curve.first_step, "tracks", Json::object(),
      "machine_seconds", curve.machine_seconds);
  for (const statistics::Track track : statistics::kTracks)
    if (!curve.track(track).median.empty()) put(json["tracks"], statistics::track_name(track), curve.track(track));
  put_filled(json, "algorithm_seconds", curve.algorithm_seconds);
}

static void write(Json& json, const Ecdf& ecdf) {
  put(json, "method", ecdf.method, "steps", Json::array(), "share", Json::array());
  for (const auto& [step, share] : ecdf.points) {
    json["steps"].push_back(step);
    json["share"].push_back(number(share));
  }
}

static void write(Json& json, const PairYields& yields) {
  put(json, "n", yields.n, "a", yields.a, "b", yields.b, "a_alone", yields.a_alone, "b_alone", yields.b_alone, "p",
      yields.p, "p_planned", yields.p_planned);
}

static void write(Json& json, const Pair& pair) {
  put(json, "a", pair.a, "b", pair.b, "n", pair.n, "ratio", pair.ratio, "improvement", pair.improvement, "p", pair.p,
      "p_holm", pair.p_holm, "verdict", statistics::verdict_name(pair.verdict));
  put_interval(json, pair.interval);
  put_filled(json, "reason", pair.reason);
  if (pair.planned) put(json, "planned", true, "p_planned", pair.p_planned, "yields", pair.yields);
}

static void write(Json& json, const Lead& lead) {
  put(json, "class", class_name(lead.of_class), "best", lead.best);
  put_filled(json, "next", lead.next);
  if (!lead.pair) return;
  put(json, "n", lead.pair->n, "ratio", lead.pair->ratio, "verdict", statistics::verdict_name(lead.pair->verdict));
  put_interval(json, lead.pair->interval);
}

static void write(Json& json, const RuleComparison& rule) { put(json, "pairs", rule.pairs, "leads", rule.leads); }

static void write(Json& json, const Group::Friedman& friedman) {
  put(json, "p", friedman.p, "instances", friedman.instances);
}

static void put_spec(Json& json, const Group& group) {
  const auto put_limit = [](Json& of, std::string_view name, double limit) {
    if (std::isfinite(limit)) of[name] = limit;
  };
  const records::Specification& spec = group.spec;
  put_limit(json, group.scored_by.squared ? "spec_rmse" : "spec_score", spec.score);
  if (!group.scored_by.squared) json["score"] = json_of(group.scored_by);
  if (spec.measures_mtf()) {
    Json& mtf = json["spec_mtf"];
    put(mtf, "lp_per_mm", spec.lp_per_mm);
    put_limit(mtf, "centre", spec.mtf_centre);
    put_limit(mtf, "corner", spec.mtf_corner);
    if (spec.diffraction) mtf["diffraction"] = true;
  }
  for (const Criterion one : kCriteria)
    if (!std::isnan(spec.limits[one])) put_limit(json["spec_criteria"], entry_of(one).column, spec.limits[one]);
  if (spec.limits_anything()) put(json, "cannot_meet_spec", group.cannot_meet_spec, "infeasible", group.infeasible);
}

static void write(Json& json, const Group& group) {
  put(json, "scene", group.scene, "noise_level", group.noise_level, "protocol", group.protocol, "label", group.label,
      "instances", group.instances, "same_instances", group.same_instances, "start", group.start, "rows", group.rows,
      "curves", group.curves, "friedman", group.friedman, "rules", group.rules);
  if (std::isfinite(group.start_excess)) json["start_excess"] = group.start_excess;
  if (group.station) json["station"] = true;
  if (group.measured_only) json["measured_only"] = true;
  put_filled(json, "ecdf", group.ecdf);
  put_medians(json, "further_scores_at_optimum", group.further_at_optimum);
  put_filled(json, "pairs", group.pairs);
  if (std::isfinite(group.own_optimum)) json["floor"]["own_optimum"] = group.own_optimum;
  if (std::isfinite(group.next_image)) json["floor"]["next_image"] = group.next_image;
  put_spec(json, group);
  if (group.prices.stated()) json["prices"] = json_of(group.prices);
}

static void write(Json& json, const RunState::Harness& harness) {
  put(json, "microseconds_per_step", harness.microseconds_per_step, "share_of_scene_time", harness.share_of_scene_time);
}

static void write(Json& json, const RunState& ran) {
  put(json, "planned", ran.planned, "finished", ran.finished, "failed", ran.failed, "missing", ran.missing,
      "incomplete", ran.incomplete, "from_other_plans", ran.from_other_plans, "harness", ran.harness);
}

static void write(Json& json, const FailedTrial& trial) {
  put(json, "trial", trial.trial, "scene", trial.scene, "noise_level", trial.noise_level, "protocol", trial.protocol,
      "instance", trial.instance, "steps", trial.steps);
  put_filled(json, "log", trial.log);
}

static void write(Json& json, const Failure& failure) {
  put(json, "method", failure.method, "message", failure.message, "count", failure.count, "trials", failure.trials);
}

static void write(Json& json, const PluginWarning& warning) {
  put(json, "method", warning.method, "message", warning.message, "count", warning.count);
}

static void write(Json& json, const QualityGate& gate) {
  put(json, "name", gate.name, "ok", gate.ok, "text", gate.text);
}

static void write(Json& json, const ClassVerdict& verdict) {
  put(json, "class", class_name(verdict.of_class), "title", verdict.title, "best", verdict.best, "text", verdict.text);
}

static void write(Json& json, const GroupVerdict& verdict) {
  put(json, "label", verdict.label, "best", verdict.best, "text", verdict.text);
  put_filled(json, "classes", verdict.classes);
  put_filled(json, "rest", verdict.rest);
}

static void write(Json& json, const BreakEven& even) {
  put(json, "group", even.group, "label", even.label, "lenses", arrival(even.lenses), "against", even.against, "saves",
      even.saves);
  if (!std::isnan(even.modules)) json["modules"] = arrival(even.modules);
}

static void write(Json& json, const TrainingCost& cost) {
  put(json, "method", cost.method, "hours", cost.hours, "steps",
      std::isfinite(cost.steps) ? Json(std::llround(cost.steps)) : Json(), "machine", cost.machine, "pays_after",
      cost.pays_after);
}

static void write(Json& json, const SceneAxis& axis) {
  put(json, "name", axis.name, "unit", axis.unit, "lower", axis.lower, "upper", axis.upper);
  if (axis.speed_per_s > 0) json["speed_per_s"] = axis.speed_per_s;
}

static void write(Json& json, const LandscapeLine& line) {
  put(json, "axis", line.axis, "unit", line.unit, "away", line.away, "rmse", line.score);
}

static void write(Json& json, const LandscapePlane::Axis& axis) {
  put(json, "name", axis.name, "unit", axis.unit, "values", axis.values);
}

static void write(Json& json, const LandscapePlane& plane) {
  put(json, "across", plane.across, "up", plane.up, "rmse", plane.score);
}

static void write(Json& json, const SceneFacts& facts) {
  put(json, "scene", facts.scene, "id", facts.id, "summary", facts.summary, "width", facts.width, "height",
      facts.height, "axes", facts.axes);
  for (std::size_t k = 0; k < facts.clock.size(); ++k)
    if (std::isfinite(facts.clock[k])) json["machine_time"][kClockParameters[k].name] = facts.clock[k];
  if (!facts.landscape.empty()) put(json["landscape"], "lines", facts.landscape, "plane", facts.plane);
}

static void write(Json& json, const AggregateTraining& training) {
  put(json, "training", training.name, "failed", training.failed);
  put_bands(json, training.bands);
}

static void write(Json& json, const AggregateMethod::Spread& spread) {
  put(json, "lowest", spread.lowest, "highest", spread.highest, "sd", spread.sd);
}

static void write(Json& json, const AggregateMethod& method) {
  put(json, "method", method.method, "class", class_name(method.of_class), "oracle", method.oracle(), "strata",
      method.strata, "failed", method.failed, "steps", method.steps);
  put_filled(json, "training_tag", method.training_tag);
  if (!method.has_numbers()) return;
  put_bands(json, method.bands);
  std::vector<double> share, low, high;
  for (const statistics::Band& band : method.bands.profile) {
    share.push_back(band.estimate);
    low.push_back(band.interval.low);
    high.push_back(band.interval.high);
  }
  put(json["profile"], "share", share, "lo95", low, "hi95", high);
  put(json, "by_step", method.by_step, "spread", method.spread);
  put_filled(json, "trainings", method.trainings);
}

static void write(Json& json, const Stratum& stratum) {
  put(json, "scene", stratum.scene, "noise_level", stratum.noise_level, "instances", stratum.instances);
}

static void write(Json& json, const AggregatePair& pair) {
  put(json, "a", pair.a, "b", pair.b, "n", pair.improvement.n, "improvement", pair.improvement.estimate);
  put_interval(json, pair.improvement.interval);
}

static void write(Json& json, const Aggregate& aggregate) {
  put(json, "protocol", aggregate.protocol, "resolution", aggregate.resolution, "strata", aggregate.strata, "methods",
      aggregate.methods, "pairs", aggregate.pairs, "profile_places", shown(statistics::profile_places()));
}

static void write(Json& json, const Source& source) {
  put(json, "folder", source.folder, "trials", source.trials, "cpu", source.cpu, "program", source.program);
}

static void put_provenance(Json& json, const Provenance& from) {
  put(json, "suite_name", from.suite_name, "suite_file", from.suite_file, "suite_text", from.suite_text, "seed",
      from.seed, "instance_set", from.instance_set, "command", from.command, "program", json_of(from.program),
      "machine", json_of(from.machine));
  if (!from.sources.empty()) put(json, "sources", from.sources);
  if (from.merge) put(json, "merge", json_of(*from.merge));
}

Json to_json(const PageModel& page) {
  Json json;
  put(json, "format", 1, "scenes", page.scenes, "noise_levels", page.noise_levels, "protocols", page.protocols, "steps",
      page.steps ? Json{page.steps->least, page.steps->most} : Json::array(), "instances", page.instances, "ran",
      page.ran, "methods", page.methods, "groups", page.groups, "failures", page.failures, "warnings", page.warnings,
      "rule", statistics::rule_name(page.rule), "targets", page.targets, "resamples", page.resamples,
      "smallest_relevant_ratio", page.smallest_relevant_ratio, "gates", page.gates, "scene_facts", page.scene_facts,
      "verdict", page.verdict, "caveats", page.caveats);
  put_provenance(json, page.provenance);
  put_filled(json, "spec", page.spec);
  put_filled(json, "spec_text", page.spec_text);
  put_filled(json, "aggregate", page.aggregates);
  put_filled(json, "training", page.training);
  put_filled(json, "rules_note", page.rules_note);
  put_filled(json, "analysis", page.analysis.plan);
  if (!page.analysis.plan.empty() || !page.analysis.notes.empty()) put(json, "analysis_notes", page.analysis.notes);
  return json;
}

}  // namespace relign::report
