// Instances: one draw of the perturbations W, the same for every algorithm.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/seeds.h"
#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// Errors of a stage beyond the distortion, in fractions of the travel, n values each.
struct StageErrors {
  std::vector<double> backlash;       // full width of the play
  std::vector<double> repeatability;  // standard deviation of the position after a move
  std::vector<double> encoder_step;   // commanded moves from the start are rounded to multiples of it; 0: not rounded
  std::vector<double> drift;          // signed; reached after infinite time
  double drift_seconds = 1;           // time constant of the drift: drift * (1 - exp(-t / drift_seconds))
};

struct Perturbations {
  std::vector<double> start;       // true start pose, n values in [0, 1]
  std::vector<double> distortion;  // n x n, row-major: true move = distortion * commanded move
  std::string elements_json;       // offsets of the elements as canonical JSON, as mount takes them
  // Shift of the lens while the glue cures, n fractions of the travel; empty: none.
  std::vector<double> cure_shift = {};
  std::optional<StageErrors> stage = {};  // empty: the stage is linear (as in the paper)
};

struct Instance {
  std::uint64_t number = 0;
  std::uint64_t seed = 0;
  Perturbations perturbations;
};

// Draws instance `number`. Throws Error(plugin_failed) when the noise level returns unusable perturbations
// (wrong sizes, unknown elements, non-finite values).
Instance draw_instance(plugin_host::NoiseLevel& level, const SceneFacts& scene, std::uint64_t suite_seed,
                       SeedDomain domain, std::uint64_t number);

// The same for a noise level and a scene that a user combined, under the names in the user's file: when they do not fit
// (for example, a tolerance file names other elements), throws Error(bad_input) that names both.
Instance draw_instance(const plugin_host::Choice& level, const std::string& level_name, const SceneFacts& scene,
                       const std::string& scene_name, const plugin_host::HostServices& services,
                       std::uint64_t suite_seed, std::uint64_t number);

// Reads and checks the JSON that a noise level returned; draw_instance uses it.
Perturbations read_perturbations(const std::string& drawn, const SceneFacts& scene, const std::string& level_id);

// Converts offsets from an algorithm or a user ({"L1": {"shift_mm": [x, y, z]}}) to the form that mount takes. Throws
// Error(bad_input) that lists every mistake.
std::string read_offsets(const std::string& offsets_json, const SceneFacts& scene);

}  // namespace relign::trials
