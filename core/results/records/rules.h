// Dimensions of the scores of a trial: the recommendation rule, and the time before and after the glue cures.
//
// Methods choose their own recommendation differently (the minimum of a model, the pose with the lowest measured error,
// the current pose); scoring all of them by one rule compares their search alone.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "base/by.h"

namespace relign::records {

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
template <class Value>
using ByRule = By<Rule, kRules.size(), Value>;

enum class Curing { after, before };
inline constexpr std::array<Curing, 2> kCuring = {Curing::after, Curing::before};
template <class Value>
using ByCuring = By<Curing, kCuring.size(), Value>;

}  // namespace relign::records
