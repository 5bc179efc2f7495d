// Everything that statistics say of a results folder: curves with bands, arrivals at targets and specification,
// residual misalignment, and who is better than whom. docs/statistics.md tells what each number means.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "records/specification.h"
#include "statistics/aggregate.h"
#include "statistics/curves.h"
#include "statistics/normalised_error.h"
#include "statistics/paired.h"
#include "statistics/paired_shares.h"
#include "statistics/ranks.h"
#include "statistics/rules.h"
#include "statistics/time_to_target.h"

namespace relign::statistics {

// Bands are computed for so many steps of a curve, spread by their logarithm; larger results get fewer resamples, and
// bands for the recommended pose alone.
inline constexpr std::size_t kBandSteps = 16;
inline constexpr std::size_t kManyTrials = 10'000;
inline constexpr std::size_t kResamplesOfMany = 1'000;
// Every pair is compared up to so many methods; of more, the best one with each other, and the best of a class with
// each of its class.
inline constexpr std::size_t kMostComparedMethods = 12;
// On fewer instances no test can come below 5 %, and every comparison is undecided.
inline constexpr std::size_t kFewestCompared = 6;

struct StudyOptions {
  std::uint64_t seed = 0;  // of the bootstrap
  std::size_t resamples = kResamples;
  std::vector<double> targets;  // RMSE at the recommended pose
  records::Specification spec;  // for scenes that `spec_of_scene` does not name
  std::map<std::string, records::Specification> spec_of_scene;
  double smallest_relevant_ratio = 1.1;  // of RMSE: methods within it are practically equal
  Rule rule = Rule::own;                 // which pose counts as recommended
  // Pairs of names that were chosen before the run; a group without one of the two has no such pair.
  std::vector<std::pair<std::string, std::string>> contrasts;
  // By name and protocol, what a method observes: the best of a class is compared with each of its class, however many
  // methods there are. Methods that are not named here are no class.
  std::map<std::pair<std::string, std::string>, std::string> classes;
  std::size_t most_bytes = kCurveBytes;  // of all threads together
  unsigned threads = 0;                  // 0: one a core. The numbers do not depend on it
};
// 31 levels from 0.05 down to 0.0005, equally far apart on a logarithmic scale.
std::vector<double> default_targets();
// The steps that get bands: 0, the last, and between them up to kBandSteps in all.
std::vector<unsigned> band_steps(unsigned last);

// What depends on the rule and is shown for all of them.
struct RuleScore {
  Band median;  // of RMSE at the last recommendation; n is 0 where no trial has one
  std::size_t in_spec = 0;
  Band yield;
  Band steps_to_spec;
};

struct SeriesStudy {
  Curve curve;
  ByRule<RuleScore> rules;
  // All that follows is by StudyOptions::rule. RMSE at the last step.
  Band recommended_median, recommended_iqm, commanded_median;
  // Noise-free at the last recommendation against the specification.
  std::size_t in_spec = 0;
  Band yield;
  // The same before the glue cures, among the trials that tell it; yield_uncured.n is 0 where glue shifts nothing.
  std::size_t in_spec_uncured = 0;
  Band yield_uncured;
  Quantiles mtf_centre, mtf_corner;  // at the last recommendation, as glued; n is 0 where nobody asked
  // Of RMSE step by step; a trial whose MTF misses at its end never got there. Without a limit of RMSE there are none.
  ExpectedSteps expected_to_spec;
  Band steps_to_spec, seconds_to_spec;  // median by Kaplan and Meier; infinite when half of the lenses never get there
  // By each step of the curve, the share of (lens, target) pairs that are reached.
  std::vector<double> targets_reached;
  std::vector<Quantiles> residual;  // per axis, a share of the travel, without sign
};

// A method over all strata (scene x noise level) of a protocol. docs/statistics.md, "One number for a suite".
struct AggregateMethod {
  std::string name;                    // shown: of a list of trainings the list's
  std::vector<std::size_t> series;     // of Study::series; every stratum's and training's
  std::vector<std::string> trainings;  // names; empty where the suite names none
  std::size_t strata = 0;              // in which it has a result; less than all: it has no bands
  std::size_t failed = 0;              // trials, which count as an error of 1
  unsigned steps = 0;                  // the largest budget
  AggregateBands bands;
  std::vector<double> by_step;           // the gap after each step, from step 0
  std::vector<AggregateMethod> members;  // of a list its trainings, each by itself
};

struct AggregateStudy {
  std::string protocol;
  std::vector<std::size_t> strata;       // of Study::groups: those whose truth is known
  std::vector<AggregateMethod> methods;  // lowest interquartile mean first; those that lack a stratum last
  std::vector<Improvement> pairs;        // of methods, as PairStudy's
};

struct PairStudy {
  std::size_t first = 0, second = 0;  // of Study::series; the better median first
  PairedComparison comparison;        // logarithms of RMSE at the last recommendation
  double corrected_p = kMissing;      // Holm, over the group's pairs
  PairedShares yields;                // n is 0 where there is no specification, or nobody knows
  bool planned = false;               // one of StudyOptions::contrasts
  // Holm, over the group's planned pairs alone: of `comparison` and of `yields`.
  double planned_p = kMissing, planned_yield_p = kMissing;
};

struct GroupStudy {
  std::string scene, noise_level, protocol;
  std::vector<std::size_t> series;  // of Study::series
  std::vector<std::uint64_t> instances;
  Quantiles own_optimum;  // RMSE at the lenses' own best poses
  records::Specification spec;
  // Lenses whose own best pose (of RMSE) is not in spec; where MTF counts, and no method's last recommendation either.
  std::size_t cannot_meet_spec = 0;
  std::vector<std::uint64_t> hopeless;  // some of them
  Friedman friedman;
  std::vector<PairStudy> pairs;
  ByRule<std::vector<PairStudy>> pairs_by_rule;
};

struct Study {
  std::vector<SeriesStudy> series;         // in the order of TrialTable::series
  std::vector<GroupStudy> groups;          // in order of first appearance
  std::vector<AggregateStudy> aggregates;  // one a protocol that has strata, in order of first appearance
  std::size_t resamples = 0;
  Rule rule = Rule::own;
};

// Throws Error as make_curves does.
Study make_study(const TrialTable& table, StudyOptions options);

}  // namespace relign::statistics
