// Two algorithms, or one algorithm before and after a change, on the same instances: by how much, how surely, and does
// it pass a limit?
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
// A folder of this very name goes before the reading with a colon. Throws Error(io) when neither is a folder.
ComparedSide compared_side(const std::string& text);

// "recommended@20<=1.02x": the ratio of B to A, the estimate of `compare`, is at most 1.02; without the x B's median
// itself is at most so large. Without "@20": at the last step. rmse is another word for recommended.
// "yield>=0.95": B's yield is at least so large; "yield>=A-0.02": it is at most 0.02 under A's.
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
  // "recommended", of --track and of gates, is the track of the rule.
  statistics::Track track = statistics::Track::recommended;
  int step = -1;  // -1: the last that both have
  // None: the analysis plan's where both folders have the same, else own and 1.1.
  std::optional<statistics::Rule> rule;
  std::optional<double> smallest_relevant_ratio;  // 1 or more
  std::vector<Gate> gates;
};

// {"rule", "track", "step", "pairs": [{scene, noise_level, protocol, a, b, step, n, missing, median_a, median_b, ratio,
// lo95, hi95, p, improvement, verdict, reason, yield, rules {own, best, current: {median_a, median_b, ratio, lo95,
// hi95, p, verdict, yield}}, differs [names]}], "gates": [{gate, scene, noise_level, protocol, b, value, holds}],
// "unmatched": [names], "holds": bool}. B is judged: "better" says that B is. `rules` is there where the track is the
// rule's own; a rule that the records lack is null. `differs` names what is not the same of A and B: algorithm,
// parameters, merit. Throws Error: io or bad_input for folders, different instances, unknown methods, steps that nobody
// made, a rule that the records lack, and plans that differ where nothing is chosen.
Json compare(const ComparedSide& a, const ComparedSide& b, const CompareOptions& options);

std::string comparison_text(const Json& comparison);

}  // namespace relign::report
