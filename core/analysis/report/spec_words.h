// Specifications as text.
#pragma once

#include <string>

#include "report/page_data.h"

namespace relign::report {

// The specification of a group: "RMSE 0.0142, MTF at 20 lp/mm 0.5 in the centre and 0.35 in the corners". Empty without
// one.
std::string spec_words(const Json& group);

// The common specification of all groups as a sentence; empty if they differ.
std::string spec_sentence(const Json& groups);

// The kind of MTF of a group: "geometric" or "with diffraction".
std::string mtf_kind(const Json& group);
// Whether the specification of a group limits the MTF, rather than only measuring it.
bool judges_mtf(const Json& group);

}  // namespace relign::report
