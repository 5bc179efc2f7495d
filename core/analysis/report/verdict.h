// The verdict as text, and the caveats that belong to it. Intervals and quartiles are named as such, oracles are not
// ranked, and methods are ranked within their observation class.
#pragma once

#include <string>
#include <vector>

#include "report/page_model.h"

namespace relign::report {

// One entry per group.
std::vector<GroupVerdict> verdict(const PageModel& page);

// One sentence for all groups: which method has the lowest error, or the highest yield, by class. "" if nothing can be
// ranked.
std::string headline(const PageModel& page);

// A method, by rank, with those of its class that have a larger error on the same instances.
struct VerdictRow {
  const Row* row = nullptr;
  std::vector<std::string> better_than;
  std::size_t compared = 0;  // methods of its class
};
std::vector<VerdictRow> verdict_rows(const Group& group);

// Caveats that a reader needs before relying on the ranking, as sentences.
std::vector<std::string> caveats(const PageModel& page);

// A sentence if compute times of this folder are unreliable, else empty.
std::string computing_time_note(const RunState& ran);

}  // namespace relign::report
