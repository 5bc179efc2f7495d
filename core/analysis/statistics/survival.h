// Kaplan-Meier estimate of the share of trials that have not yet reached a target, with censored trials.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"
#include "statistics/time_to_target.h"

namespace relign::statistics {

struct SurvivalPoint {
  double steps = 0;
  std::size_t at_risk = 0;   // neither reached nor censored before this step
  std::size_t reached = 0;   // at this step
  std::size_t censored = 0;  // at this step, after those that reached it
  double survival = 1;       // share not yet reached after this step
  // Greenwood's standard error and the log-log interval (Kalbfleisch and Prentice 1980), which is within [0, 1].
  // Before the first success both ends are 1. At survival 0 neither exists: the error is NaN, and the interval's upper
  // end is the previous survival times the exact upper limit for 0 of those at risk (Clopper and Pearson, Biometrika 26
  // (1934)), so that the interval stays finite if all trials reach the target at the same step.
  double standard_error = 0;
  Interval interval;
};

// One point per step with a success or a censored trial, ascending (Kaplan and Meier, JASA 53 (1958)). Trials censored
// at a step count as at risk there. NaN steps are skipped; empty without trials. Censoring must be independent of the
// outcome: use the budget, not the step at which an algorithm gave up.
std::vector<SurvivalPoint> kaplan_meier(const std::vector<TargetTime>& trials, double confidence = kConfidence);

// Median time: the first step with survival at or below 1/2, infinite if there is none. Interval of Brookmeyer and
// Crowley (Biometrics 38 (1982)): the first steps at which the lower and the upper end of the survival's interval are
// at or below 1/2, infinite if there are none. n: trials. All NaN without trials.
Band median_steps(const std::vector<SurvivalPoint>& curve);

}  // namespace relign::statistics
