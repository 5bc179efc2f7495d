// What depends on the recommendation rule, by each rule, and what was planned before the run.
#pragma once

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

// Adds to page_data's data, of the same results, where a noise-free error is known:
//   group.rows[i].rules  {own, best, current: {n, median, lo95, hi95, yield {in, n, share, lo95, hi95}, steps}}: RMSE
//   at
//                        the last recommendation, yield and median steps to specification; n is 0 where the records
//                        lack it
//   group.rules          {own, best, current: {pairs [as group.pairs], leads [{class, best, next, and of the pair n,
//                        ratio, lo95, hi95, verdict}]}}: of each class but oracles the two lowest medians
//   rules_note           whether a verdict depends on the rule, or what is missing to say so
void add_rules(Json& data, const LoadedResults& results, const statistics::Study& study);

// rules_note of data with groups alone.
std::string rules_note(const Json& data);

// "analysis" {primary, rule, contrasts, smallest_relevant_ratio, yield, hash} and "analysis_notes", sentences: whether
// it was changed after the run began, and whether this page is by another rule. Nothing without a plan.
void add_analysis(Json& data, const Json& manifest);

// What a rule recommends: "the pose that the method recommends".
const char* rule_words(const std::string& rule);

}  // namespace relign::report
