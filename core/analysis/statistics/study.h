// The full statistical analysis of a results folder: convergence curves with bands, times to targets and to
// specification, yield, residual misalignment, pairwise comparisons and aggregates. docs/statistics.md defines each
// number.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "records/specification.h"
#include "statistics/aggregate.h"
#include "statistics/costs.h"
#include "statistics/curves.h"
#include "statistics/cycle.h"
#include "statistics/excess.h"
#include "statistics/normalised_error.h"
#include "statistics/order_statistic.h"
#include "statistics/paired.h"
#include "statistics/paired_shares.h"
#include "statistics/ranks.h"
#include "statistics/rules.h"
#include "statistics/time_to_target.h"

namespace relign::statistics {

// Bands are computed at kBandSteps steps of a curve, spaced logarithmically. Folders with more than kManyTrials trials
// get kResamplesOfMany resamples and bands for the recommended pose only.
inline constexpr std::size_t kBandSteps = 16;
inline constexpr std::size_t kManyTrials = 10'000;
inline constexpr std::size_t kResamplesOfMany = 1'000;
// Up to this many methods all pairs are compared; beyond it the best method with every other, and the best of each
// observation class with the others of its class.
inline constexpr std::size_t kMaxComparedMethods = 12;
// With fewer common instances no test can reach p < 0.05, and the comparison is undecided.
inline constexpr std::size_t kMinCompared = 6;

struct StudyOptions {
  std::uint64_t seed = 0;  // of the bootstrap
  std::size_t resamples = kResamples;
  std::vector<double> targets;  // score at the recommended pose
  records::Specification spec;  // of scenes without an entry in spec_of_scene
  std::map<std::string, records::Specification> spec_of_scene;
  Cycle cycle;
  Prices prices;
  double smallest_relevant_ratio = 1.1;  // of scores: methods within it are practically equal; >= 1
  Rule rule = Rule::own;                 // which pose counts as recommended
  // Planned contrasts: pairs of method names, chosen before the run. Skipped in groups that lack one of the two.
  std::vector<std::pair<std::string, std::string>> contrasts;
  // By method name and protocol: its observation class. The best method of a class is compared with all others of the
  // class, regardless of kMaxComparedMethods. Methods without an entry belong to no class.
  std::map<std::pair<std::string, std::string>, std::string> classes;
  // Name of the method with which the aggregates compare every other, regardless of kMaxComparedMethods, besides the
  // best of its class; nullopt: without these comparisons.
  std::optional<std::string> baseline;
  std::size_t most_bytes = kCurveBytes;  // limit for all threads together
  unsigned threads = 0;                  // 0: one per core. Results do not depend on it
};
// 31 levels from 0.05 down to 0.0005, equally spaced on a logarithmic scale.
std::vector<double> default_targets(double resolution = SceneScore().resolution);
// The steps with bands: 0, `last` and others between, at most kBandSteps in total.
std::vector<unsigned> band_steps(unsigned last);

// Scores that are reported for every recommendation rule.
struct RuleScore {
  Band median;  // score at the last recommendation; n is 0 if no trial has one
  std::size_t in_spec = 0;
  Band yield;
  Band steps_to_spec;
};

// One criterion of a specification that is judged after every step, the score, or all of them together.
struct ArrivalStudy {
  std::string name;         // column of a criterion, "rmse" or "all"
  std::size_t in_spec = 0;  // at the last recommendation
  Band share;               // of all trials; failed ones miss
  ExpectedSteps expected;   // steps to the first recommendation that meets it
  Band steps, seconds;      // Kaplan-Meier medians
};

struct SeriesStudy {
  Curve curve;
  ByRule<RuleScore> rules;
  // At excess_images() of the largest budget; empty if no excess is known. With more than kManyTrials trials in the
  // folder only StudyOptions::rule has intervals.
  std::vector<ExcessAfter> excess;
  // All following members use StudyOptions::rule. Score at the last step:
  Band recommended_median, commanded_median;
  std::array<Band, kFinalStatistics.size()> finals;
  // Instances whose last recommendation meets the specification, noise-free.
  std::size_t in_spec = 0;
  Band yield;
  // The same before the adhesive cures, over trials that record it; yield_uncured.n is 0 without a cure shift.
  std::size_t in_spec_uncured = 0;
  Band yield_uncured;
  Quantiles mtf_centre, mtf_corner;  // at the last recommendation after curing; n is 0 if not measured
  // Time to specification by score at each step; a trial whose MTF misses at its end counts as not reached. NaN if the
  // specification does not limit it.
  ExpectedSteps expected_to_spec;
  Band cycle_to_spec;                   // seconds of a whole cycle (cycle.h); NaN if StudyOptions::cycle states none
  Band steps_to_spec, seconds_to_spec;  // Kaplan-Meier medians; infinite if fewer than half of the instances reach it
  // The same for each criterion and, last, for all of them; empty unless the specification has criteria that are judged
  // after every step and the rule is `own`. The members above are then those of "all".
  std::vector<ArrivalStudy> to_specification;
  std::vector<Band> further;  // medians of the scene's further scores at the own last recommendation, in its order
  // With a specification and stated prices, by the own rule only: at the largest budget, then at the number of steps of
  // least cost, which is the budget again if the number chosen on the other half does not cost less. The latter is left
  // out if the specification limits MTF in corners, which is known at the end only. Savings are against the same one of
  // the baseline.
  std::vector<CostStudy> costs;
  // Runtime ECDF: share of (instance, target) pairs reached by each step of the curve.
  std::vector<double> targets_reached;
  std::vector<Quantiles> residual;  // per axis: distance to the own optimum, share of the travel
};

// A method over all strata (scene x noise level) of a protocol (docs/statistics.md).
struct AggregateMethod {
  std::string name;                    // as displayed, without the training
  std::vector<std::size_t> series;     // indices into Study::series, of all strata and trainings
  std::vector<std::string> trainings;  // names; empty if the suite lists none
  std::size_t strata = 0;              // with a result; bands need all of them
  std::size_t failed = 0;              // trials; each counts as error 1
  unsigned steps = 0;                  // the largest budget
  AggregateBands bands;
  std::vector<double> by_step;           // optimality gap after each step, from step 0
  std::vector<AggregateMethod> members;  // the trainings, each on its own
};

struct AggregateStudy {
  std::string protocol;
  std::vector<std::size_t> strata;       // indices into Study::groups: those with ground truth
  std::vector<AggregateMethod> methods;  // lowest interquartile mean first; those without all strata last
  std::vector<Improvement> pairs;        // indices into methods; the better rank first
};

struct PairStudy {
  std::size_t first = 0, second = 0;  // indices into Study::series; the better median first
  PairedComparison comparison;        // logarithms of the score at the last recommendation
  double corrected_p = kMissing;      // Holm, over the group's pairs
  PairedShares yields;                // n is 0 without a specification, or if unknown
  bool planned = false;               // one of StudyOptions::contrasts
  // p of `comparison` and of `yields` with Holm's correction over the group's planned pairs only.
  double planned_p = kMissing, planned_yield_p = kMissing;
};

struct GroupStudy {
  std::string scene, noise_level, protocol;
  std::vector<std::size_t> series;  // indices into Study::series
  std::vector<std::uint64_t> instances;
  Quantiles own_optimum;                      // score at the instances' own optima
  std::vector<Quantiles> further_at_optimum;  // the scene's further scores there; empty if unknown
  records::Specification spec;
  // Infeasible instances: the own optimum (of the score) misses the specification. If MTF is limited, no method's last
  // recommendation meets it either, since the pose of lowest score need not be the one of highest MTF.
  std::size_t cannot_meet_spec = 0;
  std::vector<std::uint64_t> infeasible;  // the first ones
  Friedman friedman;
  std::vector<PairStudy> pairs;
  ByRule<std::vector<PairStudy>> pairs_by_rule;
};

struct Study {
  std::vector<SeriesStudy> series;         // in the order of TrialTable::series
  std::vector<GroupStudy> groups;          // in order of first appearance
  std::vector<AggregateStudy> aggregates;  // one per protocol with strata, in order of first appearance
  std::size_t resamples = 0;
  Rule rule = Rule::own;
  Prices prices;
};

// Throws Error as records::StoredSteps::read.
Study make_study(const TrialTable& table, StudyOptions options);

}  // namespace relign::statistics
