// A plan: the list of trials made from a suite. Trial ids are stable: the same trial has the same id on every machine
// and in every suite that contains it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "suites/suite.h"

namespace relign::suites {

struct PlannedTrial {
  std::string id;             // 16 hex digits: hash of everything that determines the result (plan.cpp)
  std::size_t scene = 0;      // index into Suite::scenes
  std::size_t level = 0;      // index into Suite::levels
  std::size_t algorithm = 0;  // index into Suite::algorithms
  std::uint64_t instance = 0;
};

// An identity is canonical JSON; any other text (from a test or another host) counts as a string.
Json identity_json(const std::string& identity);

// The entry's merit, or the default of its protocol: paper "combined", blind "rmse".
std::string effective_merit(const AlgorithmEntry& algorithm);

// Whether the algorithm observes more than its protocol allows: one that requires the true start, under "blind".
bool is_oracle(const AlgorithmEntry& algorithm);

struct Plan {
  Suite suite;
  std::vector<PlannedTrial> trials;  // order: scene, level, algorithm, instance
  std::string instance_set;          // hash of scenes, levels, seed and numbers; results with equal sets are comparable
};

// scene_identity[i]: identity of scene i in addition to its Choice (hashes of the data files that its description
// names); from the caller, because this module does not load scenes.
// Throws Error(internal) unless there is one identity per scene, and Error(stopped) when *stop becomes true.
Plan make_plan(Suite suite, const std::vector<std::string>& scene_identity, const std::atomic<bool>* stop = nullptr);

}  // namespace relign::suites
