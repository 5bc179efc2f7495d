// Instances: one draw of the variances W, the same for every algorithm.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/seeds.h"
#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::trials {

struct Variances {
  std::vector<double> start;       // true start pose, n values in [0, 1]
  std::vector<double> distortion;  // n x n, row-major: true move = distortion * commanded move
  std::string elements_json;       // offsets of the elements, canonical JSON, as for mount
  // How the glued lens moves while the glue cures, n shares of the travel; empty: not at all.
  std::vector<double> cure_shift = {};
};

struct Instance {
  std::uint64_t number = 0;
  std::uint64_t seed = 0;
  Variances variances;
};

// Draws instance `number`. Throws Error(plugin_failed) when the level writes something unusable
// (wrong sizes, unknown elements, values that are not finite).
Instance draw_instance(plugin_host::NoiseLevel& level, const SceneFacts& scene, std::uint64_t suite_seed,
                       SeedDomain domain, std::uint64_t number);

// The same for a level and a scene that a user put together, by the names that the user knows: what goes wrong between
// them (a file of limits that names other elements, say) is the user's mistake, an Error(bad_input) that names both.
Instance draw_instance(const plugin_host::Choice& level, const std::string& level_name, const SceneFacts& scene,
                       const std::string& scene_name, const plugin_host::HostServices& services,
                       std::uint64_t suite_seed, std::uint64_t number);

// Reads and checks what a level wrote; draw_instance uses it.
Variances read_variances(const std::string& drawn, const SceneFacts& scene, const std::string& level_id);

// Offsets as an algorithm or a user gives them ({"L1": {"shift_mm": [x, y, z]}}), in the form that mount takes. Throws
// Error(bad_input) that lists every mistake.
std::string read_offsets(const std::string& offsets_json, const SceneFacts& scene);

}  // namespace relign::trials
