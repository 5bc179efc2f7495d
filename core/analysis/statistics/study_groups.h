// The groups of a study (equal scene, noise level and protocol), before any statistics. Used by study.cpp only.
#pragma once

#include "statistics/study.h"

namespace relign::statistics {

// With their series, instances and own optima.
std::vector<GroupStudy> groups_of(const TrialTable& table);

// Sets group.cannot_meet_spec and group.infeasible; group.spec must be set.
void find_further_at_optimum(const TrialTable& table, GroupStudy& group);
void find_infeasible(const TrialTable& table, GroupStudy& group, Rule rule);

}  // namespace relign::statistics
