// How many steps it takes to come down to a target, and what to do with trials that never did.
//
// Steps are those of a track: step 0 is the capture at the start pose, so a start that is good enough took 0 steps.
// Targets are RMSE levels, given beforehand and never taken from the results that are compared.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"
#include "statistics/resampling.h"

namespace relign::statistics {

// One trial and one target: the step at which it was reached or, when it never was, the last step that was watched
// (censored: it would have taken longer, nobody knows how long).
struct TargetTime {
  double steps = 0;
  bool reached = false;
};

// The first step at or below each target. track: one value a step, from step 0; NaN reaches nothing. `watched`: step
// until which a trial counts as watched when it never reaches the target, at least the track's last one: pass the
// budget where a trial that ended early would have carried its last step forward, the track's last step to count only
// the steps that were really made. NaN targets are never reached. Throws Error (internal) for an empty track or a
// `watched` before the track's end.
std::vector<TargetTime> times_to_targets(const std::vector<double>& track, const std::vector<double>& targets,
                                         double watched);

// Expected running time in steps, ERT (Hansen, Auger, Brockhoff, Tusar, Tusar, arXiv 1605.03560): the steps of all
// trials, those that failed included, per success. What one success costs if failed trials are started again.
struct ExpectedSteps {
  std::size_t successes = 0, trials = 0;  // shown with it, always
  // Infinite without any success; missing without any trial.
  double steps = kMissing;
  Interval interval;  // its high end is infinite when more than 2.5 % of the resamples have no success
};
ExpectedSteps expected_steps(const std::vector<TargetTime>& trials);
// With the bootstrap's interval; `trials` in the order of the resampled instances. Throws Error (internal) for another
// number of trials.
ExpectedSteps expected_steps(const std::vector<TargetTime>& trials, const Resampling& resampling,
                             double confidence = kConfidence);

// Share of pairs (instance, target) that were reached by each of the steps `at`: the runtime ECDF of COCO and a data
// profile (Moré and Wild 2009) at once. One value for each of `at`, which need not be sorted; without pairs missing.
std::vector<double> runtime_ecdf(const std::vector<TargetTime>& pairs, const std::vector<double>& at);

}  // namespace relign::statistics
