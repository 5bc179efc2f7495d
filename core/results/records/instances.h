// Whether an instance's number means the same lens in two results folders, by their manifests; and if not, by what.
#pragma once

#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign::records {

// "seed: 1 in a, 2 in b" for every member of `keys` that differs.
std::vector<std::string> differing(const Json& a, const Json& b, const std::vector<const char*>& keys,
                                   const std::string& in_a, const std::string& in_b);

// Of scenes and noise levels under equal names, those that are not the same; where `all` is set, those too that one
// of the two lacks. Sentences.
std::vector<std::string> different_scenes_and_levels(const Json& a, const Json& b, bool all, const std::string& in_a,
                                                     const std::string& in_b);

// Why lenses of equal numbers are not the same in both; empty when they are, however many each has.
std::vector<std::string> different_lenses(const Json& a, const Json& b, const std::string& in_a,
                                          const std::string& in_b);

}  // namespace relign::records
