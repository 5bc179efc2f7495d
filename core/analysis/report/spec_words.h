// Specifications as text.
#pragma once

#include <string>
#include <vector>

#include "report/page_group.h"

namespace relign::report {

// "RMSE 0.0142, MTF at 20 lp/mm 0.5 in the centre and 0.35 in the corners". Empty without limits.
std::string spec_words(const records::Specification& spec, const SceneScore& score);

// One criterion with its limit: "position 2 um". name: of CriterionScore.
std::string criterion_words(const std::string& name, const records::Specification& spec, const SceneScore& score);

// What a criterion measures, for a tooltip; empty for "rmse" and "all".
std::string criterion_meaning(const std::string& name);

// The common specification of all groups as a sentence; empty if they differ.
std::string spec_sentence(const std::vector<Group>& groups);

// The kind of MTF: "geometric" or "with diffraction".
const char* mtf_kind(const records::Specification& spec);
// The same as a noun: "geometric MTF (no diffraction)" or "MTF with diffraction".
const char* mtf_kind_words(const records::Specification& spec);

}  // namespace relign::report
