// The error of a trial on a scale that every scene and noise level shares, so that trials of all of them can be pooled.
//
// x = sqrt(max(0, MSE - MSE of the instance's own optimum)) is the excess error, r = kResolution the smallest error
// that can be told from 0, x_start the excess error at the start pose. The normalised error is
//
//   e = clamp(log(max(x, r) / r) / log(x_start / r), 0, 1)
//
// 0: as good as the instance allows, to within r. 1: no better than the start. On the way there equal steps are equal
// factors of error: e is the share of the decades between start and resolution that are left, which is also the share
// of log-uniform targets between the two that are missed (the anytime view of COCO, Hansen et al., Optimization Methods
// and Software 36 (2021)). 1 - e is a score as rliable expects it (Agarwal et al., NeurIPS 2021), normalised by two
// references of the instance itself; no other method of the study enters.
#pragma once

#include <vector>

#include "records/step_numbers.h"
#include "statistics/rules.h"

namespace relign::statistics {

// Noise-free RMSE below this cannot be told apart: it is as large as the error of the truth.
inline constexpr double kResolution = 1e-4;

// NaN where either excess is NaN, and where the start is within the resolution: nothing is left to be measured there.
double normalised_error(double excess, double start_excess);

// Of each step's pose by the rule (rules.h); the start is the commanded pose of step 0, without which all are NaN. No
// steps: empty.
std::vector<double> normalised_errors(const std::vector<records::StepNumbers>& steps, double own_optimum_mse,
                                      Rule rule = Rule::own);

// Mean of the normalised errors over steps 1 to `budget`, the last one carried forward: the area under the error curve
// as a share of the largest possible one. Empty errors, and no budget: NaN.
double area_under(const std::vector<double>& errors, unsigned budget);

}  // namespace relign::statistics
