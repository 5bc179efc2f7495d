// Verdict sentences on two methods compared on the same instances, from one table of cases.
#pragma once

#include <string>

#include "base/json_source.h"

namespace relign::report {

enum class VerdictCase {
  better,
  worse,
  practically_equal,
  too_few_instances,  // fewer than statistics::kMinCompared in common
  no_interval,
  may_be_better,  // the interval crosses the limit below which the first is better
  may_be_worse,   // the interval crosses the limit above which the first is worse
  may_be_either   // the interval crosses both
};

// Of a pair {n, lo95, hi95, verdict}, where the interval is of the error ratio first / second. smallest_relevant_ratio
// is at least 1.
VerdictCase case_of(const Json& pair, double smallest_relevant_ratio);

// Why the comparison is undecided, without a full stop; empty if it is decided.
std::string undecided_reason(const Json& pair, double smallest_relevant_ratio);

// The sentence of the case, without a full stop: "A is better: FIGURES". `pair` also needs a and b, the names of the
// two, and ratio.
std::string verdict_sentence(const Json& pair, double smallest_relevant_ratio);

// The pair with a and b exchanged.
Json turned(const Json& pair);

}  // namespace relign::report
