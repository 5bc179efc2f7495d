// The comparable groups of a study before anything is computed of them. Used by study.cpp alone.
#pragma once

#include "statistics/study.h"

namespace relign::statistics {

// One a scene, noise level and protocol, with its series, its instances and their own best poses.
std::vector<GroupStudy> groups_of(const TrialTable& table);

// Lenses that are not in specification even at their own best pose; its specification is there.
void find_hopeless(const TrialTable& table, GroupStudy& group, Rule rule);

}  // namespace relign::statistics
