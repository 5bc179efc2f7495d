// Scores and comparisons by each recommendation rule, and the analysis plan.
#pragma once

#include <string>
#include <vector>

#include "report/page_model.h"

namespace relign::report {

// Adds the scores of the rows and the comparisons of the group by each rule.
void add_rules(Group& group, const statistics::GroupStudy& found, const statistics::Study& study,
               double smallest_relevant_ratio);

// Whether a verdict, on errors or on yields, depends on the rule, or why this is unknown, as sentences; "" without
// ground truth.
std::string rules_note(const std::vector<Group>& groups, bool by_yield);

// The plan of the manifest for a page by `rule`.
Analysis analysis_of(const records::Manifest& manifest, statistics::Rule rule);

// The pose that a rule scores, as text: "the pose recommended by the method".
const char* rule_text(statistics::Rule rule);

}  // namespace relign::report
