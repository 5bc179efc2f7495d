// Checks that the scenes of a suite offer what its specification requires.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "plugin_host/objects.h"
#include "records/specification.h"
#include "suites/suite.h"
#include "trials/judge.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// Equal keys: the same limits of MTF.
std::string key_of(const trials::Criteria& criteria);

// Throws Error(bad_input) if the scene `name` is judged by another score than the specification limits, cannot reach
// a target above the highest RMSE, or does not offer what the criteria of every step need.
void check_criteria(const suites::Suite& suite, const std::string& name, plugin_host::Scene& scene,
                    const trials::SceneFacts& facts);

// Throws Error(bad_input) if one limit of the suite counts for scores of different names or units. `facts`: of the
// suite's scenes, in its order.
void check_units(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts);

// The MTF of the perfect lens at the nominal pose; nothing when none is required. Throws Error(bad_input) when the
// scene does not offer it, or when only one of the suite's spec and the scene's MTF includes diffraction.
std::optional<plugin_host::MountedAssembly::FieldMtf> check_mtf(const suites::Suite& suite, const std::string& name,
                                                                plugin_host::Scene& scene,
                                                                const trials::SceneFacts& facts);

// One for each MTF of the specification at a frequency that the scene's pixels cannot resolve.
std::vector<std::string> mtf_warnings(const records::Specification& spec, const trials::SceneFacts& facts);

}  // namespace relign::runner
