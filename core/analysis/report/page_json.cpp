#include "report/page_json.h"

namespace relign::report {

// nlohmann finds the functions to_json(Json&, ...) by their second argument, also for elements of lists.
namespace {

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json arrival(double value) { return std::isinf(value) ? Json("never") : number(value); }

Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(number(value));
  return list;
}

void put_interval(Json& json, const statistics::Interval& interval, const std::string& prefix = "") {
  json[prefix + "lo95"] = number(interval.low);
  json[prefix + "hi95"] = number(interval.high);
}

void put_band(Json& json, const char* name, const statistics::Band& band) {
  json[name] = number(band.estimate);
  put_interval(json, band.interval, name + std::string("_"));
}

void put_bands(Json& json, const statistics::AggregateBands& bands) {
  json["n"] = bands.iqm.n;
  put_band(json, "iqm", bands.iqm);
  put_band(json, "median", bands.median);
  put_band(json, "gap", bands.gap);
  put_band(json, "area", bands.area);
}

// Members that are absent if they have no value.
template <class Value>
void put_if_any(Json& json, const char* name, const Value& value) {
  if (!value.empty()) json[name] = value;
}
template <class Value>
void put_if_any(Json& json, const char* name, const std::optional<Value>& value) {
  if (value) json[name] = *value;
}

template <class Value>
Json by_rule(const statistics::ByRule<Value>& values) {
  Json json;
  for (const statistics::Rule rule : statistics::kRules) json[statistics::rule_name(rule)] = values[rule];
  return json;
}

}  // namespace

static void to_json(Json& json, const Method& method) {
  json = {{"name", method.name},
          {"label", method.label},
          {"id", method.id},
          {"protocol", method.protocol},
          {"merit", method.merit},
          {"key", method.key},
          {"class", class_name(method.of_class)},
          {"oracle", method.of_class == ObservationClass::oracle},
          {"observes", method.observes},
          {"steps", method.steps},
          {"parameters", method.parameters}};
  put_if_any(json, "training_tag", method.training_tag);
  if (!method.in_manifest) return;
  json["kind"] = method.kind;
  json["summary"] = method.summary;
  json["reproducible"] = method.reproducible;
  json["plugin_hash"] = method.plugin_hash;
}

static void to_json(Json& json, const Score& score) {
  json = {{"n", score.n}};
  if (score.n == 0) return;
  json["median"] = number(score.median);
  json["q25"] = number(score.q25);
  json["q75"] = number(score.q75);
}

static void to_json(Json& json, const Share& share) {
  json = {{"in", share.in}, {"n", share.n}, {"share", number(share.share)}};
  put_interval(json, share.interval);
}

static void to_json(Json& json, const Yield& yield) {
  to_json(json, static_cast<const Share&>(yield));
  put_if_any(json, "uncured", yield.uncured);
}

static void to_json(Json& json, const TimeToSpec& time) {
  json = {{"successes", time.successes},         {"n", time.n},
          {"steps", arrival(time.steps)},        {"lo95", arrival(time.interval.low)},
          {"hi95", arrival(time.interval.high)}, {"expected", arrival(time.expected)},
          {"seconds", arrival(time.seconds)}};
}

static void to_json(Json& json, const MtfScores& mtf) { json = {{"centre", mtf.centre}, {"corner", mtf.corner}}; }

static void to_json(Json& json, const ResidualAxis& axis) {
  json = {{"name", axis.name}, {"unit", axis.unit}, {"median", number(axis.median)}, {"q75", number(axis.q75)}};
}

static void to_json(Json& json, const RuleScore& score) {
  json = {{"n", score.median.n}};
  if (score.median.n == 0) return;
  json["median"] = number(score.median.estimate);
  put_interval(json, score.median.interval);
  put_if_any(json, "yield", score.yield);
  if (!std::isnan(score.steps)) json["steps"] = arrival(score.steps);
}

static void to_json(Json& json, const Row& row) {
  json = {{"method", row.method},
          {"oracle", row.oracle()},
          {"class", class_name(row.of_class)},
          {"merit", row.merit},
          {"key", row.key},
          {"observes", row.observes},
          {"trials", row.trials},
          {"failed", row.failed},
          {"step", row.step},
          {"recommended", row.recommended},
          {"commanded", row.commanded},
          {"machine_seconds", number(row.machine_seconds)},
          {"algorithm_ms_per_step", number(row.algorithm_ms_per_step)}};
  put_interval(json["recommended"], row.recommended.interval);
  put_band(json["recommended"], "iqm", row.recommended_iqm);
  put_interval(json["commanded"], row.commanded.interval);
  put_if_any(json, "measured", row.measured);
  put_if_any(json, "training_tag", row.training_tag);
  put_if_any(json, "yield", row.yield);
  put_if_any(json, "to_spec", row.to_spec);
  put_if_any(json, "mtf", row.mtf);
  if (!row.residual.empty()) json["residual"]["axes"] = row.residual;
  if (row.rules) json["rules"] = by_rule(*row.rules);
}

static void to_json(Json& json, const CurveTrack& track) {
  json = {{"median", numbers(track.median)}, {"q25", numbers(track.q25)}, {"q75", numbers(track.q75)}};
  if (track.low.empty()) return;
  json["lo95"] = numbers(track.low);
  json["hi95"] = numbers(track.high);
}

static void to_json(Json& json, const Curve& curve) {
  json = {{"method", curve.method},
          {"trials", curve.trials},
          {"first_step", curve.first_step},
          {"tracks", Json::object()},
          {"machine_seconds", numbers(curve.machine_seconds)}};
  for (const statistics::Track track : statistics::kTracks)
    if (!curve.track(track).median.empty()) json["tracks"][statistics::track_name(track)] = curve.track(track);
  if (!curve.algorithm_seconds.empty()) json["algorithm_seconds"] = numbers(curve.algorithm_seconds);
}

static void to_json(Json& json, const Ecdf& ecdf) {
  json = {{"method", ecdf.method}, {"steps", Json::array()}, {"share", Json::array()}};
  for (const auto& [step, share] : ecdf.points) {
    json["steps"].push_back(step);
    json["share"].push_back(number(share));
  }
}

static void to_json(Json& json, const PairYields& yields) {
  json = {{"n", yields.n},
          {"a", yields.a},
          {"b", yields.b},
          {"a_alone", yields.a_alone},
          {"b_alone", yields.b_alone},
          {"p", number(yields.p)},
          {"p_planned", number(yields.p_planned)}};
}

static void to_json(Json& json, const Pair& pair) {
  json = {{"a", pair.a},
          {"b", pair.b},
          {"n", pair.n},
          {"ratio", number(pair.ratio)},
          {"improvement", number(pair.improvement)},
          {"p", number(pair.p)},
          {"p_holm", number(pair.p_holm)},
          {"verdict", statistics::verdict_name(pair.verdict)}};
  put_interval(json, pair.interval);
  put_if_any(json, "reason", pair.reason);
  if (!pair.planned) return;
  json["planned"] = true;
  json["p_planned"] = number(pair.p_planned);
  put_if_any(json, "yields", pair.yields);
}

static void to_json(Json& json, const Lead& lead) {
  json = {{"class", class_name(lead.of_class)}, {"best", lead.best}};
  put_if_any(json, "next", lead.next);
  if (!lead.pair) return;
  json["n"] = lead.pair->n;
  json["ratio"] = number(lead.pair->ratio);
  put_interval(json, lead.pair->interval);
  json["verdict"] = statistics::verdict_name(lead.pair->verdict);
}

static void to_json(Json& json, const RuleComparison& rule) { json = {{"pairs", rule.pairs}, {"leads", rule.leads}}; }

static void put_spec(Json& json, const Group& group) {
  const records::Specification& spec = group.spec;
  if (std::isfinite(spec.rmse)) json["spec_rmse"] = number(spec.rmse);
  if (spec.measures_mtf()) {
    Json& mtf = json["spec_mtf"] = {{"lp_per_mm", number(spec.lp_per_mm)}};
    if (std::isfinite(spec.mtf_centre)) mtf["centre"] = number(spec.mtf_centre);
    if (std::isfinite(spec.mtf_corner)) mtf["corner"] = number(spec.mtf_corner);
    if (spec.diffraction) mtf["diffraction"] = true;
  }
  if (!spec.limits_anything()) return;
  json["cannot_meet_spec"] = group.cannot_meet_spec;
  json["infeasible"] = group.infeasible;
}

static void to_json(Json& json, const Group& group) {
  json = {{"scene", group.scene},         {"noise_level", group.noise_level},
          {"protocol", group.protocol},   {"label", group.label},
          {"instances", group.instances}, {"same_instances", group.same_instances},
          {"start", number(group.start)}, {"rows", group.rows},
          {"curves", group.curves}};
  if (group.station) json["station"] = true;
  if (group.measured_only) json["measured_only"] = true;
  put_if_any(json, "ecdf", group.ecdf);
  put_if_any(json, "pairs", group.pairs);
  if (std::isfinite(group.own_optimum)) json["floor"]["own_optimum"] = number(group.own_optimum);
  if (std::isfinite(group.next_image)) json["floor"]["next_image"] = number(group.next_image);
  put_spec(json, group);
  if (group.friedman) json["friedman"] = {{"p", number(group.friedman->p)}, {"instances", group.friedman->instances}};
  if (group.rules) json["rules"] = by_rule(*group.rules);
}

static void to_json(Json& json, const RunState& ran) {
  json = {{"planned", ran.planned}, {"finished", ran.finished},     {"failed", ran.failed},
          {"missing", ran.missing}, {"incomplete", ran.incomplete}, {"from_other_plans", ran.from_other_plans}};
  if (ran.harness)
    json["harness"] = {{"microseconds_per_step", ran.harness->microseconds_per_step},
                       {"share_of_scene_time", number(ran.harness->share_of_scene_time)}};
}

static void to_json(Json& json, const FailedTrial& trial) {
  json = {{"trial", trial.trial},       {"scene", trial.scene},       {"noise_level", trial.noise_level},
          {"protocol", trial.protocol}, {"instance", trial.instance}, {"steps", trial.steps}};
  put_if_any(json, "log", trial.log);
}

static void to_json(Json& json, const Failure& failure) {
  json = {
      {"method", failure.method}, {"message", failure.message}, {"count", failure.count}, {"trials", failure.trials}};
}

static void to_json(Json& json, const PluginWarning& warning) {
  json = {{"method", warning.method}, {"message", warning.message}, {"count", warning.count}};
}

static void to_json(Json& json, const QualityGate& gate) {
  json = {{"name", gate.name}, {"ok", gate.ok}, {"text", gate.text}};
}

static void to_json(Json& json, const ClassVerdict& verdict) {
  json = {{"class", class_name(verdict.of_class)},
          {"title", class_title(verdict.of_class)},
          {"best", verdict.best},
          {"text", verdict.text}};
}

static void to_json(Json& json, const GroupVerdict& verdict) {
  json = {{"label", verdict.label}, {"best", verdict.best}, {"text", verdict.text}};
  put_if_any(json, "classes", verdict.classes);
  put_if_any(json, "rest", verdict.rest);
}

static void to_json(Json& json, const BreakEven& even) {
  json = {{"group", even.group},
          {"label", even.label},
          {"lenses", arrival(even.lenses)},
          {"against", even.against},
          {"saves", number(even.saves)}};
}

static void to_json(Json& json, const TrainingCost& cost) {
  json = {{"method", cost.method},
          {"hours", number(cost.hours)},
          {"steps", std::isfinite(cost.steps) ? Json(std::llround(cost.steps)) : Json()},
          {"machine", cost.machine},
          {"pays_after", cost.pays_after}};
}

static void to_json(Json& json, const SceneAxis& axis) {
  json = {{"name", axis.name}, {"unit", axis.unit}, {"lower", number(axis.lower)}, {"upper", number(axis.upper)}};
}

static void to_json(Json& json, const LandscapeLine& line) {
  json = {{"axis", line.axis}, {"unit", line.unit}, {"away", numbers(line.away)}, {"rmse", numbers(line.rmse)}};
}

static void to_json(Json& json, const LandscapePlane::Axis& axis) {
  json = {{"name", axis.name}, {"unit", axis.unit}, {"values", axis.values}};
}

static void to_json(Json& json, const LandscapePlane& plane) {
  json = {{"across", plane.across}, {"up", plane.up}, {"rmse", numbers(plane.rmse)}};
}

static void to_json(Json& json, const SceneFacts& facts) {
  json = {{"scene", facts.scene}, {"id", facts.id},         {"summary", facts.summary},
          {"width", facts.width}, {"height", facts.height}, {"axes", facts.axes}};
  for (std::size_t k = 0; k < facts.clock.size(); ++k)
    if (std::isfinite(facts.clock[k])) json["machine_time"][kClockParameters[k].name] = facts.clock[k];
  if (facts.landscape.empty()) return;
  json["landscape"]["lines"] = facts.landscape;
  put_if_any(json["landscape"], "plane", facts.plane);
}

static void to_json(Json& json, const AggregateTraining& training) {
  json = {{"training", training.name}, {"failed", training.failed}};
  put_bands(json, training.bands);
}

static void to_json(Json& json, const AggregateMethod& method) {
  json = {{"method", method.method},   {"class", class_name(method.of_class)},
          {"oracle", method.oracle()}, {"strata", method.strata},
          {"failed", method.failed},   {"steps", method.steps}};
  put_if_any(json, "training_tag", method.training_tag);
  if (!method.has_numbers()) return;
  put_bands(json, method.bands);
  Json& profile = json["profile"] = {{"share", Json::array()}, {"lo95", Json::array()}, {"hi95", Json::array()}};
  for (const statistics::Band& band : method.bands.profile) {
    profile["share"].push_back(number(band.estimate));
    profile["lo95"].push_back(number(band.interval.low));
    profile["hi95"].push_back(number(band.interval.high));
  }
  json["by_step"] = numbers(method.by_step);
  put_if_any(json, "trainings", method.trainings);
  if (method.spread)
    json["spread"] = {{"lowest", number(method.spread->lowest)},
                      {"highest", number(method.spread->highest)},
                      {"sd", number(method.spread->sd)}};
}

static void to_json(Json& json, const Stratum& stratum) {
  json = {{"scene", stratum.scene}, {"noise_level", stratum.noise_level}, {"instances", stratum.instances}};
}

static void to_json(Json& json, const AggregatePair& pair) {
  json = {{"a", pair.a}, {"b", pair.b}, {"n", pair.improvement.n}, {"improvement", number(pair.improvement.estimate)}};
  put_interval(json, pair.improvement.interval);
}

static void to_json(Json& json, const Aggregate& aggregate) {
  json = {{"protocol", aggregate.protocol}, {"resolution", statistics::kResolution},
          {"strata", aggregate.strata},     {"methods", aggregate.methods},
          {"pairs", aggregate.pairs},       {"profile_places", numbers(shown(statistics::profile_places()))}};
}

static void to_json(Json& json, const Source& source) {
  json = {{"folder", source.folder}, {"trials", source.trials}, {"cpu", source.cpu}, {"program", source.program}};
}

static void put_provenance(Json& json, const Provenance& from) {
  json.update({{"suite_name", from.suite_name},
               {"suite_file", from.suite_file},
               {"suite_text", from.suite_text},
               {"seed", from.seed},
               {"instance_set", from.instance_set},
               {"command", from.command},
               {"program", from.program},
               {"machine", from.machine}});
  if (from.sources.empty()) return;
  json["sources"] = from.sources;
  json["merge"] = from.merge;
}

Json to_json(const PageModel& page) {
  Json json = {{"format", 1},
               {"scenes", page.scenes},
               {"noise_levels", page.noise_levels},
               {"protocols", page.protocols},
               {"steps", page.steps ? Json{page.steps->least, page.steps->most} : Json::array()},
               {"instances", page.instances},
               {"ran", page.ran},
               {"methods", page.methods},
               {"groups", page.groups},
               {"failures", page.failures},
               {"warnings", page.warnings},
               {"rule", statistics::rule_name(page.rule)},
               {"targets", page.targets},
               {"resamples", page.resamples},
               {"smallest_relevant_ratio", page.smallest_relevant_ratio},
               {"gates", page.gates},
               {"scene_facts", page.scene_facts},
               {"verdict", page.verdict},
               {"caveats", page.caveats}};
  put_provenance(json, page.provenance);
  put_if_any(json, "spec", page.spec);
  put_if_any(json, "spec_text", page.spec_text);
  put_if_any(json, "aggregate", page.aggregates);
  put_if_any(json, "training", page.training);
  put_if_any(json, "rules_note", page.rules_note);
  if (page.trials_without_rules > 0) json["trials_without_rules"] = page.trials_without_rules;
  put_if_any(json, "analysis", page.analysis.plan);
  if (!page.analysis.plan.empty() || !page.analysis.notes.empty()) json["analysis_notes"] = page.analysis.notes;
  return json;
}

}  // namespace relign::report
