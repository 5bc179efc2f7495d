#include "report/compare.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>

#include "base/error.h"
#include "base/json_members.h"
#include "base/text.h"
#include "records/instances.h"
#include "report/loaded_results.h"
#include "report/statistics_data.h"
#include "statistics/paired.h"
#include "statistics/passes.h"
#include "statistics/study.h"
#include "statistics/track_columns.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

using Place = std::tuple<std::string, std::string, std::string>;  // scene, noise level, protocol

Place place_of(const statistics::Series& series) { return {series.scene, series.noise_level, series.protocol}; }

// One side's values at one step, by instance.
std::map<std::uint64_t, double> values_at(const LoadedResults& results, const statistics::Series& series,
                                          statistics::Track track, unsigned step) {
  statistics::TrackColumns columns(series.trials.size(), {track}, {step, step});
  statistics::for_each_trial(results.trials, series, [&](const statistics::ReadTrial& trial) { columns.add(trial); });
  const std::vector<double> column = columns.at(track, step);
  std::map<std::uint64_t, double> values;
  for (std::size_t trial = 0; trial < column.size(); ++trial)
    values[results.trials.rows[series.trials[trial]].instance] = column[trial];
  return values;
}

struct SeriesPair {
  const statistics::Series* a;
  const statistics::Series* b;
};

struct ComparedSeries {
  const LoadedResults& results;
  const statistics::Series& series;
};

records::Specification spec_of(const ComparedSeries& of) {
  const statistics::StudyOptions options = study_options(of.results, statistics::Rule::own);
  const auto found = options.spec_of_scene.find(of.series.scene);
  return found == options.spec_of_scene.end() ? options.spec : found->second;
}

bool equal(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool equal(const records::Specification& a, const records::Specification& b) {
  return equal(a.score, b.score) && equal(a.lp_per_mm, b.lp_per_mm) && equal(a.mtf_centre, b.mtf_centre) &&
         equal(a.mtf_corner, b.mtf_corner) && a.diffraction == b.diffraction;
}

statistics::Passes passes_of(const ComparedSeries& of, const records::Specification& spec, statistics::Rule rule) {
  const auto place = static_cast<std::size_t>(&of.series - of.results.trials.series.data());
  return statistics::passes_of(of.results.trials, {place}, spec, rule).front();
}

// On common instances, at the last recommendation by the rule; failed trials count as missed. `first` is A. n is 0
// without a specification, if the two specifications differ, or if the required values are not recorded.
statistics::PairedShares compare_yield(const ComparedSeries& a, const ComparedSeries& b, statistics::Rule rule) {
  const records::Specification spec = spec_of(a);
  if (!spec.limits_anything() || !equal(spec, spec_of(b))) return {};
  return statistics::compare_passes(passes_of(a, spec, rule), passes_of(b, spec, rule));
}

class Comparer {
 public:
  Comparer(const ComparedSide& a, const ComparedSide& b, const CompareOptions& options)
      : side_a_(a), side_b_(b), options_(options), a_(load_results(a.folder)), b_(load_results(b.folder)) {
    check_instances();
    choose_by_plans();
    check_method(side_a_, a_);
    check_method(side_b_, b_);
    find_pairs();
  }

  Comparison result() {
    Comparison made;
    made.rule = rule_;
    made.track = options_.track;
    made.smallest_relevant_ratio = relevant_;
    made.unmatched = unmatched_;
    for (const SeriesPair& pair : pairs_) {
      made.pairs.push_back(compared(pair));
      for (const Gate& gate : options_.gates) {
        made.gates.push_back(gate_result(pair, gate));
        made.holds = made.holds && made.gates.back().holds;
      }
    }
    return made;
  }

 private:
  // Options that are not given come from the analysis plans, which must agree.
  void choose_by_plans() {
    const auto planned = [&](const char* key, const char* option, const auto& of_a, const auto& of_b) {
      if (of_a != of_b)
        throw Error(ErrorKind::bad_input, "the analysis plans of '" + side_a_.folder.string() + "' and '" +
                                              side_b_.folder.string() + "' differ in '" + key + "', " +
                                              Json(of_a).dump() + " and " + Json(of_b).dump() + "; choose with " +
                                              option);
      return of_a;
    };
    AnalysisPlan none;
    none.smallest_relevant_ratio = kRelevantRatio;
    const AnalysisPlan a = a_.manifest.analysis.value_or(none), b = b_.manifest.analysis.value_or(none);
    rule_ = options_.rule
                ? *options_.rule
                : statistics::rule_named(planned("rule", "--rule", a.rule, b.rule)).value_or(statistics::Rule::own);
    relevant_ = options_.smallest_relevant_ratio ? *options_.smallest_relevant_ratio
                                                 : planned("smallest_relevant_ratio", "--relevant",
                                                           a.smallest_relevant_ratio, b.smallest_relevant_ratio);
    for (const LoadedResults* results : {&a_, &b_})
      study_options(*results, rule_);  // checks that the records have its scores
  }

  // "recommended" of options and gates.
  statistics::Track by_rule(statistics::Track track) const {
    return track == statistics::Track::recommended ? statistics::track_of(rule_) : track;
  }

  ComparedPair compared(const SeriesPair& pair) const {
    ComparedPair made;
    static_cast<ComparedMethods&>(made) = methods_of(pair);
    made.step = step_of(pair, options_.step);
    made.failed_a = pair.a->failed;
    made.failed_b = pair.b->failed;
    const statistics::PairedComparison comparison = compare_at(pair, by_rule(options_.track), made.step, made.errors);
    made.missing = comparison.missing;
    made.errors.yield = yield_of(pair, rule_);
    made.differs = differing(pair);
    if (options_.track != statistics::Track::recommended) return made;
    made.rules.emplace();
    for (const statistics::Rule rule : statistics::kRules) {
      ComparedErrors errors;
      compare_at(pair, statistics::track_of(rule), made.step, errors);
      if (errors.n == 0) continue;
      errors.yield = yield_of(pair, rule);
      (*made.rules)[rule] = errors;
    }
    return made;
  }

  // One name may denote different methods in the two folders.
  std::vector<std::string> differing(const SeriesPair& pair) const {
    std::vector<std::string> names;
    if (pair.a->algorithm != pair.b->algorithm) return names;  // two methods, as requested
    const records::ManifestMethod *of_a = a_.manifest.method(pair.a->algorithm, pair.a->protocol),
                                  *of_b = b_.manifest.method(pair.b->algorithm, pair.b->protocol);
    if (!of_a || !of_b) return names;
    if (of_a->id != of_b->id) names.push_back("algorithm");
    if (of_a->parameters != of_b->parameters) names.push_back("parameters");
    if (of_a->merit != of_b->merit) names.push_back("merit");
    return names;
  }

  void check_instances() const {
    if (a_.manifest.instance_set == b_.manifest.instance_set) return;
    const std::string a = side_a_.folder.string(), b = side_b_.folder.string();
    // One may have more instances than the other: common ones are compared.
    const std::vector<std::string> different = records::different_instances(a_.manifest, b_.manifest, a, b);
    if (!different.empty())
      throw Error(ErrorKind::bad_input,
                  "'" + a + "' and '" + b +
                      "' have different instances, and only the same can be compared in pairs:\n  " +
                      join(different, "\n  "));
  }

  static void check_method(const ComparedSide& side, const LoadedResults& results) {
    if (side.method.empty()) return;
    std::set<std::string> known;
    for (const statistics::Series& series : results.trials.series) known.insert(series.algorithm);
    if (known.count(side.method)) return;
    throw Error(ErrorKind::bad_input,
                "unknown method '" + side.method + "' in '" + side.folder.string() + "'" +
                    suggestion(side.method, std::vector<std::string>(known.begin(), known.end())));
  }

  void find_pairs() {
    std::set<const statistics::Series*> used;
    for (const statistics::Series& a : a_.trials.series) {
      if (!side_a_.method.empty() && a.algorithm != side_a_.method) continue;
      const std::string wanted = side_b_.method.empty() ? a.algorithm : side_b_.method;
      const auto b =
          std::find_if(b_.trials.series.begin(), b_.trials.series.end(), [&](const statistics::Series& candidate) {
            return place_of(candidate) == place_of(a) && candidate.algorithm == wanted;
          });
      if (b == b_.trials.series.end())
        unmatched_.push_back(a.algorithm + " (" + a.scene + ", " + a.noise_level + ", " + a.protocol + ")");
      else
        pairs_.push_back({&a, &*b});
    }
    if (pairs_.empty())
      throw Error(ErrorKind::bad_input, "nothing to compare: '" + side_a_.folder.string() + "' and '" +
                                            side_b_.folder.string() +
                                            "' share no method on the same scene, noise level and protocol; choose one "
                                            "of each with FOLDER:METHOD");
  }

  unsigned step_of(const SeriesPair& pair, int wanted) const {
    const unsigned last = std::min(pair.a->largest_budget, pair.b->largest_budget);
    if (wanted > static_cast<int>(last))
      throw Error(ErrorKind::bad_input, "step " + std::to_string(wanted) + " is beyond the last common step " +
                                            std::to_string(last) + " of '" + pair.a->algorithm + "' and '" +
                                            pair.b->algorithm + "' on '" + pair.a->noise_level + "'");
    return wanted < 0 ? last : static_cast<unsigned>(wanted);
  }

  // B minus A, logarithms.
  statistics::PairedComparison compare_at(const SeriesPair& pair, statistics::Track track, unsigned step,
                                          ComparedErrors& errors) const {
    const std::map<std::uint64_t, double> a = values_at(a_, *pair.a, track, step);
    const std::map<std::uint64_t, double> b = values_at(b_, *pair.b, track, step);
    std::set<std::uint64_t> instances;
    for (const auto* side : {&a, &b})
      for (const auto& [instance, value] : *side) instances.insert(instance);
    std::vector<double> column_a, column_b;
    for (const std::uint64_t instance : instances) {
      column_a.push_back(resolved(a, instance, pair.a->score.resolution));
      column_b.push_back(resolved(b, instance, pair.a->score.resolution));
    }
    statistics::PairedOptions paired;
    paired.smallest_relevant = std::log(relevant_);
    const statistics::StudyOptions study = study_options(a_, statistics::Rule::own);
    statistics::PairedComparison comparison = statistics::compare_paired(
        column_b, column_a, statistics::Resampling(instances.size(), statistics::kResamples, study.seed), paired);
    if (comparison.difference.n < statistics::kMinCompared) comparison.verdict = statistics::Verdict::undecided;
    static_cast<Difference&>(errors) = difference_of(comparison, relevant_);
    errors.median_a = statistics::OrderStatistic::median().of(column_a);
    errors.median_b = statistics::OrderStatistic::median().of(column_b);
    return comparison;
  }

  statistics::PairedShares yield_of(const SeriesPair& pair, statistics::Rule rule) const {
    return compare_yield({a_, *pair.a}, {b_, *pair.b}, rule);
  }

  static double resolved(const std::map<std::uint64_t, double>& values, std::uint64_t instance, double resolution) {
    const auto found = values.find(instance);
    return found == values.end() || std::isnan(found->second) ? statistics::kMissing
                                                              : std::max(found->second, resolution);
  }

  static ComparedMethods methods_of(const SeriesPair& pair) {
    return {pair.a->scene, pair.a->noise_level, pair.a->protocol, pair.a->algorithm, pair.b->algorithm};
  }

  // An unknown value does not pass.
  GateResult gate_result(const SeriesPair& pair, const Gate& gate) const {
    GateResult made = {methods_of(pair), gate.text};
    if (gate.of == Gate::Of::yield || gate.of == Gate::Of::yield_against_a) {
      const statistics::PairedShares yield = yield_of(pair, rule_);
      const auto n = static_cast<double>(yield.n);
      if (yield.n > 0) made.value = static_cast<double>(yield.second) / n;
      const double limit = gate.of == Gate::Of::yield ? gate.limit : static_cast<double>(yield.first) / n + gate.limit;
      made.holds = made.value >= limit - kRounding;
    } else {
      ComparedErrors errors;
      const statistics::PairedComparison comparison =
          compare_at(pair, by_rule(gate.track), step_of(pair, gate.step), errors);
      made.value = gate.of == Gate::Of::ratio ? std::exp(comparison.difference.estimate) : errors.median_b;
      made.holds = made.value <= gate.limit;
    }
    return made;
  }

  static constexpr double kRelevantRatio = 1.1;
  static constexpr double kRounding = 1e-12;  // so that 0.97 - 0.02 of 100 is 95

  ComparedSide side_a_, side_b_;
  const CompareOptions& options_;
  LoadedResults a_, b_;
  statistics::Rule rule_ = statistics::Rule::own;
  double relevant_ = kRelevantRatio;
  std::vector<SeriesPair> pairs_;
  std::vector<std::string> unmatched_;
};

std::vector<std::string> track_names() {
  std::vector<std::string> names = {"rmse"};  // synonym of recommended
  for (const statistics::Track track : statistics::kTracks) names.emplace_back(statistics::track_name(track));
  return names;
}

std::optional<statistics::Track> track_named(const std::string& name) {
  for (const statistics::Track track : statistics::kTracks)
    if (name == statistics::track_name(track)) return track;
  if (name == "rmse") return statistics::Track::recommended;
  return std::nullopt;
}

// The whole text as a finite number.
std::optional<double> number_in(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value)) return std::nullopt;
  return value;
}

// "yield>=0.95", "yield>=A", "yield>=A-0.02".
Gate yield_gate(Gate gate) {
  const auto wrong = [&](const std::string& why) {
    return Error(ErrorKind::bad_input, "--gate '" + gate.text + "': " + why +
                                           "; examples: 'yield>=0.95', or 'yield>=A-0.02' for at most 0.02 below A");
  };
  constexpr std::string_view kBegin = "yield>=";
  if (gate.text.rfind(kBegin, 0) != 0) throw wrong("a yield gate must start with 'yield>=', without a step");
  std::string right = gate.text.substr(kBegin.size());
  const bool against_a = !right.empty() && right.front() == 'A';
  gate.of = against_a ? Gate::Of::yield_against_a : Gate::Of::yield;
  if (against_a) {
    right.erase(0, 1);
    if (right.empty()) return gate;
    if (right.front() != '-') throw wrong("expected '-' after 'A'");
    right.erase(0, 1);
  }
  const std::optional<double> share = number_in(right);
  if (!share || *share < 0 || *share > 1) throw wrong("'" + right + "' must be a number from 0 to 1");
  gate.limit = against_a ? -*share : *share;
  return gate;
}

}  // namespace

ComparedSide compared_side(const std::string& text) {
  std::error_code code;
  if (fs::is_directory(text, code)) return {text, ""};
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos && colon > 0 && fs::is_directory(text.substr(0, colon), code))
    return {text.substr(0, colon), text.substr(colon + 1)};
  throw Error(ErrorKind::io, "no results folder '" + text + "'; expected FOLDER or FOLDER:METHOD");
}

statistics::Track parse_track(const std::string& name) {
  const auto track = track_named(name);
  if (!track)
    throw Error(ErrorKind::bad_input, "--track: unknown track '" + name + "'" + suggestion(name, track_names()));
  return *track;
}

Gate parse_gate(const std::string& text) {
  const auto wrong = [&](const std::string& why) {
    return Error(ErrorKind::bad_input, "--gate '" + text + "': " + why + "; example: 'recommended@20<=1.02x'");
  };
  Gate gate;
  gate.text = text;
  if (text.rfind("yield", 0) == 0) return yield_gate(gate);
  const std::size_t sign = text.find("<=");
  if (sign == std::string::npos) throw wrong("missing '<='");
  std::string left = text.substr(0, sign), right = text.substr(sign + 2);
  if (const std::size_t at = left.find('@'); at != std::string::npos) {
    const std::string step = left.substr(at + 1);
    if (step.empty() || step.size() > 6 || step.find_first_not_of("0123456789") != std::string::npos)
      throw wrong("step '" + step + "' must be a non-negative integer");
    gate.step = std::stoi(step);
    left.resize(at);
  }
  const auto track = track_named(left);
  if (!track) throw wrong("unknown track '" + left + "'" + suggestion(left, track_names()));
  gate.track = *track;
  gate.of = !right.empty() && right.back() == 'x' ? Gate::Of::ratio : Gate::Of::median;
  if (gate.of == Gate::Of::ratio) right.pop_back();
  const std::optional<double> limit = number_in(right);
  if (!limit || *limit <= 0) throw wrong("'" + right + "' must be a positive number");
  gate.limit = *limit;
  return gate;
}

Comparison compare(const ComparedSide& a, const ComparedSide& b, const CompareOptions& options) {
  return Comparer(a, b, options).result();
}

}  // namespace relign::report
