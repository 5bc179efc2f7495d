#include "stats/study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "base/machine.h"
#include "base/parallel.h"
#include "stats/bootstrap.h"
#include "stats/proportion.h"
#include "stats/study_aggregate.h"
#include "stats/study_groups.h"
#include "stats/survival.h"
#include "stats/track_columns.h"

namespace relign::stats {
namespace {

// The tracks and steps that are held at once: all, or one track's, or a few steps of one.
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

// One comparable group's instances, and the draws that all its methods share.
struct Draws {
  std::vector<std::uint64_t> instances;  // sorted
  Resampling resampling;
  bool wanted;  // bands at all

  Draws(std::vector<std::uint64_t> of, const StudyOptions& options)
      : instances(std::move(of)),
        resampling(instances.size(), std::max<std::size_t>(options.resamples, 1), options.seed),
        wanted(options.resamples > 0) {}

  // One value a trial becomes one an instance.
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

// What is gathered of each trial while its steps are at hand.
class Arrivals {
 public:
  Arrivals(const TrialTable& table, const Series& series, const std::vector<double>& targets,
           const records::Specification& spec)
      : table_(table), targets_(targets), spec_(spec), reached_by_(series.largest_budget + std::size_t{1}, 0) {}

  void add(const ReadTrial& trial) {
    const std::vector<double> rmse = track_values(trial.steps, trial.row.own_optimum_mse, Track::recommended);
    const double watched = std::max<double>(trial.row.budget, static_cast<double>(rmse.size() - 1));
    for (const TargetTime& time : times_to_targets(rmse, targets_, watched))
      if (time.reached) ++reached_by_[std::min(static_cast<std::size_t>(time.steps), reached_by_.size() - 1)];
    if (!std::isnan(spec_.rmse)) {
      TargetTime time = times_to_targets(rmse, {spec_.rmse}, watched).front();
      const records::MtfRecord& mtf = table_.mtf_of(trial.row).glued;
      if (!spec_.mtf_met_by(mtf.centre, mtf.corner)) time = {watched, false};
      steps_.push_back(time);
      // A lens that does not get there counts as watched for ever: budgets are in steps, and a trial that gave up after
      // a second would leave the count of those still on their way, as if giving up were success.
      seconds_.push_back({time.reached ? seconds_at(trial.steps[static_cast<std::size_t>(time.steps)])
                                       : std::numeric_limits<double>::infinity(),
                          time.reached});
    }
    const std::vector<double> best = trial.stored.own_optimum_pose();
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
    study.expected_to_spec = expected_steps(steps_);
    study.steps_to_spec = median_steps(kaplan_meier(steps_));
    study.seconds_to_spec = median_steps(kaplan_meier(seconds_));
    for (std::vector<double>& axis : residual_) study.residual.push_back(quantiles(std::move(axis)));
  }

 private:
  static double seconds_at(const records::StepNumbers& step) {
    return std::isnan(step.recommended_seconds) ? step.machine_seconds : step.recommended_seconds;
  }

  const TrialTable& table_;
  const std::vector<double>& targets_;
  records::Specification spec_;
  std::vector<std::size_t> reached_by_;  // pairs that are reached at exactly this step
  std::vector<TargetTime> steps_, seconds_;
  std::vector<std::vector<double>> residual_;
};

void add_bands(Curve& curve, const TrialTable& table, const Series& series, const TrackColumns& columns,
               const Piece& piece, const Draws& draws, bool recommended_alone) {
  std::vector<std::vector<double>> values;
  std::vector<Interval*> places;
  for (const unsigned step : band_steps(series.largest_budget)) {
    if (step < piece.steps.first || step > piece.steps.last) continue;
    for (const Track track : piece.tracks) {
      if (track == Track::machine_seconds || (recommended_alone && track != Track::recommended)) continue;
      values.push_back(draws.by_instance(table, series, columns.at(track, step)));
      places.push_back(&curve.points[step].bands[static_cast<std::size_t>(track)]);
    }
  }
  const std::vector<Band> found = bands(draws.resampling, values, OrderStatistic::median());
  for (std::size_t i = 0; i < found.size(); ++i) *places[i] = found[i].interval;
}

// Lenses in specification at the last recommendation, where the glue leaves them and before it cures.
void count_yield(const TrialTable& table, const Series& series, const records::Specification& spec,
                 SeriesStudy& study) {
  std::size_t told = 0;
  for (const std::uint32_t trial : series.trials) {
    const TrialRow& row = table.rows[trial];
    const TrialMtf& mtf = table.mtf_of(row);
    study.in_spec += spec.met_by(row.last_of(Track::recommended), mtf.glued.centre, mtf.glued.corner) ? 1 : 0;
    if (std::isnan(row.uncured)) continue;
    ++told;
    study.in_spec_uncured += spec.met_by(row.uncured, mtf.uncured.centre, mtf.uncured.corner) ? 1 : 0;
  }
  study.yield = success_rate(study.in_spec, series.trials.size() + series.failed);
  if (told > 0) study.yield_uncured = success_rate(study.in_spec_uncured, told + series.failed);
}

SeriesStudy study_series(const TrialTable& table, const Series& series, const Draws& draws, const StudyOptions& options,
                         const records::Specification& spec, SeriesErrors& errors) {
  SeriesStudy study;
  Curve& curve = study.curve;
  curve.scene = series.scene;
  curve.noise_level = series.noise_level;
  curve.protocol = series.protocol;
  curve.algorithm = series.algorithm;
  curve.trials = series.trials.size();
  curve.failed = series.failed;
  if (series.trials.empty()) {
    if (spec.limits_anything()) study.yield = success_rate(0, series.failed);
    return study;
  }
  curve.points.resize(series.largest_budget + std::size_t{1});
  for (std::size_t step = 0; step < curve.points.size(); ++step) curve.points[step].step = static_cast<unsigned>(step);

  Arrivals arrivals(table, series, options.targets, spec);
  bool first = true;
  for (const Piece& piece : pieces(series.trials.size(), series.largest_budget, options.most_bytes)) {
    TrackColumns columns(series.trials.size(), piece.tracks, piece.steps);
    for_each_trial(table, series, [&](const ReadTrial& trial) {
      columns.add(trial);
      if (!first) return;
      arrivals.add(trial);
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
    if (draws.wanted) add_bands(curve, table, series, columns, piece, draws, table.rows.size() > kManyTrials);
  }
  arrivals.finish(series.trials.size(), study);

  const std::vector<double> recommended = last_values(table, series, Track::recommended);
  const bool truth_is_known =
      std::any_of(recommended.begin(), recommended.end(), [](double rmse) { return !std::isnan(rmse); });
  std::vector<double> centre, corner;
  for (const std::uint32_t trial : series.trials) {
    centre.push_back(table.mtf_of(table.rows[trial]).glued.centre);
    corner.push_back(table.mtf_of(table.rows[trial]).glued.corner);
  }
  study.mtf_centre = quantiles(centre);
  study.mtf_corner = quantiles(corner);
  const bool mtf_is_known = !spec.limits_mtf() || study.mtf_centre.n > 0;
  if (spec.limits_anything() && truth_is_known && mtf_is_known) count_yield(table, series, spec, study);
  if (draws.wanted) {
    const std::vector<std::vector<double>> columns = {
        draws.by_instance(table, series, recommended),
        draws.by_instance(table, series, last_values(table, series, Track::commanded))};
    const std::vector<Band> medians = bands(draws.resampling, columns, OrderStatistic::median());
    study.recommended_median = medians[0];
    study.commanded_median = medians[1];
    study.recommended_iqm = bands(draws.resampling, {columns[0]}, OrderStatistic::iqm()).front();
  }
  return study;
}

// RMSE at the last recommendation, one an instance; what is below the resolution counts as the resolution.
std::vector<double> score_column(const TrialTable& table, const Series& series, const Draws& draws) {
  std::vector<double> column = draws.by_instance(table, series, last_values(table, series, Track::recommended));
  for (double& rmse : column)
    if (!std::isnan(rmse)) rmse = std::max(rmse, kResolution);
  return column;
}

void compare_methods(const TrialTable& table, const Draws& draws, const StudyOptions& options, GroupStudy& group) {
  std::vector<std::size_t> ranked;  // series with a result, best median first
  std::vector<std::vector<double>> columns(table.series.size());
  std::vector<double> medians(table.series.size(), kMissing);
  for (const std::size_t series : group.series) {
    columns[series] = score_column(table, table.series[series], draws);
    medians[series] = OrderStatistic::median().of(columns[series]);
    if (!std::isnan(medians[series])) ranked.push_back(series);
  }
  if (ranked.size() < 2) return;
  std::stable_sort(ranked.begin(), ranked.end(), [&](std::size_t a, std::size_t b) { return medians[a] < medians[b]; });
  std::vector<std::vector<double>> of_all;
  for (const std::size_t series : ranked) of_all.push_back(columns[series]);
  group.friedman = friedman(of_all);
  PairedOptions paired;
  paired.smallest_relevant = std::log(options.smallest_relevant_ratio);
  const std::size_t firsts = ranked.size() <= kMostComparedMethods ? ranked.size() : 1;
  std::vector<double> p;
  for (std::size_t first = 0; first < firsts; ++first)
    for (std::size_t second = first + 1; second < ranked.size(); ++second) {
      PairStudy pair;
      pair.first = ranked[first];
      pair.second = ranked[second];
      pair.comparison = compare_paired(columns[pair.first], columns[pair.second], draws.resampling, paired);
      if (pair.comparison.difference.n < kFewestCompared) pair.comparison.verdict = Verdict::undecided;
      p.push_back(pair.comparison.test.p);
      group.pairs.push_back(std::move(pair));
    }
  const std::vector<double> corrected = holm(p);
  for (std::size_t i = 0; i < corrected.size(); ++i) group.pairs[i].corrected_p = corrected[i];
}

}  // namespace

std::vector<double> default_targets() {
  constexpr int kCount = 31;
  constexpr double kHighest = 0.05, kLowest = 0.0005;
  std::vector<double> targets;
  for (int i = 0; i < kCount; ++i) targets.push_back(kHighest * std::pow(kLowest / kHighest, i / (kCount - 1.0)));
  return targets;
}

std::vector<unsigned> band_steps(unsigned last) {
  std::set<unsigned> steps = {0, last};
  const double most = std::log1p(last);
  for (std::size_t i = 0; i < kBandSteps; ++i)
    steps.insert(static_cast<unsigned>(std::lround(std::expm1(most * static_cast<double>(i) / (kBandSteps - 1.0)))));
  for (unsigned step = 1; steps.size() < std::min<std::size_t>(kBandSteps, last + std::size_t{1}); ++step)
    steps.insert(step);  // several were rounded to one
  return {steps.begin(), steps.end()};
}

Study make_study(const TrialTable& table, StudyOptions options) {
  Study study;
  if (table.rows.size() > kManyTrials) options.resamples = std::min(options.resamples, kResamplesOfMany);
  if (options.targets.empty()) options.targets = default_targets();
  study.resamples = options.resamples;
  constexpr unsigned kMostThreads = 8;
  const unsigned threads = options.threads > 0 ? options.threads : std::min(core_count(), kMostThreads);
  options.most_bytes /= threads;
  Parallel parallel(threads);
  study.groups = groups_of(table);
  study.series.resize(table.series.size());
  std::vector<SeriesErrors> errors(table.series.begin(), table.series.end());
  for (GroupStudy& group : study.groups) {
    const auto spec = options.spec_of_scene.find(group.scene);
    group.spec = spec != options.spec_of_scene.end() ? spec->second : options.spec;
    find_hopeless(table, group);
    const Draws draws(group.instances, options);
    parallel.for_each(static_cast<int>(group.series.size()), [&](int place, unsigned) {
      const std::size_t series = group.series[static_cast<std::size_t>(place)];
      study.series[series] = study_series(table, table.series[series], draws, options, group.spec, errors[series]);
    });
    if (draws.wanted) compare_methods(table, draws, options, group);
  }
  study.aggregates = aggregates_of(table, study, std::move(errors), options, parallel);
  return study;
}

}  // namespace relign::stats
