// What can be said about two methods on the same instances, and why where nothing can: one table of cases.
#pragma once

#include <string>

#include "base/json_source.h"

namespace relign::report {

enum class VerdictCase {
  better,
  worse,
  practically_equal,
  too_few_instances,  // fewer than statistics::kFewestCompared have a result of both
  no_interval,
  may_be_better,  // the interval crosses the limit below which the first is better
  may_be_worse,   // the one above which it is worse
  may_be_either   // both
};

// Of a pair {n, lo95, hi95, verdict} of ratios of the first's errors to the second's; smallest_relevant_ratio is 1 or
// more.
VerdictCase case_of(const Json& pair, double smallest_relevant_ratio);

// Why it is undecided, without a full stop; empty where it is decided.
std::string undecided_reason(const Json& pair, double smallest_relevant_ratio);

// The sentence of the case, without a full stop: "It is better: FIGURES". `pair` needs also ratio; its figures are put
// into words with the name of the second.
std::string verdict_sentence(const Json& pair, const std::string& second, double smallest_relevant_ratio);

// The pair with its sides exchanged.
Json turned(const Json& pair);

}  // namespace relign::report
