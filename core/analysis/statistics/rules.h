// Recommendation rules: which pose of a method is scored. Methods choose their own recommendation differently (the
// minimum of a model, the pose with the lowest measured error, the current pose); scoring all of them by one rule
// compares their search alone.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "statistics/tracks.h"

namespace relign::statistics {

// own: the method's recommendation; best: the pose with its lowest measured RMSE so far, the first of equal ones;
// current: its current pose. Each is scored at every step, noise-free, after the adhesive has cured.
enum class Rule { own, best, current };
inline constexpr std::array<Rule, 3> kRules = {Rule::own, Rule::best, Rule::current};
inline const char* rule_name(Rule rule) {
  return rule == Rule::best ? "best" : rule == Rule::current ? "current" : "own";
}
inline std::optional<Rule> rule_named(const std::string& name) {
  for (const Rule rule : kRules)
    if (name == rule_name(rule)) return rule;
  return std::nullopt;
}

// The noise-free RMSE by the rule, per step.
inline Track track_of(Rule rule) {
  return rule == Rule::best      ? Track::recommended_best
         : rule == Rule::current ? Track::recommended_current
                                 : Track::recommended;
}

// A value for each rule.
template <class Value>
struct ByRule {
  std::array<Value, kRules.size()> values;
  Value& operator[](Rule rule) { return values[static_cast<std::size_t>(rule)]; }
  const Value& operator[](Rule rule) const { return values[static_cast<std::size_t>(rule)]; }
};

}  // namespace relign::statistics
