// Curves and scores of trials as tables. The numbers are made in study.h.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_source.h"
#include "statistics/band.h"
#include "statistics/quantiles.h"
#include "statistics/trial_table.h"

namespace relign::statistics {

struct CurvePoint {
  unsigned step = 0;
  std::array<Quantiles, kTracks.size()> tracks;
  std::array<Interval, kTracks.size()> bands;  // of the medians; missing where none was computed
  double machine_seconds = kMissing;           // simulated, median
};

struct Curve {
  std::string scene, noise_level, protocol, algorithm;
  std::size_t trials = 0;  // that entered (failed ones do not, and are counted apart)
  std::size_t failed = 0;
  std::vector<CurvePoint> points;  // step 0 to the largest budget
};

// Of the values that a study holds at a time: what is larger is read again for each track, or for a few steps of it.
inline constexpr std::size_t kCurveBytes = 128'000'000;

// curves.csv: scene,noise_level,protocol,algorithm,step,n, then for each track _median,_q25,_q75,_mean,
// _lo95,_hi95 (of the median; empty at steps without a band), after the first five machine_seconds_median. Shortest
// round-trip numbers; a field that cannot have a value is empty. results/README.md has the other two.
std::string curves_csv(const std::vector<Curve>& curves);
Json curves_json(const std::vector<Curve>& curves);
// A row at a time, the head first.
void instances_csv(const TrialTable& table, const std::function<void(std::string_view)>& write);

// One row of the ranking: an algorithm over one scene, level and protocol, best median first. Where no
// trial of the row has a truth (a station tells none), the lowest measured RMSE ranks it.
struct RankingRow {
  std::string scene, noise_level, protocol, algorithm;
  std::size_t trials = 0, failed = 0;
  unsigned step = 0;      // the last one
  Quantiles recommended;  // noise-free RMSE at the pose that the rule recommends, last step
  Quantiles commanded;
  bool measured_only = false;
  Quantiles best_measured;  // lowest measured RMSE of each trial, camera noise included
  const Quantiles& score() const { return measured_only ? best_measured : recommended; }
  double machine_seconds_median = 0;        // simulated, moving back to the recommendation included; a station's own
                                            // without moving back; NaN without trials
  double algorithm_ms_per_step_median = 0;  // host time; NaN where no trial tells it
};
std::vector<RankingRow> ranking(const TrialTable& table, Rule rule = Rule::own);

}  // namespace relign::statistics
