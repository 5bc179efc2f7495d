#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "stats/curves.h"

namespace relign::stats {
namespace {

using Key = std::tuple<std::string, std::string, std::string, std::string>;

// Host time of an algorithm per step it made, step 0 (which costs no step) left out of the count but
// not its time: what an algorithm does before its first move is its own time.
double milliseconds_per_step(const records::TrialTimes& times) {
  double sum = 0;
  for (const double seconds : times.algorithm_seconds)
    if (std::isfinite(seconds)) sum += seconds;
  const std::size_t steps = times.algorithm_seconds.size();
  return 1000 * sum / static_cast<double>(steps > 1 ? steps - 1 : 1);
}

}  // namespace

std::vector<RankingRow> ranking(const std::vector<Curve>& curves, const std::vector<records::TrialRecord>& trials,
                                const std::vector<records::TrialTimes>& times) {
  std::map<std::string, double> per_step;
  for (const records::TrialTimes& of_trial : times)
    if (!of_trial.algorithm_seconds.empty()) per_step[of_trial.trial] = milliseconds_per_step(of_trial);
  std::map<Key, std::vector<double>> machine_seconds, algorithm_ms;
  for (const records::TrialRecord& trial : trials) {
    if (!records::ended_well(trial.end) || trial.steps.empty()) continue;
    const Key key(trial.scene, trial.noise_level, trial.protocol, trial.algorithm);
    const records::StepRecord& last = trial.steps.back();
    machine_seconds[key].push_back(std::isnan(last.recommended_seconds) ? last.machine_seconds
                                                                        : last.recommended_seconds);
    if (const auto found = per_step.find(trial.trial); found != per_step.end())
      algorithm_ms[key].push_back(found->second);
  }

  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> group;
  std::vector<RankingRow> rows;
  for (const Curve& curve : curves) {
    group.emplace(std::make_tuple(curve.scene, curve.noise_level, curve.protocol), group.size());
    RankingRow row;
    row.scene = curve.scene;
    row.noise_level = curve.noise_level;
    row.protocol = curve.protocol;
    row.algorithm = curve.algorithm;
    row.trials = curve.trials;
    row.failed = curve.failed;
    row.recommended = row.commanded = row.best_measured = quantiles({});
    if (!curve.points.empty()) {
      const CurvePoint& last = curve.points.back();
      row.step = last.step;
      row.recommended = last.tracks[static_cast<std::size_t>(Track::recommended)];
      row.commanded = last.tracks[static_cast<std::size_t>(Track::commanded)];
      row.best_measured = last.tracks[static_cast<std::size_t>(Track::best)];
      row.measured_only = row.recommended.n == 0 && row.best_measured.n > 0;
    }
    const Key key(curve.scene, curve.noise_level, curve.protocol, curve.algorithm);
    row.machine_seconds_median = quantiles(machine_seconds[key]).median;
    row.algorithm_ms_per_step_median = quantiles(algorithm_ms[key]).median;
    rows.push_back(std::move(row));
  }
  std::stable_sort(rows.begin(), rows.end(), [&group](const RankingRow& a, const RankingRow& b) {
    const std::size_t group_a = group.at({a.scene, a.noise_level, a.protocol});
    const std::size_t group_b = group.at({b.scene, b.noise_level, b.protocol});
    if (group_a != group_b) return group_a < group_b;
    const double median_a = a.score().n ? a.score().median : std::numeric_limits<double>::infinity();
    const double median_b = b.score().n ? b.score().median : std::numeric_limits<double>::infinity();
    return median_a < median_b;
  });
  return rows;
}

}  // namespace relign::stats
