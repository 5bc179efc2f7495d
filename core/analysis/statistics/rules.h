// The tracks of the recommendation rules (records/rules.h).
#pragma once

#include "records/rules.h"
#include "statistics/tracks.h"

namespace relign::statistics {

using records::ByCuring;
using records::ByRule;
using records::Curing;
using records::kRules;
using records::Rule;
using records::rule_name;
using records::rule_named;

// The noise-free score by the rule, per step.
inline Track track_of(Rule rule) {
  return rule == Rule::best      ? Track::recommended_best
         : rule == Rule::current ? Track::recommended_current
                                 : Track::recommended;
}

}  // namespace relign::statistics
