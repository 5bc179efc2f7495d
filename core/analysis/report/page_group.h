// The results of one scene, noise level and protocol: a group of methods that ran on the same instances.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/scene_score.h"
#include "records/specification.h"
#include "report/methods.h"
#include "report/page_numbers.h"
#include "report/scene_words.h"
#include "statistics/costs.h"
#include "statistics/curves.h"
#include "statistics/order_statistic.h"
#include "statistics/paired.h"
#include "statistics/rules.h"

namespace relign::report {

// Score of the scene over the instances.
struct Score {
  std::size_t n = 0;
  double median = kMissing, q25 = kMissing, q75 = kMissing;
  statistics::Interval interval;  // of the median
};

// Instances in specification, with Wilson's interval.
struct Share {
  std::size_t in = 0, n = 0;
  double share = kMissing;
  statistics::Interval interval;
};

struct Yield : Share {
  std::optional<Share> uncured;  // the same before curing
};

// Steps and machine seconds until the specification is met; infinite if fewer than half of the instances meet it.
struct TimeToSpec {
  std::size_t successes = 0, n = 0;
  double steps = kMissing, expected = kMissing, seconds = kMissing;
  statistics::Interval interval;  // of the steps
  double cycle = kMissing;        // seconds of the whole cycle (statistics/cycle.h); NaN: the suite states none
};

// One criterion of the specification, or all of them.
struct CriterionScore {
  std::string name;  // "rmse", the column of a criterion, or "all"
  Share share;       // at the end
  TimeToSpec time;
  statistics::Interval seconds;  // of time.seconds
};

struct MtfScores {
  Score centre, corner;
};

// Absolute distance of the recommended pose from the own optimum, in the unit of the axis.
struct ResidualAxis {
  std::string name, unit;
  double median = kMissing, q75 = kMissing, travel = kMissing;
};

// By one recommendation rule; median.n is 0 if not recorded.
struct RuleScore {
  statistics::Band median;
  std::optional<Share> yield;
  double steps = kMissing;  // to specification; infinite if fewer than half of the instances meet it
};

// The score above the instances' own optima after so many images, by each recommendation rule.
struct ExcessAfter {
  unsigned images = 0;
  statistics::ByRule<Score> rules;  // n is 0 if not recorded
};

// A method of the group.
struct Row {
  std::string method, merit, key, training_tag;
  ObservationClass of_class = ObservationClass::unknown;
  std::vector<std::string> observes;  // in this group: without the start if the protocol withholds it
  std::size_t trials = 0, failed = 0;
  unsigned step = 0;  // the last one
  Score recommended, commanded;
  std::array<statistics::Band, statistics::kFinalStatistics.size()> finals;
  std::optional<Score> measured;  // lowest measured error; only without ground truth
  double machine_seconds = kMissing, algorithm_ms_per_step = kMissing;
  std::optional<Yield> yield;
  std::optional<TimeToSpec> to_spec;
  std::vector<CriterionScore> to_specification;  // empty unless criteria are judged after every step
  std::vector<statistics::Band> further;         // the scene's further scores, in its order
  std::optional<MtfScores> mtf;
  std::vector<statistics::CostStudy> costs;  // at the largest budget and at least cost; empty without prices
  std::vector<ResidualAxis> residual;
  std::optional<statistics::ByRule<RuleScore>> rules;
  std::vector<ExcessAfter> excess;  // the last entry: after the largest budget; empty if no own optimum is known

  const Score& score() const { return measured ? *measured : recommended; }  // the error that ranks
  bool has_score() const { return score().n > 0; }
  bool oracle() const { return of_class == ObservationClass::oracle; }
};

// One value per step; NaN if unknown.
struct CurveTrack {
  std::vector<double> median, q25, q75;  // empty: the track is unknown
  std::vector<double> low, high;         // empty: no intervals were computed
};

struct Curve {
  std::string method;
  std::size_t trials = 0;
  unsigned first_step = 0;
  std::array<CurveTrack, statistics::kTracks.size()> tracks;
  std::vector<double> machine_seconds, algorithm_seconds;

  const CurveTrack& track(statistics::Track track) const { return tracks[static_cast<std::size_t>(track)]; }
};

// Runtime ECDF over (instance, target) pairs: the steps at which the share changes.
struct Ecdf {
  std::string method;
  std::vector<std::pair<std::size_t, double>> points;  // step and share
};

// Instances in specification with a, with b, and with one of them alone.
struct PairYields {
  std::size_t n = 0, a = 0, b = 0, a_alone = 0, b_alone = 0;
  double p = kMissing, p_planned = kMissing;
};

// The errors of two methods on the same instances.
struct Difference {
  std::size_t n = 0;
  double ratio = kMissing;  // first / second
  statistics::Interval interval;
  double improvement = kMissing, p = kMissing;
  statistics::Verdict verdict = statistics::Verdict::undecided;
  std::string reason;  // "" if decided
};

// a compared with b.
struct Pair : Difference {
  std::string a, b;
  double p_holm = kMissing;
  bool planned = false;  // one of the analysis plan's contrasts, with p_planned and perhaps yields
  double p_planned = kMissing;
  std::optional<PairYields> yields;
};

// The two methods of a class with the lowest medians by a rule, and their comparison, if there is one.
struct Lead {
  ObservationClass of_class = ObservationClass::unknown;
  std::string best, next;  // next: "" if there is only one
  std::optional<Pair> pair;
};

struct RuleComparison {
  std::vector<Pair> pairs;
  std::vector<Lead> leads;  // one per class except oracles
};

struct Group {
  std::string scene, noise_level, protocol, label;
  std::size_t instances = 0;
  bool same_instances = true;      // all methods have finished the same ones
  bool station = false;            // hardware
  bool measured_only = false;      // no ground truth
  double start = kMissing;         // median error at the start
  double start_excess = kMissing;  // the same above the instances' own optima
  std::vector<Row> rows;           // best first
  std::vector<Curve> curves;
  std::vector<Ecdf> ecdf;
  std::vector<Pair> pairs;
  SceneScore scored_by;
  SceneWords words;
  double own_optimum = kMissing;                     // median score at the instances' own optima
  std::vector<statistics::Band> further_at_optimum;  // medians of the scene's further scores there, no intervals
  double next_image = kMissing;                      // Cramer-Rao bound of one more image
  records::Specification spec;
  Prices prices;
  std::size_t cannot_meet_spec = 0;       // infeasible instances
  std::vector<std::uint64_t> infeasible;  // the first of them
  struct Friedman {
    double p = kMissing;
    std::size_t instances = 0;
  };
  std::optional<Friedman> friedman;
  std::optional<statistics::ByRule<RuleComparison>> rules;  // only with ground truth

  bool is_of(const std::string& of_scene, const std::string& of_level, const std::string& of_protocol) const {
    return scene == of_scene && noise_level == of_level && protocol == of_protocol;
  }
};

}  // namespace relign::report
