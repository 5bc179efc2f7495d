#include "runner/levels.h"

#include <relign/plugin.h>

#include <algorithm>
#include <set>

#include "base/error.h"
#include "trials/instance.h"

namespace relign::runner {

static bool uses_history(const plugin_host::Choice& choice) {
  return (choice.plugin->observed_bits() & RELIGN_OBSERVES_HISTORY) != 0 ||
         std::any_of(choice.algorithms.begin(), choice.algorithms.end(),
                     [](const auto& inner) { return uses_history(*inner.second); });
}

std::vector<std::string> check_levels(
    const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts,
    const std::function<plugin_host::HostServices(const std::string& name)>& services) {
  std::string mistakes;
  std::vector<std::string> notes;
  for (const suites::LevelEntry& level : suite.levels) {
    bool batches = false;
    for (std::size_t scene = 0; scene < facts.size(); ++scene) {
      const plugin_host::HostServices own = services(level.name);
      try {
        const trials::Instance drawn =
            trials::draw_instance(level.choice, level.name, facts[scene], suite.scenes[scene].name, own,
                                  suite.draw_seeds().instances, suite.first_instance);
        batches = batches || drawn.perturbations.batch.has_value();
      } catch (const Error& error) {
        if (error.kind() != ErrorKind::bad_input) throw;
        mistakes += (mistakes.empty() ? "" : "\n") + std::string(error.what());
      }
    }
    if (batches) continue;
    std::set<std::string> named;  // one entry per protocol
    for (const suites::AlgorithmEntry& algorithm : suite.algorithms)
      if (uses_history(algorithm.choice) && named.insert(algorithm.name).second)
        notes.push_back("'" + algorithm.name + "' has no effect of its own at the noise level '" + level.name +
                        "', whose modules have no history: it has no 'batch'");
  }
  if (!mistakes.empty()) throw Error(ErrorKind::bad_input, mistakes);
  return notes;
}

}  // namespace relign::runner
