#include "statistics/trial_table.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <tuple>
#include <unordered_set>

namespace relign::statistics {
namespace {

namespace fs = std::filesystem;

// Host time of an algorithm per step. The time before the first move is included; step 0 is not counted as a step.
double milliseconds_per_step(const records::TrialTimes& times) {
  const std::size_t steps = times.algorithm_seconds.size();
  if (steps == 0) return kMissing;
  double sum = 0;
  for (const double seconds : times.algorithm_seconds)
    if (std::isfinite(seconds)) sum += seconds;
  return 1000 * sum / static_cast<double>(steps > 1 ? steps - 1 : 1);
}

struct Harness {
  double harness = 0, scene = 0;
  std::size_t steps = 0;
};

// All 0 if not recorded.
Harness harness_of(const records::TrialTimes& times) {
  Harness result;
  if (std::isnan(times.harness_seconds)) return result;
  result.harness = times.harness_seconds;
  result.steps = times.simulation_seconds.size();
  for (const double seconds : times.simulation_seconds) result.scene += seconds;
  for (const double seconds : times.truth_seconds) result.scene += seconds;
  return result;
}

class TableBuilder {
 public:
  TableBuilder(TrialTable& table, const ScoresByScene& scores) : table_(table), scores_(scores) {
    for (const auto& [key, value] : records::tabled_values(records::TrialRecord())) table_.tabled.push_back(key);
  }

  void add(const records::TrialRecord& closing, const records::StoredTrial& where,
           const std::vector<records::StepNumbers>& steps) {
    TrialRow row;
    row.trial = closing.trial;
    row.where = where;
    row.instance = closing.instance;
    row.series = series_of(closing);
    const SceneScore& score = table_.series[row.series].score;
    row.end = text(closing.end);
    row.message = text(closing.message);
    row.budget = closing.budget;
    row.steps = static_cast<unsigned>(steps.size());
    row.ended_well = records::ended_well(closing.end);
    row.own_optimum_mse = closing.own_optimum.mse;
    const records::Scores& scores = closing.scores;
    const TrialMtf mtf{scores.mtf, closing.own_optimum.mtf};
    if (std::isfinite(mtf.by[Rule::own][Curing::after].centre) || std::isfinite(mtf.own_optimum.centre)) {
      row.mtf = static_cast<std::uint32_t>(table_.mtf.size());
      table_.mtf.push_back(mtf);
    }
    TrialCriteria criteria;
    for (const Criterion one : kCriteria)
      if (!closing.criteria[one].empty()) {
        criteria.last[one] = closing.criteria[one].back();
        row.criteria = static_cast<std::uint32_t>(table_.criteria.size());
      }
    criteria.further_at_optimum = closing.own_optimum.further_scores;
    criteria.optimum_deficit = closing.criterion_optimum_deficit;
    if (row.criteria > 0) table_.criteria.push_back(criteria);
    const std::vector<std::pair<std::string, double>> tabled = records::tabled_values(closing);
    if (std::any_of(tabled.begin(), tabled.end(), [](const auto& one) { return std::isfinite(one.second); }))
      for (const auto& [key, value] : tabled) row.tabled_of_trial.push_back(value);
    row.last.fill(kMissing);
    row.tabled.fill(kMissing);
    if (!steps.empty()) {
      const records::StepNumbers& last = steps.back();
      row.last_step = last.step;
      row.tabled = records::tabled_values(last);
      row.recommendation = text(last.recommendation);
      if (std::isfinite(scores.uncured_mse[Rule::own]))
        row.uncured = {{score.shown(scores.uncured_mse[Rule::own]),
                        score.shown(scores.by_step[Rule::best].mse.empty() ? steps[best_step(steps)].commanded_mse
                                                                           : scores.uncured_mse[Rule::best]),
                        score.shown(last.commanded_mse)}};
      for (const Track track : kTracks)
        row.last[static_cast<std::size_t>(track)] = track_values(steps, row.own_optimum_mse, track, score).back();
      if (steps.front().step == 0) {
        const std::vector<records::StepNumbers> start(1, steps.front());
        row.start_measured = start.front().measured;
        row.start_commanded = track_values(start, row.own_optimum_mse, Track::commanded, score).front();
      }
    }
    Series& series = table_.series[row.series];
    if (row.counts()) {
      series.trials.push_back(static_cast<std::uint32_t>(table_.rows.size()));
      series.largest_budget = std::max(series.largest_budget, row.budget);
    } else {
      ++series.failed;
    }
    for (const std::string& warning : closing.warnings) warn({row.series, text(warning)});
    table_.rows.push_back(std::move(row));
  }

 private:
  std::uint32_t series_of(const records::TrialRecord& trial) {
    auto key = std::make_tuple(trial.scene, trial.noise_level, trial.protocol, trial.algorithm);
    const auto [found, fresh] = series_.try_emplace(std::move(key), static_cast<std::uint32_t>(table_.series.size()));
    if (fresh)
      table_.series.push_back({trial.scene,
                               trial.noise_level,
                               trial.protocol,
                               trial.algorithm,
                               trial.algorithm_id,
                               trial.method,
                               trial.training,
                               {},
                               0,
                               0,
                               score_of(trial.scene)});
    return found->second;
  }
  SceneScore score_of(const std::string& scene) const {
    const auto found = scores_.find(scene);
    return found == scores_.end() ? SceneScore() : found->second;
  }
  std::uint32_t text(const std::string& words) {
    if (words.empty()) return 0;
    const auto [found, fresh] = texts_.try_emplace(words, static_cast<std::uint32_t>(table_.texts.size()));
    if (fresh) table_.texts.push_back(words);
    return found->second;
  }
  void warn(const TrialTable::Warning& warning) {
    const auto [found, fresh] = warnings_.try_emplace({warning.series, warning.text}, table_.warnings.size());
    if (fresh) table_.warnings.push_back({warning, 0});
    ++table_.warnings[found->second].count;
  }

  TrialTable& table_;
  const ScoresByScene& scores_;
  std::map<std::tuple<std::string, std::string, std::string, std::string>, std::uint32_t> series_;
  std::unordered_map<std::string, std::uint32_t> texts_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> warnings_;
};

// Rows by trial id: a sorted index, since a map would take as much memory as the rows.
class RowsByTrial {
 public:
  explicit RowsByTrial(const std::deque<TrialRow>& rows) : rows_(rows), order_(rows.size()) {
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<std::uint32_t>(i);
    std::sort(order_.begin(), order_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return rows_[a].trial < rows_[b].trial; });
  }
  // rows().size() if there is none.
  std::size_t operator[](std::string_view trial) const {
    const auto found = std::lower_bound(order_.begin(), order_.end(), trial,
                                        [&](std::uint32_t row, std::string_view id) { return rows_[row].trial < id; });
    return found != order_.end() && rows_[*found].trial == trial ? *found : rows_.size();
  }

 private:
  const std::deque<TrialRow>& rows_;
  std::vector<std::uint32_t> order_;
};

void read_times(TrialTable& table, records::FolderChecks* checks) {
  const RowsByTrial rows(table.rows);
  std::vector<Harness> harness(table.rows.size());
  records::for_each_times(table.folder, [&](const records::TrialTimes& times) {
    if (checks) checks->add(times);
    const std::size_t row = rows[times.trial];
    if (row == table.rows.size()) return;
    table.rows[row].algorithm_ms_per_step = milliseconds_per_step(times);
    harness[row] = harness_of(times);
  });
  for (const Harness& of_trial : harness) {
    table.harness_seconds += of_trial.harness;
    table.scene_seconds += of_trial.scene;
    table.timed_steps += of_trial.steps;
  }
}

}  // namespace

std::vector<double> last_values(const TrialTable& table, const Series& series, Track track) {
  std::vector<double> values;
  values.reserve(series.trials.size());
  for (const std::uint32_t row : series.trials) values.push_back(table.rows[row].last_of(track));
  return values;
}

ReadTable read_trial_table(const fs::path& folder, const std::function<bool(const std::string&)>& wanted,
                           records::FolderChecks* checks, const ScoresByScene& scores) {
  ReadTable read;
  read.table.folder = folder;
  std::unordered_set<std::string_view> seen;  // point into the rows, whose addresses stay valid
  std::vector<std::string> incomplete;
  TableBuilder builder(read.table, scores);
  records::for_each_with_steps(
      folder,
      [&](const records::TrialRecord& closing, const records::StoredTrial& where,
          const std::vector<records::StepNumbers>& steps) {
        if (checks) checks->add(closing, steps);
        if (wanted && !wanted(closing.trial)) {
          ++read.left_out;
        } else if (seen.count(closing.trial) == 0) {
          builder.add(closing, where, steps);
          seen.insert(read.table.rows.back().trial);
        }
      },
      [&](const std::string& trial) { incomplete.push_back(trial); });
  std::unordered_set<std::string> listed;
  for (const std::string& trial : incomplete)
    if ((!wanted || wanted(trial)) && seen.count(trial) == 0 && listed.insert(trial).second)
      read.incomplete.push_back(trial);
  std::unordered_set<std::string_view>().swap(seen);
  read_times(read.table, checks);
  return read;
}

}  // namespace relign::statistics
