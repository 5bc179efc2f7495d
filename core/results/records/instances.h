// Compares the manifests of two results folders: does an instance number mean the same instance in both, and if not,
// what differs?
#pragma once

#include <string>
#include <vector>

#include "records/manifest.h"

namespace relign::records {

// Messages on scenes and noise levels that have equal names but differ; with `all`, also on those that one folder
// lacks.
std::vector<std::string> different_scenes_and_levels(const Manifest& a, const Manifest& b, bool all,
                                                     const std::string& in_a, const std::string& in_b);

// Messages on why instances of equal numbers differ; empty when they are the same, however many each folder has.
std::vector<std::string> different_instances(const Manifest& a, const Manifest& b, const std::string& in_a,
                                             const std::string& in_b);

}  // namespace relign::records
