// Curves and scores from trial records: medians and quartiles per step; the bands of the statistics
// stay empty until they are computed.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "records/record.h"

namespace relign::stats {

struct Quantiles {
  std::size_t n = 0;  // values that entered
  double median = 0, q25 = 0, q75 = 0, mean = 0;
};

// Linear interpolation between order statistics (NumPy's default, type 7). NaN does not enter. No value
// at all: n = 0 and every number NaN.
Quantiles quantiles(std::vector<double> values);

enum class Track { measured, best, commanded, recommended, excess };
inline constexpr std::array<Track, 5> kTracks = {Track::measured, Track::best, Track::commanded, Track::recommended,
                                                 Track::excess};
const char* track_name(Track track);

// The value of a track at a step, an RMSE; a trial that ended early carries its last step forward.
// Noise-free RMSE and excess are sqrt(max(0, MSE)): the unbiased MSE may be slightly negative. Nothing
// when the trial cannot have a value (excess without own optimum, a trial without steps).
std::optional<double> track_value(const records::TrialRecord& trial, Track track, unsigned step);

struct CurvePoint {
  unsigned step = 0;
  std::array<Quantiles, kTracks.size()> tracks;
};

struct Curve {
  std::string scene, noise_level, protocol, algorithm;
  std::size_t trials = 0;  // that entered (failed ones do not, and are counted apart)
  std::size_t failed = 0;
  std::vector<CurvePoint> points;  // step 0 to the largest budget
};

// In order of first appearance.
std::vector<Curve> make_curves(const std::vector<records::TrialRecord>& trials);

// curves.csv: scene,noise_level,protocol,algorithm,step,n, then for each track _median,_q25,_q75,_mean,
// _lo95,_hi95; the last two stay empty until the statistics fill them. Shortest round-trip numbers; a
// field that cannot have a value is empty. results/README.md has the other two.
std::string curves_csv(const std::vector<Curve>& curves);
Json curves_json(const std::vector<Curve>& curves);
std::string instances_csv(const std::vector<records::TrialRecord>& trials);

// One row of the ranking: an algorithm over one scene, level and protocol, best median first. Where no
// trial of the row has a truth (a station tells none), the lowest measured RMSE ranks it.
struct RankingRow {
  std::string scene, noise_level, protocol, algorithm;
  std::size_t trials = 0, failed = 0;
  unsigned step = 0;      // the last one
  Quantiles recommended;  // noise-free RMSE at the recommended pose, last step
  Quantiles commanded;
  bool measured_only = false;
  Quantiles best_measured;  // lowest measured RMSE of each trial, camera noise included
  const Quantiles& score() const { return measured_only ? best_measured : recommended; }
  double machine_seconds_median = 0;        // simulated, moving back to the recommendation included; a station's own
                                            // without moving back; NaN without trials
  double algorithm_ms_per_step_median = 0;  // host time, from times; NaN without
};
std::vector<RankingRow> ranking(const std::vector<Curve>& curves, const std::vector<records::TrialRecord>& trials,
                                const std::vector<records::TrialTimes>& times);

}  // namespace relign::stats
