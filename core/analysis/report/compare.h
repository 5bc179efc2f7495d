// Paired comparison of two methods, or of a method before and after a change, on the same instances, with optional
// gates.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "report/page_group.h"
#include "statistics/paired_shares.h"

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

struct ComparedMethods {
  std::string scene, noise_level, protocol, a, b;
};

// Of B, compared with A, at one step.
struct ComparedErrors : Difference {
  double median_a = kMissing, median_b = kMissing;
  statistics::PairedShares yield;  // `first` is A; n is 0 if unknown
};

struct ComparedPair : ComparedMethods {
  unsigned step = 0;
  std::size_t missing = 0, failed_a = 0, failed_b = 0;
  ComparedErrors errors;
  // For the track of a rule only; nullopt for a rule without scores in the records.
  std::optional<statistics::ByRule<std::optional<ComparedErrors>>> rules;
  std::vector<std::string> differs;  // of methods of the same name: algorithm, parameters, merit
};

struct GateResult : ComparedMethods {
  std::string gate;
  double value = kMissing;
  bool holds = false;
};

struct Comparison {
  statistics::Rule rule = statistics::Rule::own;
  statistics::Track track = statistics::Track::recommended;
  double smallest_relevant_ratio = 1;
  std::vector<ComparedPair> pairs;
  std::vector<GateResult> gates;
  std::vector<std::string> unmatched;  // methods of A alone
  bool holds = true;                   // all gates do
};

// Throws Error: io or bad_input for
// folders; bad_input for different instances, unknown methods, steps beyond the budget, a rule without scores, and
// contradicting analysis plans.
Comparison compare(const ComparedSide& a, const ComparedSide& b, const CompareOptions& options);

Json to_json(const Comparison& comparison);  // docs/schemas/compare.schema.json
std::string comparison_text(const Comparison& comparison);

}  // namespace relign::report
