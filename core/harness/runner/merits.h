// Merits of a suite's entries: their limits, and whether the scenes allow them.
#pragma once

#include <vector>

#include "records/specification.h"
#include "suites/suite.h"
#include "trials/protocol.h"
#include "trials/scene_facts.h"

namespace relign::runner {

trials::MtfLimits limits_of(const records::Specification& spec);

// Throws Error(bad_input) that lists every entry whose merit a scene does not allow. One entry of `facts` per scene of
// the suite.
void check_merits(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts);

}  // namespace relign::runner
