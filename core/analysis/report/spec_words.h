// A specification in words, wherever the page names it.
#pragma once

#include <string>

#include "report/page_data.h"

namespace relign::report {

// What counts as good enough in a group: "RMSE 0.0142, MTF at 20 lp/mm 0.5 in the centre and 0.35 in the corners".
// Empty where nothing does.
std::string spec_words(const Json& group);

// The same for the head of the page: one sentence where all groups have the same, else empty.
std::string spec_sentence(const Json& groups);

// How the MTF of a group is meant: "by geometry" or "with diffraction".
std::string mtf_kind(const Json& group);
// Whether the specification of a group has a limit of MTF; one that is measured alone decides nothing.
bool judges_mtf(const Json& group);

}  // namespace relign::report
