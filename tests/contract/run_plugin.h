// Runs a plugin of the tree, for its own test.
#pragma once

#include <string>

#include "contract/fake_trial.h"
#include "plugin_host/objects.h"

namespace relign::test {

// Runs one trial of the plugin in this folder of the tree, by its id or that of a preset.
inline void run_plugin(const std::string& folder, const std::string& id, const Json& parameters,
                       const FakeTrial& trial) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/" + folder);
  plugin_host::Algorithm algorithm(catalog.resolve_or_throw(plugin_host::Kind::optimizer, id, parameters), {});
  algorithm.run(trial.handle());
}

}  // namespace relign::test
