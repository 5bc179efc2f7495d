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

// Modules whose glue cures alike. n values each, in fractions of the travel.
struct ModuleBatch {
  std::uint32_t size = 1;          // modules; instance k belongs to batch k / size
  std::vector<double> cure_shift;  // mean of the batch
  std::vector<double> inspection;  // standard deviation of the errors with which inspection measures a cure shift
};

struct Perturbations {
  std::vector<double> start;       // true start pose, n values in [0, 1]
  std::vector<double> distortion;  // n x n, row-major: true move = distortion * commanded move
  std::string elements_json;       // elements and uncertain quantities as canonical JSON, as mount takes them
  // Shift of the lens while the glue cures, n fractions of the travel; empty: none. Of an instance it includes its
  // batch's mean, as a noise level draws it it does not.
  std::vector<double> cure_shift = {};
  std::optional<StageErrors> stage = {};  // empty: the stage is linear (as in the paper)
  std::optional<ModuleBatch> batch = {};  // empty: cure shifts have no common mean
};

struct Instance {
  std::uint64_t number = 0;
  std::uint64_t seed = 0;
  Perturbations perturbations;
  std::uint64_t suite_seed = 0;  // with domain and number it determines the batch and the modules before this one
  SeedDomain domain = SeedDomain::benchmark;
};

// Draws instance `number`. The mean of its batch is that of the noise level's draw with the batch's seed. Throws
// Error(plugin_failed) when the noise level returns unusable perturbations (wrong sizes, unknown elements, non-finite
// values).
Instance draw_instance(plugin_host::NoiseLevel& level, const SceneFacts& scene, std::uint64_t suite_seed,
                       SeedDomain domain, std::uint64_t number);

// Modules of the batch of `instance` before it: of equal suite seed and domain, with lower numbers.
std::uint32_t earlier_modules(const Instance& instance);
// What inspection measured on the module `back` places before `instance`, 1 to earlier_modules(): its cure shift with
// the errors of inspection, n fractions of the travel. A function of the instances alone, so that it depends neither on
// the method that aligned that module nor on the order of trials: the shift does not depend on the pose at which a lens
// is fixed, and modules that would be scrapped are inspected, too.
std::vector<double> inspected_shift(plugin_host::NoiseLevel& level, const SceneFacts& scene, const Instance& instance,
                                    std::uint32_t back);

// The same as draw_instance above for a noise level and a scene that a user combined, under the names in the user's
// file: when they do not fit (for example, a tolerance file names other elements), throws Error(bad_input) that names
// both.
Instance draw_instance(const plugin_host::Choice& level, const std::string& level_name, const SceneFacts& scene,
                       const std::string& scene_name, const plugin_host::HostServices& services,
                       std::uint64_t suite_seed, std::uint64_t number);

// Reads and checks the JSON that a noise level returned; draw_instance uses it.
Perturbations read_perturbations(const std::string& drawn, const SceneFacts& scene, const std::string& level_id);

// The member "elements" of `top`: offsets with both members of every element, so that equal draws give equal strings,
// and values of uncertain quantities.
Json read_elements(const JsonSource& source, ObjectReader& top, const SceneFacts& scene,
                   std::vector<Problem>& problems);

// Converts offsets from an algorithm or a user ({"L1": {"shift_mm": [x, y, z]}}) to the form that mount takes. Throws
// Error(bad_input) that lists every mistake.
std::string read_offsets(const std::string& offsets_json, const SceneFacts& scene);

}  // namespace relign::trials
