// Checks of noise levels: usable perturbations, and draws that are functions of the seed.
#include <set>

#include "base/error.h"
#include "conformance/checks.h"
#include "conformance/conduct.h"
#include "conformance/progress.h"
#include "conformance/synthetic.h"
#include "plugin_host/objects.h"
#include "trials/instance.h"
#include "trials/scene_facts.h"

namespace relign::conformance {

using plugin_host::Choice;
using plugin_host::NoiseLevel;

Finding check_perturbations(const Subject& subject) {
  for (const Choice& choice : subject.choices) {
    NoiseLevel level(choice, check_services());
    for (const unsigned axes : {5u, 6u}) {
      at("'" + choice.id + "' with " + std::to_string(axes) + " axes");
      const std::string scene = synthetic_scene(axes);
      const trials::SceneFacts facts = trials::read_scene_facts(scene, "synthetic");
      for (std::uint64_t seed = 0; seed < 20; ++seed)
        trials::read_perturbations(level.draw(seed, scene), facts, choice.id);
    }
  }
  return ok();
}

Finding check_same_draw(const Subject& subject) {
  std::string constant;
  for (const Choice& choice : subject.choices) {
    at("'" + choice.id + "'");
    const std::string scene = synthetic_scene(5);
    NoiseLevel level(choice, check_services());
    std::vector<std::string> draws;
    for (std::uint64_t seed = 0; seed < 8; ++seed) draws.push_back(level.draw(seed, scene));
    for (std::uint64_t seed = 8; seed-- > 0;)
      if (level.draw(seed, scene) != draws[seed])
        return failed("'" + choice.id + "' draws differently when called again with seed " + std::to_string(seed) +
                      "; a draw must depend only on its seed");
    NoiseLevel fresh(choice, check_services());
    if (fresh.draw(5, scene) != draws[5])
      return failed("a second object of '" + choice.id + "' draws differently for the same seed");
    if (std::set<std::string>(draws.begin(), draws.end()).size() == 1) constant = choice.id;
  }
  // Only a warning, because a single fixed instance may be intended.
  if (!constant.empty())
    return warning("'" + constant + "' draws the same perturbations for every seed, so that all instances are equal");
  return ok();
}

}  // namespace relign::conformance
