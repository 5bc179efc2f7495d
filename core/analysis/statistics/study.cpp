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
        options_(options),
        spec_(spec),
        reached_by_(series.largest_budget + std::size_t{1}, 0) {}

  void add(const ReadTrial& trial) {
    const double censored_at = std::max<double>(trial.row.budget, static_cast<double>(trial.steps.size() - 1));
    for (const Rule rule : kRules) {
      const std::vector<double> scores =
          track_values(trial.steps, trial.row.own_optimum_mse, track_of(rule), trial.series.score);
      if (rule == options_.rule)
        for (const TargetTime& time : times_to_targets(scores, targets_, censored_at))
          if (time.reached) ++reached_by_[std::min(static_cast<std::size_t>(time.steps), reached_by_.size() - 1)];
      if (std::isnan(spec_.score) || spec_.limits_criteria()) continue;
      TargetTime time = times_to_targets(scores, {spec_.score}, censored_at).front();
      const records::MtfRecord& mtf = table_.mtf_of(trial.row).by[rule][Curing::after];
      if (!spec_.mtf_met_by(mtf.centre, mtf.corner)) time = {censored_at, false};
      steps_[rule].push_back(time);
      // In seconds, trials that do not reach the specification are censored at infinity: budgets are in steps, and
      // censoring an early end at its time would drop it from those at risk, as if giving up were success.
      if (rule != options_.rule) continue;
      constexpr double kNever = std::numeric_limits<double>::infinity();
      const double seconds = time.reached ? seconds_at(trial.steps[static_cast<std::size_t>(time.steps)]) : kNever;
      seconds_.push_back({seconds, time.reached});
      if (std::isnan(options_.cycle.seconds)) continue;
      // Unknown computing time leaves the cycle unknown: it does not count as none.
      const double cycle = cycle_seconds(options_.cycle, seconds, time.steps, trial.row.algorithm_ms_per_step);
      cycle_known_ = cycle_known_ && !std::isnan(cycle);
      cycles_.push_back({time.reached ? cycle : kNever, time.reached});
    }
    if (options_.rule != Rule::own) return;  // records have the true pose of the own recommendation only
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
    study.expected_to_spec = expected_steps(steps_[options_.rule]);
    for (const Rule rule : kRules) study.rules[rule].steps_to_spec = median_steps(kaplan_meier(steps_[rule]));
    study.steps_to_spec = study.rules[options_.rule].steps_to_spec;
    study.seconds_to_spec = median_steps(kaplan_meier(seconds_));
    if (!cycles_.empty() && cycle_known_) study.cycle_to_spec = median_steps(kaplan_meier(cycles_));
    for (std::vector<double>& axis : residual_) study.residual.push_back(quantiles(std::move(axis)));
  }

 private:
  // The move to the recommended pose is recorded for the own rule only.
  double seconds_at(const records::StepNumbers& step) const {
    return options_.rule != Rule::own || std::isnan(step.recommended_seconds) ? step.machine_seconds
                                                                              : step.recommended_seconds;
  }

  const TrialTable& table_;
  std::vector<double> targets_;
  const StudyOptions& options_;
  const records::Specification& spec_;
  std::vector<std::size_t> reached_by_;  // pairs reached at exactly this step
  ByRule<std::vector<TargetTime>> steps_;
  std::vector<TargetTime> seconds_, cycles_;
  bool cycle_known_ = true;
  std::vector<std::vector<double>> residual_;
};

// Computes what is known of one series.
class SeriesStudier {
 public:
  const TrialTable& table;
  const Series& series;
  const Draws& draws;
  const StudyOptions& options;
  const records::Specification& spec;

  SeriesStudy run(SeriesErrors& errors, CostColumns& costs) const {
    SeriesStudy study;
    study.curve = {
        series.scene, series.noise_level, series.protocol, series.algorithm, series.trials.size(), series.failed, {}};
    if (series.trials.empty()) {
      if (!spec.limits_anything()) return study;
      study.yield = success_rate(0, series.failed);
      for (const Rule rule : kRules) study.rules[rule].yield = study.yield;
      return study;
    }
    read_steps(study, errors, costs);
    for (const Rule rule : kRules) count_yield(study, rule);
    study.in_spec = study.rules[options.rule].in_spec;
    study.yield = study.rules[options.rule].yield;
    if (draws.wanted) add_medians(study);
    return study;
  }

 private:
  bool has_bands(Track track) const {
    return draws.wanted && track != Track::machine_seconds &&
           (table.rows.size() <= kManyTrials || track == track_of(options.rule));
  }

  template <class Value>
  std::vector<double> of_trials(const Value& value) const {
    std::vector<double> values;
    for (const std::uint32_t trial : series.trials) values.push_back(value(table.rows[trial]));
    return values;
  }

  std::vector<double> by_instance(const std::vector<double>& values) const {
    return draws.by_instance(table, series, values);
  }
  std::vector<Band> medians(const std::vector<std::vector<double>>& columns) const {
    return bands(draws.resampling, columns, OrderStatistic::median());
  }

  // Of all columns at once, so that draws that are not stored are made once.
  void put_intervals(const std::vector<std::vector<double>>& columns, const std::vector<Interval*>& places) const {
    const std::vector<Band> found = medians(columns);
    for (std::size_t i = 0; i < found.size(); ++i) *places[i] = found[i].interval;
  }

  void read_steps(SeriesStudy& study, SeriesErrors& errors, CostColumns& costs) const {
    std::vector<CurvePoint>& points = study.curve.points;
    points.resize(series.largest_budget + std::size_t{1});
    for (std::size_t step = 0; step < points.size(); ++step) points[step].step = static_cast<unsigned>(step);
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
      fill(points, piece, columns);
    }
    if (!std::isnan(options.cycle.seconds)) {
      const double computing =
          quantiles(of_trials([](const TrialRow& row) { return row.algorithm_ms_per_step; })).median;
      for (CurvePoint& point : points)
        point.cycle_seconds = cycle_seconds(options.cycle, point.machine_seconds, point.step, computing);
    }
    arrivals.finish(series.trials.size(), study);
    spec_arrivals.finish(study);
    if (excess.any()) add_excess(study, excess);
  }

  void fill(std::vector<CurvePoint>& points, const Piece& piece, const TrackColumns& columns) const {
    const std::vector<unsigned> with_bands = band_steps(series.largest_budget);
    std::vector<std::vector<double>> values;
    std::vector<Interval*> places;
    for (unsigned step = piece.steps.first; step <= piece.steps.last; ++step)
      for (const Track track : piece.tracks) {
        const std::vector<double> column = columns.at(track, step);
        const auto place = static_cast<std::size_t>(track);
        if (track == Track::machine_seconds)
          points[step].machine_seconds = quantiles(column).median;
        else
          points[step].tracks[place] = quantiles(column);
        if (!has_bands(track) || !std::binary_search(with_bands.begin(), with_bands.end(), step)) continue;
        values.push_back(by_instance(column));
        places.push_back(&points[step].bands[place]);
      }
    put_intervals(values, places);
  }

  void add_excess(SeriesStudy& study, const ExcessColumns& columns) const {
    study.excess.resize(columns.images().size());
    std::vector<std::vector<double>> values;
    std::vector<Interval*> places;
    for (std::size_t place = 0; place < study.excess.size(); ++place) {
      study.excess[place].images = columns.images()[place];
      for (const Rule rule : kRules) {
        ExcessScore& score = study.excess[place].rules[rule];
        score.values = quantiles(columns.at(place, rule));
        if (!has_bands(track_of(rule))) continue;
        values.push_back(by_instance(columns.at(place, rule)));
        places.push_back(&score.interval);
      }
    }
    put_intervals(values, places);
  }

  // Instances in specification at the last recommendation by the rule, after curing, and by the options' before it.
  void count_yield(SeriesStudy& study, Rule rule) const {
    const auto mtf = [&](double records::MtfRecord::*field) {
      return quantiles(
          of_trials([&](const TrialRow& row) { return table.mtf_of(row).by[rule][Curing::after].*field; }));
    };
    const Quantiles centre = mtf(&records::MtfRecord::centre);
    if (rule == options.rule) {
      study.mtf_centre = centre;
      study.mtf_corner = mtf(&records::MtfRecord::corner);
    }
    const bool has_ground_truth = quantiles(last_values(table, series, track_of(rule))).n > 0;
    const bool has_mtf = !spec.limits_mtf() || centre.n > 0;
    const bool by_own_rule = rule == Rule::own || !spec.limits_criteria();
    if (!spec.limits_anything() || !has_ground_truth || !has_mtf || !by_own_rule) return;
    RuleScore& score = study.rules[rule];
    std::size_t known = 0;
    for (const std::uint32_t trial : series.trials) {
      const TrialRow& row = table.rows[trial];
      score.in_spec += table.meets(row, spec, rule) ? 1 : 0;
      if (rule != options.rule || spec.limits_criteria() || std::isnan(row.uncured[rule])) continue;
      const records::MtfRecord& uncured = table.mtf_of(row).by[rule][Curing::before];
      ++known;
      study.in_spec_uncured += spec.met_by(row.uncured[rule], uncured.centre, uncured.corner) ? 1 : 0;
    }
    score.yield = success_rate(score.in_spec, series.trials.size() + series.failed);
    if (known > 0) study.yield_uncured = success_rate(study.in_spec_uncured, known + series.failed);
  }

  void add_medians(SeriesStudy& study) const {
    std::vector<std::vector<double>> columns;
    for (std::size_t i = 0; i < series.score.further.size(); ++i)
      columns.push_back(
          by_instance(of_trials([&](const TrialRow& row) { return table.criteria_of(row).last[further_score(i)]; })));
    study.further = medians(columns);
    const auto last = [&](Track track) { return by_instance(last_values(table, series, track)); };
    columns = {last(Track::commanded)};
    for (const Rule rule : kRules) columns.push_back(last(track_of(rule)));
    const std::vector<Band> found = medians(columns);
    study.commanded_median = found.front();
    for (const Rule rule : kRules) study.rules[rule].median = found[1 + static_cast<std::size_t>(rule)];
    study.recommended_median = study.rules[options.rule].median;
    for (std::size_t k = 0; k < kFinalStatistics.size(); ++k)
      study.finals[k] = bands(draws.resampling, {last(track_of(options.rule))}, kFinalStatistics[k].of()).front();
  }
};

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
  std::vector<std::vector<double>> of_all;  // in the order of ranked
  for (const std::size_t series : ranked) of_all.push_back(columns[series]);
  if (rule == options.rule) group.friedman = friedman(of_all);
  PairedOptions paired;
  paired.smallest_relevant = std::log(options.smallest_relevant_ratio);
  const std::size_t firsts = ranked.size() <= kMaxComparedMethods ? ranked.size() : 1;
  const std::vector<Passes> passes = passes_of(table, ranked, group.spec, rule);
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
      pair.yields = compare_passes(passes[first], passes[second]);
      pair.comparison = compare_paired(of_all[first], of_all[second], draws.resampling, paired);
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
      study.series[series] = SeriesStudier{table, table.series[series], draws, options, group.spec}.run(
          errors[series], costs[static_cast<std::size_t>(place)]);
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
