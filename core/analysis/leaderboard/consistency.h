// Whether the parts of an evaluation folder belong together. Only `verify` can check that the numbers are right; this
// finds folders whose parts contradict each other, or from which trials are missing.
#pragma once

#include <string>
#include <vector>

#include "leaderboard/evaluation.h"
#include "report/loaded_results.h"

namespace relign::leaderboard {

// Sentences without full stop; empty if there is none. `results`: of evaluation.results_folder().
std::vector<std::string> contradictions(const Evaluation& evaluation, const Submission& submission,
                                        const report::LoadedResults& results);

}  // namespace relign::leaderboard
