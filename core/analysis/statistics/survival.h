// Kaplan-Meier: how many trials are still on their way after so many steps, when some were stopped before they got
// there.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"
#include "statistics/time_to_target.h"

namespace relign::statistics {

struct SurvivalPoint {
  double steps = 0;
  std::size_t at_risk = 0;   // neither there nor stopped before this step
  std::size_t reached = 0;   // at this step
  std::size_t censored = 0;  // at this step, after those that reached it
  double survival = 1;       // share not yet there after this step
  // Greenwood's standard error of it, and the log-log interval (Kalbfleisch and Prentice 1980), which stays inside 0 to
  // 1. Before the first success both ends are 1. At survival 0, where neither exists, the error is missing and the
  // interval ends at the survival before times the exact upper limit of none of those at risk (Clopper and Pearson,
  // Biometrika 26 (1934)): else a hundred trials that are all there at once would have no upper end.
  double standard_error = 0;
  Interval interval;
};

// One point for each step at which something happened, in rising order (Kaplan and Meier, JASA 53 (1958)). Trials that
// were censored at a step count as at risk there. NaN steps do not enter. No trial: no point.
// Censoring must have nothing to do with how well a trial went: use the budget, not the step at which an algorithm gave
// up.
std::vector<SurvivalPoint> kaplan_meier(const std::vector<TargetTime>& trials, double confidence = kConfidence);

// The step by which half of the trials are there: the first with survival at or below 1/2, infinite when that never
// comes. Interval of Brookmeyer and Crowley (Biometrics 38 (1982)): the first steps at which the low and the high end
// of the survival's interval are at or below 1/2, infinite when they never are. n: trials. No trial: all missing.
Band median_steps(const std::vector<SurvivalPoint>& curve);

}  // namespace relign::statistics
