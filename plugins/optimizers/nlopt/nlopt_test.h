// Helpers for the tests of the nlopt plugin.
#pragma once

#include <string>
#include <vector>

#include "contract/run_on_bowl.h"

namespace relign::test {

inline plugin_host::Catalog& nlopt_catalog() {
  static auto* catalog = [] {
    auto* fresh = new plugin_host::Catalog;
    fresh->add(std::string(RELIGN_PLUGIN_DIR) + "/nlopt");
    return fresh;
  }();
  return *catalog;
}

inline std::vector<std::string> nlopt_presets() {
  std::vector<std::string> ids;
  for (const auto& preset : nlopt_catalog().plugins().at(0)->presets) ids.push_back(preset.id);
  return ids;
}

inline const std::vector<std::string> nlopt_local_presets = {"nlopt-sbplx", "nlopt-bobyqa", "nlopt-cobyla",
                                                             "nlopt-neldermead"};

inline void run_nlopt(const std::string& id, const FakeTrial& trial, const Json& parameters = {}) {
  plugin_host::Algorithm algorithm(nlopt_catalog().resolve_or_throw(plugin_host::Kind::optimizer, id, parameters), {});
  algorithm.run(trial.handle());
}

}  // namespace relign::test
