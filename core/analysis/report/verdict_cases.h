// Verdict sentences on two methods compared on the same instances, from one table of cases.
#pragma once

#include <string>

#include "report/page_group.h"

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

// smallest_relevant_ratio is at least 1.
VerdictCase case_of(const Difference& difference, double smallest_relevant_ratio);

// Why the comparison is undecided, without a full stop; empty if it is decided.
std::string undecided_reason(const Difference& difference, double smallest_relevant_ratio);

// The sentence of the case, without a full stop: "A is better: FIGURES".
std::string verdict_sentence(const Pair& pair, double smallest_relevant_ratio);

// The comparison of b with a, from that of a with b: verdict, ratio and interval.
Pair turned(Pair pair);

// The comparison of first with second, turned if necessary; nullopt without one.
std::optional<Pair> find_pair(const std::vector<Pair>& pairs, const std::string& first, const std::string& second);

}  // namespace relign::report
