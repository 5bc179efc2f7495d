// Criteria of a specification that are judged after every step: from the files' form into that of trials, and whether
// the scenes allow them.
#pragma once

#include <string>

#include "plugin_host/objects.h"
#include "records/specification.h"
#include "suites/suite.h"
#include "trials/criteria.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// Throws Error(bad_input) for a field that the scene does not have.
trials::Criteria criteria_of(const records::Specification& spec, const trials::SceneFacts& scene);

// Equal keys: the same limits of MTF.
std::string key_of(const trials::Criteria& criteria);

// Appends the values of one step for those criteria that are limited.
void add(const trials::Judgement& judged, const trials::Criteria& criteria,
         records::ByCriterion<std::vector<double>>& values);

// Throws Error(bad_input) if the scene `name` does not offer what the criteria need.
void check_criteria(const suites::Suite& suite, const std::string& name, plugin_host::Scene& scene,
                    const trials::SceneFacts& facts);

}  // namespace relign::runner
