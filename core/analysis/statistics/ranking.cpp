#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "statistics/curves.h"

namespace relign::statistics {
namespace {

double median_of(const TrialTable& table, const Series& series, double (*value)(const TrialRow&)) {
  std::vector<double> values;
  values.reserve(series.trials.size());
  for (const std::uint32_t row : series.trials) values.push_back(value(table.rows[row]));
  return quantiles(std::move(values)).median;
}

}  // namespace

std::vector<RankingRow> ranking(const TrialTable& table, Rule rule) {
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> group;
  std::vector<RankingRow> rows;
  for (const Series& series : table.series) {
    group.emplace(std::make_tuple(series.scene, series.noise_level, series.protocol), group.size());
    RankingRow row;
    row.scene = series.scene;
    row.noise_level = series.noise_level;
    row.protocol = series.protocol;
    row.algorithm = series.algorithm;
    row.trials = series.trials.size();
    row.failed = series.failed;
    row.step = series.largest_budget;
    row.recommended = quantiles(last_values(table, series, track_of(rule)));
    row.commanded = quantiles(last_values(table, series, Track::commanded));
    row.best_measured = quantiles(last_values(table, series, Track::best));
    row.measured_only = row.recommended.n == 0 && row.best_measured.n > 0;
    row.machine_seconds_median = median_of(table, series, [](const TrialRow& trial) {
      return std::isnan(trial.recommended_seconds()) ? trial.machine_seconds() : trial.recommended_seconds();
    });
    row.algorithm_ms_per_step_median =
        median_of(table, series, [](const TrialRow& trial) { return trial.algorithm_ms_per_step; });
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

}  // namespace relign::statistics
