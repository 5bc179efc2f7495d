#include "statistics/study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "base/machine.h"
#include "base/parallel.h"
#include "statistics/bootstrap.h"
#include "statistics/passes.h"
#include "statistics/proportion.h"
#include "statistics/spec_arrivals.h"
#include "statistics/study_aggregate.h"
#include "statistics/study_groups.h"
#include "statistics/survival.h"
#include "statistics/track_columns.h"

namespace relign::statistics {
namespace {

// Tracks and steps in memory at a time: all, one track, or a few steps of one track.
struct Piece {
  std::vector<Track> tracks;
  StepRange steps;
};

std::vector<Piece> pieces(std::size_t trials, unsigned last_step, std::size_t most_bytes) {
  std::vector<Track> all(kTracks.begin(), kTracks.end());
  all.push_back(Track::machine_seconds);
  const std::size_t steps = last_step + std::size_t{1};
  if (TrackColumns::bytes(trials, all.size(), steps) <= most_bytes) return {{all, {0, last_step}}};
  const std::size_t at_once = std::clamp<std::size_t>(most_bytes / TrackColumns::bytes(trials, 1, 1), 1, steps);
  std::vector<Piece> list;
  for (const Track track : all)
    for (std::size_t first = 0; first < steps; first += at_once)
      list.push_back(
          {{track}, {static_cast<unsigned>(first), static_cast<unsigned>(std::min(first + at_once, steps) - 1)}});
  return list;
}

// The instances of a group and the resamples that its methods share.
struct Draws {
  std::vector<std::uint64_t> instances;  // sorted
  Resampling resampling;
  bool wanted;  // bands are computed

  Draws(std::vector<std::uint64_t> of, const StudyOptions& options)
      : instances(std::move(of)),
        resampling(instances.size(), std::max<std::size_t>(options.resamples, 1), options.seed),
        wanted(options.resamples > 0) {}

  // From one value per trial to one per instance.
  std::vector<double> by_instance(const TrialTable& table, const Series& series,
                                  const std::vector<double>& values) const {
    std::vector<double> column(instances.size(), kMissing);
    for (std::size_t trial = 0; trial < values.size(); ++trial) {
      const std::uint64_t instance = table.rows[series.trials[trial]].instance;
      const auto place = std::lower_bound(instances.begin(), instances.end(), instance) - instances.begin();
      column[static_cast<std::size_t>(place)] = values[trial];
    }
    return column;
  }
};

// Times to targets and to specification, and residual misalignment, collected while a trial's steps are in memory.
class Arrivals {
 public:
  Arrivals(const TrialTable& table, const Series& series, const StudyOptions& options,
           const records::Specification& spec)
      : table_(table),
        targets_(options.targets.empty() ? default_targets(series.score.resolution) : options.targets),
        rule_(options.rule),
        cycle_(options.cycle),
        spec_(spec),
        reached_by_(series.largest_budget + std::size_t{1}, 0) {}

  void add(const ReadTrial& trial) {
    const double censored_at = std::max<double>(trial.row.budget, static_cast<double>(trial.steps.size() - 1));
    for (const Rule rule : kRules) {
      const std::vector<double> scores =
          track_values(trial.steps, trial.row.own_optimum_mse, track_of(rule), trial.series.score);
      if (rule == rule_)
        for (const TargetTime& time : times_to_targets(scores, targets_, censored_at))
          if (time.reached) ++reached_by_[std::min(static_cast<std::size_t>(time.steps), reached_by_.size() - 1)];
      if (std::isnan(spec_.score) || spec_.limits_criteria()) continue;
      TargetTime time = times_to_targets(scores, {spec_.score}, censored_at).front();
      const records::MtfRecord& mtf = table_.mtf_of(trial.row).by[rule][Curing::after];
      if (!spec_.mtf_met_by(mtf.centre, mtf.corner)) time = {censored_at, false};
      steps_[rule].push_back(time);
      // In seconds, trials that do not reach the specification are censored at infinity: budgets are in steps, and
      // censoring an early end at its time would drop it from those at risk, as if giving up were success.
      if (rule != rule_) continue;
      constexpr double kNever = std::numeric_limits<double>::infinity();
      const double seconds = time.reached ? seconds_at(trial.steps[static_cast<std::size_t>(time.steps)]) : kNever;
      seconds_.push_back({seconds, time.reached});
      if (std::isnan(cycle_.seconds)) continue;
      // Unknown computing time leaves the cycle unknown: it does not count as none.
      const double cycle = cycle_seconds(cycle_, seconds, time.steps, trial.row.algorithm_ms_per_step);
      cycle_known_ = cycle_known_ && !std::isnan(cycle);
      cycles_.push_back({time.reached ? cycle : kNever, time.reached});
    }
    if (rule_ != Rule::own) return;  // records have the true pose of the own recommendation only
    const std::vector<double>& best = trial.stored.own_optimum_pose();
    const std::vector<double>& ended = trial.steps.back().recommended_true_pose;
    if (best.empty() || best.size() != ended.size()) return;
    residual_.resize(best.size());
    for (std::size_t axis = 0; axis < best.size(); ++axis)
      residual_[axis].push_back(std::abs(ended[axis] - best[axis]));
  }

  void finish(std::size_t trials, SeriesStudy& study) {
    std::size_t so_far = 0;
    for (const std::size_t now : reached_by_) {
      so_far += now;
      const double pairs = static_cast<double>(trials * targets_.size());
      study.targets_reached.push_back(pairs > 0 ? static_cast<double>(so_far) / pairs : kMissing);
    }
    study.expected_to_spec = expected_steps(steps_[rule_]);
    for (const Rule rule : kRules) study.rules[rule].steps_to_spec = median_steps(kaplan_meier(steps_[rule]));
    study.steps_to_spec = study.rules[rule_].steps_to_spec;
    study.seconds_to_spec = median_steps(kaplan_meier(seconds_));
    if (!cycles_.empty() && cycle_known_) study.cycle_to_spec = median_steps(kaplan_meier(cycles_));
    for (std::vector<double>& axis : residual_) study.residual.push_back(quantiles(std::move(axis)));
  }

 private:
  // The move to the recommended pose is recorded for the own rule only.
  double seconds_at(const records::StepNumbers& step) const {
    return rule_ != Rule::own || std::isnan(step.recommended_seconds) ? step.machine_seconds : step.recommended_seconds;
  }

  const TrialTable& table_;
  std::vector<double> targets_;
  Rule rule_;
  Cycle cycle_;
  records::Specification spec_;
  std::vector<std::size_t> reached_by_;  // pairs reached at exactly this step
  ByRule<std::vector<TargetTime>> steps_;
  std::vector<TargetTime> seconds_, cycles_;
  bool cycle_known_ = true;
  std::vector<std::vector<double>> residual_;
};

void add_bands(Curve& curve, const TrialTable& table, const Series& series, const TrackColumns& columns,
               const Piece& piece, const Draws& draws, std::optional<Track> alone) {
  std::vector<std::vector<double>> values;
  std::vector<Interval*> places;
  for (const unsigned step : band_steps(series.largest_budget)) {
    if (step < piece.steps.first || step > piece.steps.last) continue;
    for (const Track track : piece.tracks) {
      if (track == Track::machine_seconds || (alone && track != *alone)) continue;
      values.push_back(draws.by_instance(table, series, columns.at(track, step)));
      places.push_back(&curve.points[step].bands[static_cast<std::size_t>(track)]);
    }
  }
  const std::vector<Band> found = bands(draws.resampling, values, OrderStatistic::median());
  for (std::size_t i = 0; i < found.size(); ++i) *places[i] = found[i].interval;
}

// `alone`: the only rule with intervals.
void add_excess(SeriesStudy& study, const TrialTable& table, const Series& series, const ExcessColumns& columns,
                const Draws& draws, std::optional<Rule> alone) {
  if (!columns.any()) return;
  std::vector<std::vector<double>> values;
  for (std::size_t place = 0; place < columns.images().size(); ++place) {
    ExcessAfter& after = study.excess.emplace_back();
    after.images = columns.images()[place];
    for (const Rule rule : kRules) {
      after.rules[rule].values = quantiles(columns.at(place, rule));
      if (draws.wanted && (!alone || rule == *alone))
        values.push_back(draws.by_instance(table, series, columns.at(place, rule)));
    }
  }
  const std::vector<Band> found = bands(draws.resampling, values, OrderStatistic::median());
  auto band = found.begin();
  if (band == found.end()) return;
  for (ExcessAfter& after : study.excess)
    for (const Rule rule : kRules)
      if (!alone || rule == *alone) after.rules[rule].interval = (band++)->interval;
}

void add_further_scores(SeriesStudy& study, const TrialTable& table, const Series& series, const Draws& draws) {
  std::vector<std::vector<double>> columns;
  for (std::size_t i = 0; i < series.score.further.size(); ++i) {
    std::vector<double> values;
    for (const std::uint32_t trial : series.trials)
      values.push_back(table.criteria_of(table.rows[trial]).last[further_score(i)]);
    columns.push_back(draws.by_instance(table, series, values));
  }
  if (!columns.empty()) study.further = bands(draws.resampling, columns, OrderStatistic::median());
}

// Instances in specification at the last recommendation by the rule, after curing.
void count_yield(const TrialTable& table, const Series& series, const records::Specification& spec, Rule rule,
                 RuleScore& score) {
  for (const std::uint32_t trial : series.trials) {
    const TrialRow& row = table.rows[trial];
    score.in_spec += table.meets(row, spec, rule) ? 1 : 0;
  }
  score.yield = success_rate(score.in_spec, series.trials.size() + series.failed);
}

// The same before curing.
void count_uncured(const TrialTable& table, const Series& series, const records::Specification& spec, Rule rule,
                   SeriesStudy& study) {
  std::size_t known = 0;
  for (const std::uint32_t trial : series.trials) {
    const TrialRow& row = table.rows[trial];
    const records::MtfRecord& mtf = table.mtf_of(row).by[rule][Curing::before];
    if (std::isnan(row.uncured[rule])) continue;
    ++known;
    study.in_spec_uncured += spec.met_by(row.uncured[rule], mtf.centre, mtf.corner) ? 1 : 0;
  }
  if (known > 0) study.yield_uncured = success_rate(study.in_spec_uncured, known + series.failed);
}

SeriesStudy study_series(const TrialTable& table, const Series& series, const Draws& draws, const StudyOptions& options,
                         const records::Specification& spec, SeriesErrors& errors, CostColumns& costs) {
  SeriesStudy study;
  Curve& curve = study.curve;
  curve.scene = series.scene;
  curve.noise_level = series.noise_level;
  curve.protocol = series.protocol;
  curve.algorithm = series.algorithm;
  curve.trials = series.trials.size();
  curve.failed = series.failed;
  if (series.trials.empty()) {
    if (!spec.limits_anything()) return study;
    study.yield = success_rate(0, series.failed);
    for (const Rule rule : kRules) study.rules[rule].yield = study.yield;
    return study;
  }
  curve.points.resize(series.largest_budget + std::size_t{1});
  for (std::size_t step = 0; step < curve.points.size(); ++step) curve.points[step].step = static_cast<unsigned>(step);

  Arrivals arrivals(table, series, options, spec);
  SpecArrivals spec_arrivals(table, series, spec, options.cycle);
  ExcessColumns excess(series);
  bool first = true;
  for (const Piece& piece : pieces(series.trials.size(), series.largest_budget, options.most_bytes)) {
    TrackColumns columns(series.trials.size(), piece.tracks, piece.steps);
    for_each_trial(table, series, [&](const ReadTrial& trial) {
      columns.add(trial);
      if (!first) return;
      arrivals.add(trial);
      if (options.rule == Rule::own) {
        spec_arrivals.add(trial);
        if (spec.limits_anything()) costs.add(trial, met_by_step(table, spec, trial));
      }
      excess.add(trial);
      errors.add(trial);
    });
    first = false;
    for (unsigned step = piece.steps.first; step <= piece.steps.last; ++step)
      for (const Track track : piece.tracks) {
        const Quantiles values = quantiles(columns.at(track, step));
        if (track == Track::machine_seconds)
          curve.points[step].machine_seconds = values.median;
        else
          curve.points[step].tracks[static_cast<std::size_t>(track)] = values;
      }
    if (draws.wanted)
      add_bands(curve, table, series, columns, piece, draws,
                table.rows.size() > kManyTrials ? std::optional(track_of(options.rule)) : std::nullopt);
  }
  if (!std::isnan(options.cycle.seconds)) {
    std::vector<double> ms_per_step;
    for (const std::uint32_t trial : series.trials) ms_per_step.push_back(table.rows[trial].algorithm_ms_per_step);
    const double computing = quantiles(std::move(ms_per_step)).median;
    for (CurvePoint& point : curve.points)
      point.cycle_seconds = cycle_seconds(options.cycle, point.machine_seconds, point.step, computing);
  }
  arrivals.finish(series.trials.size(), study);
  spec_arrivals.finish(study);
  add_excess(study, table, series, excess, draws,
             table.rows.size() > kManyTrials ? std::optional(options.rule) : std::nullopt);

  std::vector<std::vector<double>> columns;  // one per rule, then the commanded pose
  for (const Rule rule : kRules) {
    RuleScore& score = study.rules[rule];
    const std::vector<double> scores = last_values(table, series, track_of(rule));
    const bool has_ground_truth =
        std::any_of(scores.begin(), scores.end(), [](double one) { return !std::isnan(one); });
    std::vector<double> centre, corner;
    for (const std::uint32_t trial : series.trials) {
      centre.push_back(table.mtf_of(table.rows[trial]).by[rule][Curing::after].centre);
      corner.push_back(table.mtf_of(table.rows[trial]).by[rule][Curing::after].corner);
    }
    const Quantiles mtf_centre = quantiles(centre), mtf_corner = quantiles(corner);
    const bool has_mtf = !spec.limits_mtf() || mtf_centre.n > 0;
    const bool by_own_rule = rule == Rule::own || !spec.limits_criteria();
    const bool has_yield = spec.limits_anything() && has_ground_truth && has_mtf && by_own_rule;
    if (has_yield) count_yield(table, series, spec, rule, score);
    columns.push_back(draws.by_instance(table, series, scores));
    if (rule != options.rule) continue;
    study.mtf_centre = mtf_centre;
    study.mtf_corner = mtf_corner;
    study.in_spec = score.in_spec;
    study.yield = score.yield;
    if (has_yield && !spec.limits_criteria()) count_uncured(table, series, spec, rule, study);
  }
  if (!draws.wanted) return study;
  add_further_scores(study, table, series, draws);
  columns.push_back(draws.by_instance(table, series, last_values(table, series, Track::commanded)));
  const std::vector<Band> medians = bands(draws.resampling, columns, OrderStatistic::median());
  for (const Rule rule : kRules) study.rules[rule].median = medians[static_cast<std::size_t>(rule)];
  study.recommended_median = study.rules[options.rule].median;
  study.commanded_median = medians.back();
  for (std::size_t k = 0; k < kFinalStatistics.size(); ++k)
    study.finals[k] =
        bands(draws.resampling, {columns[static_cast<std::size_t>(options.rule)]}, kFinalStatistics[k].of()).front();
  return study;
}

// Score at the last recommendation, one per instance; values below the resolution are raised to it.
std::vector<double> score_column(const TrialTable& table, const Series& series, const Draws& draws, Rule rule) {
  std::vector<double> column = draws.by_instance(table, series, last_values(table, series, track_of(rule)));
  for (double& value : column)
    if (!std::isnan(value)) value = std::max(value, series.score.resolution);
  return column;
}

// Costs of a good module, for all series of a group. Failed trials count as modules that miss.
void add_costs(const TrialTable& table, const GroupStudy& group, const StudyOptions& options,
               std::vector<CostColumns>& columns, std::vector<SeriesStudy>& of_series) {
  for (const TrialRow& row : table.rows)
    for (std::size_t place = 0; place < group.series.size(); ++place)
      if (group.series[place] == row.series && !row.counts() && !columns[place].empty())
        columns[place].add_failed(row.instance);
  std::size_t baseline = columns.size();
  for (std::size_t place = 0; place < columns.size(); ++place) {
    if (columns[place].empty()) continue;
    if (table.series[group.series[place]].algorithm == options.prices.baseline) baseline = place;
    std::vector<CostStudy>& costs = of_series[group.series[place]].costs;
    const unsigned last = columns[place].last_step();
    costs.push_back(study_cost(options.prices, columns[place].at({last, last})));
    if (group.spec.limits_mtf()) continue;
    // A number chosen on one half may cost the other half more than the budget would: then the budget costs least.
    const CostStudy chosen = study_cost(options.prices, columns[place].cheapest());
    const bool lower = chosen.per_good_module.estimate < costs.front().per_good_module.estimate;
    costs.push_back(lower ? chosen : costs.front());
  }
  if (baseline == columns.size()) return;
  const std::vector<CostStudy>& against = of_series[group.series[baseline]].costs;
  for (std::size_t place = 0; place < columns.size(); ++place) {
    std::vector<CostStudy>& costs = of_series[group.series[place]].costs;
    for (std::size_t which = 0; place != baseline && which < costs.size(); ++which)
      costs[which].saves = saving(costs[which], against[which]);
  }
}

bool is_planned(const TrialTable& table, std::size_t a, std::size_t b, const StudyOptions& options) {
  const std::string &first = table.series[a].algorithm, &second = table.series[b].algorithm;
  return std::any_of(options.contrasts.begin(), options.contrasts.end(), [&](const auto& pair) {
    return (pair.first == first && pair.second == second) || (pair.first == second && pair.second == first);
  });
}

std::string class_of(const TrialTable& table, std::size_t series, const StudyOptions& options) {
  const auto found = options.classes.find({table.series[series].algorithm, table.series[series].protocol});
  return found == options.classes.end() ? "" : found->second;
}

// Holm's correction of p(pair) over the pairs with counts(pair); `put` stores the result.
template <class Counts, class P, class Put>
void correct(std::vector<PairStudy>& pairs, const Counts& counts, const P& p, const Put& put) {
  std::vector<double> values;
  for (const PairStudy& pair : pairs)
    if (counts(pair)) values.push_back(p(pair));
  const std::vector<double> corrected = holm(values);
  std::size_t place = 0;
  for (PairStudy& pair : pairs)
    if (counts(pair)) put(pair, corrected[place++]);
}

std::vector<PairStudy> compare_methods(const TrialTable& table, const Draws& draws, const StudyOptions& options,
                                       GroupStudy& group, Rule rule) {
  std::vector<std::size_t> ranked;  // series with a result, best median first
  std::vector<std::vector<double>> columns(table.series.size());
  std::vector<double> medians(table.series.size(), kMissing);
  for (const std::size_t series : group.series) {
    columns[series] = score_column(table, table.series[series], draws, rule);
    medians[series] = OrderStatistic::median().of(columns[series]);
    if (!std::isnan(medians[series])) ranked.push_back(series);
  }
  std::vector<PairStudy> pairs;
  if (ranked.size() < 2) return pairs;
  std::stable_sort(ranked.begin(), ranked.end(), [&](std::size_t a, std::size_t b) { return medians[a] < medians[b]; });
  std::vector<std::vector<double>> of_all;
  for (const std::size_t series : ranked) of_all.push_back(columns[series]);
  if (rule == options.rule) group.friedman = friedman(of_all);
  PairedOptions paired;
  paired.smallest_relevant = std::log(options.smallest_relevant_ratio);
  const std::size_t firsts = ranked.size() <= kMaxComparedMethods ? ranked.size() : 1;
  std::vector<Passes> passes(table.series.size());
  std::vector<Passes> of_ranked = passes_of(table, ranked, group.spec, rule);
  for (std::size_t i = 0; i < ranked.size(); ++i) passes[ranked[i]] = std::move(of_ranked[i]);
  std::set<std::string> classes_before = {""};
  for (std::size_t first = 0; first < ranked.size(); ++first) {
    const std::string own_class = class_of(table, ranked[first], options);
    const bool leads_its_class = classes_before.insert(own_class).second;
    for (std::size_t second = first + 1; second < ranked.size(); ++second) {
      PairStudy pair;
      pair.first = ranked[first];
      pair.second = ranked[second];
      pair.planned = is_planned(table, pair.first, pair.second, options);
      const bool in_class = leads_its_class && class_of(table, pair.second, options) == own_class;
      if (first >= firsts && !pair.planned && !in_class) continue;
      pair.yields = compare_passes(passes[pair.first], passes[pair.second]);
      pair.comparison = compare_paired(columns[pair.first], columns[pair.second], draws.resampling, paired);
      if (pair.comparison.difference.n < kMinCompared) pair.comparison.verdict = Verdict::undecided;
      pairs.push_back(std::move(pair));
    }
  }
  const auto of_errors = [](const PairStudy& pair) { return pair.comparison.test.p; };
  const auto planned = [](const PairStudy& pair) { return pair.planned; };
  correct(
      pairs, [](const PairStudy&) { return true; }, of_errors, [](PairStudy& pair, double p) { pair.corrected_p = p; });
  correct(pairs, planned, of_errors, [](PairStudy& pair, double p) { pair.planned_p = p; });
  correct(
      pairs, planned, [](const PairStudy& pair) { return pair.yields.p; },
      [](PairStudy& pair, double p) { pair.planned_yield_p = p; });
  return pairs;
}

}  // namespace

std::vector<double> default_targets(double resolution) {
  constexpr int kCount = 31;
  constexpr double kHighest = 500, kLowest = 5;
  std::vector<double> targets;
  for (int i = 0; i < kCount; ++i)
    targets.push_back(resolution * kHighest * std::pow(kLowest / kHighest, i / (kCount - 1.0)));
  return targets;
}

std::vector<unsigned> band_steps(unsigned last) {
  std::set<unsigned> steps = {0, last};
  const double most = std::log1p(last);
  for (std::size_t i = 0; i < kBandSteps; ++i)
    steps.insert(static_cast<unsigned>(std::lround(std::expm1(most * static_cast<double>(i) / (kBandSteps - 1.0)))));
  for (unsigned step = 1; steps.size() < std::min<std::size_t>(kBandSteps, last + std::size_t{1}); ++step)
    steps.insert(step);  // several may round to one
  return {steps.begin(), steps.end()};
}

Study make_study(const TrialTable& table, StudyOptions options) {
  Study study;
  if (table.rows.size() > kManyTrials) options.resamples = std::min(options.resamples, kResamplesOfMany);
  study.resamples = options.resamples;
  study.rule = options.rule;
  study.prices = options.prices;
  constexpr unsigned kMaxThreads = 8;
  const unsigned threads = options.threads > 0 ? options.threads : std::min(core_count(), kMaxThreads);
  options.most_bytes /= threads;
  Parallel parallel(threads);
  study.groups = groups_of(table);
  study.series.resize(table.series.size());
  std::vector<SeriesErrors> errors;
  for (const Series& series : table.series) errors.emplace_back(series, options.rule);
  for (GroupStudy& group : study.groups) {
    const auto spec = options.spec_of_scene.find(group.scene);
    group.spec = spec != options.spec_of_scene.end() ? spec->second : options.spec;
    find_further_at_optimum(table, group);
    find_infeasible(table, group, options.rule);
    const Draws draws(group.instances, options);
    std::vector<CostColumns> costs(group.series.size(), CostColumns(draws.instances, options.prices, options.cycle));
    parallel.for_each(static_cast<int>(group.series.size()), [&](int place, unsigned) {
      const std::size_t series = group.series[static_cast<std::size_t>(place)];
      study.series[series] = study_series(table, table.series[series], draws, options, group.spec, errors[series],
                                          costs[static_cast<std::size_t>(place)]);
    });
    if (options.prices.stated()) add_costs(table, group, options, costs, study.series);
    if (!draws.wanted) continue;
    for (const Rule rule : kRules) group.pairs_by_rule[rule] = compare_methods(table, draws, options, group, rule);
    group.pairs = group.pairs_by_rule[options.rule];
  }
  study.aggregates = aggregates_of(table, study, std::move(errors), options, parallel);
  return study;
}

}  // namespace relign::statistics
