// Normalised error: a trial's error on a scale common to all scenes and noise levels, so that trials can be pooled.
//
// With the excess error x (excess.h), the excess error x_start at the start pose, and the resolution r of the scene's
// score, 1e-4 for the RMSE,
//
//   e = clamp(log(max(x, r) / r) / log(x_start / r), 0, 1)
//
// 0: as good as the instance allows, within r. 1: no better than the start. The scale is logarithmic: e is the share of
// the decades between start and resolution that remain, and equally the share of log-uniform targets in that range that
// are missed (the anytime view of COCO, Hansen et al., Optimization Methods and Software 36 (2021)). 1 - e is a score
// as rliable expects it (Agarwal et al., NeurIPS 2021). Both references belong to the instance, so that e does not
// depend on the other methods of a study.
#pragma once

#include <vector>

#include "base/scene_score.h"
#include "records/step_numbers.h"
#include "statistics/rules.h"

namespace relign::statistics {

// NaN if either excess is NaN, or if the start is within the resolution, where nothing can be measured.
double normalised_error(double excess, double start_excess, double resolution);

// One per step, at the pose given by the rule (rules.h). The start is the commanded pose of step 0; without that step
// all values are NaN. Empty without steps.
std::vector<double> normalised_errors(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Rule rule,
                                      const SceneScore& score);

// Area under the error curve: the mean of the normalised errors over steps 1 to `budget`, with the last one carried
// forward. NaN for empty errors or budget 0.
double area_under(const std::vector<double>& errors, unsigned budget);

}  // namespace relign::statistics
