// Which instances meet the specification, per method: the input of paired yield comparisons.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "records/specification.h"
#include "statistics/paired_shares.h"
#include "statistics/trial_table.h"

namespace relign::statistics {

using Passes = std::map<std::uint64_t, bool>;  // by instance; empty if unknown

// For each of `series` (indices into TrialTable::series), at the last recommendation by the rule. A failed trial does
// not pass. Empty without a specification, or if no record has the noise-free score or the MTF that it limits.
std::vector<Passes> passes_of(const TrialTable& table, const std::vector<std::size_t>& series,
                              const records::Specification& spec, Rule rule);

// On the instances of both; n is 0 if either is empty.
PairedShares compare_passes(const Passes& first, const Passes& second);

}  // namespace relign::statistics
