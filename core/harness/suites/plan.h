// A plan: the frozen list of trials made from a suite. Trial ids are stable: the same trial has
// the same id on every machine and in every suite that contains it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "suites/suite.h"

namespace relign::suites {

struct PlannedTrial {
  std::string id;             // 16 hex digits: hash of everything that decides the result (see design, "Running")
  std::size_t scene = 0;      // index into Suite::scenes
  std::size_t level = 0;      // index into Suite::levels
  std::size_t algorithm = 0;  // index into Suite::algorithms
  std::uint64_t instance = 0;
};

// The entry's merit, or its protocol's own: paper "combined", blind "rmse".
std::string effective_merit(const AlgorithmEntry& algorithm);

// Whether it is given more than its protocol grants: a method that needs the true start pose, where it is blind.
bool is_oracle(const AlgorithmEntry& algorithm);

struct Plan {
  Suite suite;
  std::vector<PlannedTrial> trials;  // order: scene, level, algorithm, instance
  std::string instance_set;          // hash of scenes, levels, seed and numbers: equal = comparable
};

// scene_identity[i]: what identifies scene i beyond its Choice (hashes of the data files its
// description names); the caller knows scenes, this room does not.
// Throws Error(internal) when there is not one identity per scene.
Plan make_plan(Suite suite, const std::vector<std::string>& scene_identity);

}  // namespace relign::suites
