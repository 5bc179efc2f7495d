// Paired comparison of two methods, or of a method before and after a change, on the same instances, with optional
// gates.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "statistics/rules.h"

namespace relign::report {

// "FOLDER" (all methods) or "FOLDER:METHOD".
struct ComparedSide {
  std::filesystem::path folder;
  std::string method;  // empty: all
};
// A folder whose name contains the colon takes precedence. Throws Error (io) if neither is a folder.
ComparedSide compared_side(const std::string& text);

// "recommended@20<=1.02x": the error ratio B / A at step 20 is at most 1.02; without the x the limit is of B's median.
// Without "@20": at the last step. rmse is a synonym of recommended.
// "yield>=0.95": B's yield is at least 0.95; "yield>=A-0.02": at most 0.02 below A's.
struct Gate {
  enum class Of { ratio, median, yield, yield_against_a };
  std::string text;
  Of of = Of::ratio;
  statistics::Track track = statistics::Track::recommended;
  int step = -1;  // -1: the last
  double limit = 0;
};
Gate parse_gate(const std::string& text);                // throws Error(bad_input)
statistics::Track parse_track(const std::string& name);  // of --track; throws Error(bad_input)

struct CompareOptions {
  // "recommended", here and in gates, is the track of the rule.
  statistics::Track track = statistics::Track::recommended;
  int step = -1;  // -1: the last common step
  // nullopt: as in the analysis plan if both folders have the same, else own and 1.1.
  std::optional<statistics::Rule> rule;
  std::optional<double> smallest_relevant_ratio;  // 1 or more
  std::vector<Gate> gates;
};

// {"rule", "track", "smallest_relevant_ratio", "pairs": [{scene, noise_level, protocol, a, b, step, n, missing,
// failed_a, failed_b, median_a, median_b, ratio, lo95, hi95, p, improvement, verdict, reason, yield, rules {own, best,
// current: {median_a, median_b, ratio, lo95, hi95, p, verdict, yield}}, differs [names]}], "gates": [{gate, scene,
// noise_level, protocol, a, b, value, holds}], "unmatched": [names], "holds": bool}. Ratios and verdicts are of B
// compared with A. `rules` is present for the track of a rule; a rule without scores in the records is null. `differs`
// lists what differs between methods of the same name: algorithm, parameters, merit. Throws Error: io or bad_input for
// folders; bad_input for different instances, unknown methods, steps beyond the budget, a rule without scores, and
// contradicting analysis plans.
Json compare(const ComparedSide& a, const ComparedSide& b, const CompareOptions& options);

std::string comparison_text(const Json& comparison);

}  // namespace relign::report
