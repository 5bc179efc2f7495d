// Convergence curves and rankings, and their tables as CSV and JSON. study.h computes the numbers.
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
  std::array<Interval, kTracks.size()> bands;  // of the medians; NaN where not computed
  double machine_seconds = kMissing;           // simulated, median
  // Of the specification: medians over the trials, and the share of those that meet everything; NaN without.
  ByCriterion<double> criteria = records::Specification::none();
  double in_spec = kMissing;
  double cycle_seconds = kMissing;  // of a whole cycle (cycle.h) that ends alignment here, from medians
};

struct Curve {
  std::string scene, noise_level, protocol, algorithm;
  std::size_t trials = 0;  // used; failed trials are excluded
  std::size_t failed = 0;
  std::vector<CurvePoint> points;  // step 0 to the largest budget
};

// Limit for the values in memory: larger studies are read once per track, or once per few steps of a track.
inline constexpr std::size_t kCurveBytes = 128'000'000;

// curves.csv: scene,noise_level,protocol,algorithm,step,n, then for each track _median,_q25,_q75,_mean,_lo95,_hi95 (of
// the median; empty at steps without a band), with machine_seconds_median after the first five tracks, and at the end
// cycle_seconds_median if the suite states a cycle. Numbers are the shortest that read back the same; missing values
// are empty. results/README.md describes the other two files.
std::string curves_csv(const std::vector<Curve>& curves);
Json curves_json(const std::vector<Curve>& curves);
// Calls `write` once per row, first with the header.
void instances_csv(const TrialTable& table, const std::function<void(std::string_view)>& write);

// One row of the ranking: an algorithm on one scene, noise level and protocol. Ranked by noise-free score, or by the
// lowest measured one where no trial of the row has ground truth (hardware stations).
struct RankingRow {
  std::string scene, noise_level, protocol, algorithm;
  std::size_t trials = 0, failed = 0;
  unsigned step = 0;      // the last one
  Quantiles recommended;  // noise-free score at the pose recommended by the rule, last step
  Quantiles commanded;
  bool measured_only = false;
  Quantiles best_measured;  // lowest measured score of each trial, camera noise included
  const Quantiles& score() const { return measured_only ? best_measured : recommended; }
  double machine_seconds_median = 0;        // simulated, including the move to the recommended pose; on a station the
                                            // recorded time without that move; NaN without trials
  double algorithm_ms_per_step_median = 0;  // host time; NaN if no trial recorded it
};
// Best median first within each scene, noise level and protocol, groups in order of first appearance.
std::vector<RankingRow> ranking(const TrialTable& table, Rule rule = Rule::own);

}  // namespace relign::statistics
