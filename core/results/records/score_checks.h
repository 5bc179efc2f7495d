// Whether the numbers of a trial are those that a run can write.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "records/record.h"
#include "records/step_numbers.h"

namespace relign::records {

// What the manifest states of the trial's scene and method.
struct ScoreTerms {
  bool known = true;           // whether the manifest has the scene
  bool has_truth = true;       // so that noise-free errors are due
  bool station = false;        // with a clock and a stage of its own
  bool merit_has_rmse = true;  // as a summand: it is not below the measured RMSE
  bool merit_is_rmse = false;  // and nothing else
  std::size_t axes = 0;
  bool squared = true;       // the score is the RMSE, of pixels from 0 to 1
  double resolution = 1e-4;  // of another score
  double step_seconds = 0;   // that a step takes at least
};

// The first flaw, as the end of a sentence about the trial: "has 'measured' -1 at step 3"; empty: there is none.
std::string flaw_of_scores(const TrialRecord& closing, const std::vector<StepNumbers>& steps, const ScoreTerms& terms);

// The same of the host times: "has 'harness_seconds' -1, ...".
std::string flaw_of_times(const TrialTimes& times);

}  // namespace relign::records
