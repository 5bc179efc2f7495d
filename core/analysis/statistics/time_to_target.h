// Steps to an error target, with censoring for trials that never reach it.
//
// Step 0 is the capture at the start pose, so that a start at or below the target takes 0 steps. Targets are scores
// that are fixed in advance, not derived from the compared results.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"
#include "statistics/resampling.h"

namespace relign::statistics {

// One trial and one target: the step at which it was reached, or the step of censoring if it was not.
struct TargetTime {
  double steps = 0;
  bool reached = false;
};

// The first step at or below each target. track: one value per step, from step 0; NaN reaches no target, and a NaN
// target is never reached. `censored_at`: the time of a trial that does not reach the target, at least the track's last
// step. Pass the budget if a trial that ended early keeps its last value, or the track's last step to count only steps
// that were made. Throws Error (internal) for an empty track or a `censored_at` before its end.
std::vector<TargetTime> times_to_targets(const std::vector<double>& track, const std::vector<double>& targets,
                                         double censored_at);

// Expected running time in steps, ERT (Hansen, Auger, Brockhoff, Tusar, Tusar, arXiv 1605.03560): the steps of all
// trials, unsuccessful ones included, divided by the number of successes: the cost of one success with restarts.
struct ExpectedSteps {
  std::size_t successes = 0, trials = 0;  // report them with the value
  // Infinite without successes, NaN without trials.
  double steps = kMissing;
  Interval interval;  // upper end infinite if more than 2.5 % of the resamples have no success
};
ExpectedSteps expected_steps(const std::vector<TargetTime>& trials);
// With a bootstrap interval; `trials` in the order of the resampled instances. Throws Error (internal) unless there are
// resampling.instances() trials.
ExpectedSteps expected_steps(const std::vector<TargetTime>& trials, const Resampling& resampling,
                             double confidence = kConfidence);

// Share of (instance, target) pairs reached by each of the steps `at`: COCO's runtime ECDF, also known as a data
// profile (Moré and Wild 2009). One value per entry of `at`, which need not be sorted; NaN without pairs.
std::vector<double> runtime_ecdf(const std::vector<TargetTime>& pairs, const std::vector<double>& at);

}  // namespace relign::statistics
