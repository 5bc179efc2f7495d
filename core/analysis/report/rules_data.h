// Scores and comparisons by each recommendation rule, and the analysis plan.
#pragma once

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

// Adds to page_data's data of the same results, where noise-free errors are known:
//   group.rows[i].rules  {own, best, current: {n, median, lo95, hi95, yield {in, n, share, lo95, hi95}, steps}}: RMSE
//                        at the last recommendation, yield and median steps to specification; n is 0 if not recorded
//   group.rules          {own, best, current: {pairs [as group.pairs], leads [{class, best, next, and of the pair n,
//                        ratio, lo95, hi95, verdict}]}}: the two lowest medians of each class except oracles
//   rules_note           a sentence: whether a verdict depends on the rule, or why this is unknown
void add_rules(Json& data, const LoadedResults& results, const statistics::Study& study);

// rules_note from data["groups"].
std::string rules_note(const Json& data);

// Adds "analysis" {primary, rule, contrasts, smallest_relevant_ratio, yield, hash} and "analysis_notes", sentences:
// plan changed after the run began, page by another rule than the plan's. Nothing without a plan.
void add_analysis(Json& data, const Json& manifest);

// The pose that a rule scores, as text: "the pose recommended by the method".
const char* rule_text(const std::string& rule);

}  // namespace relign::report
