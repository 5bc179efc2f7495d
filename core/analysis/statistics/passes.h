// Which lenses a method brought into specification, one by one: what yields of two methods are compared by.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "records/specification.h"
#include "statistics/paired_shares.h"
#include "statistics/trial_table.h"

namespace relign::statistics {

using Passes = std::map<std::uint64_t, bool>;  // by instance; empty where it cannot be known

// For each of the series (places in TrialTable::series): at the last recommendation by the rule. A trial that failed is
// a lens that missed.
std::vector<Passes> passes_of(const TrialTable& table, const std::vector<std::size_t>& series,
                              const records::Specification& spec, Rule rule);

// On the lenses that both have; n is 0 where one of them is empty.
PairedShares compare_passes(const Passes& first, const Passes& second);

}  // namespace relign::statistics
