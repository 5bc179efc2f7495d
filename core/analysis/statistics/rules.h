// Which pose a method is judged by. A method's own recommendation may be the minimum of a model, the pose of the lowest
// measured error or wherever it stands; who compares methods by their searching alone judges all of them by one rule.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "statistics/tracks.h"

namespace relign::statistics {

// own: what the method recommends; best: the pose of its lowest measured RMSE so far, the first of equal ones; current:
// where it stands. Each at every step, noise-free, where the glue leaves the lens.
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

// Its noise-free RMSE step by step.
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
