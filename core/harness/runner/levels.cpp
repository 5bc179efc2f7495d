#include "runner/levels.h"

#include "base/error.h"
#include "trials/instance.h"

namespace relign::runner {

void check_levels(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts,
                  const std::function<plugin_host::HostServices(const std::string& name)>& services) {
  std::string mistakes;
  for (const suites::LevelEntry& level : suite.levels)
    for (std::size_t scene = 0; scene < facts.size(); ++scene) {
      const plugin_host::HostServices own = services(level.name);
      try {
        trials::draw_instance(level.choice, level.name, facts[scene], suite.scenes[scene].name, own,
                              suite.draw_seeds().instances, suite.first_instance);
      } catch (const Error& error) {
        if (error.kind() != ErrorKind::bad_input) throw;
        mistakes += (mistakes.empty() ? "" : "\n") + std::string(error.what());
      }
    }
  if (!mistakes.empty()) throw Error(ErrorKind::bad_input, mistakes);
}

}  // namespace relign::runner
