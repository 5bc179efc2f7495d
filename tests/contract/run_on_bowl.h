// What tests of optimizers share: a bowl to search, and a plugin of the tree that searches it.
#pragma once

#include <string>

#include "contract/fake_conversation.h"
#include "plugin_host/objects.h"

namespace relign::test {

// Its bottom, 0.01, lies off the centre and off every grid: at 0.17, -0.21, 0.17, ...
inline double off_centre_bowl(const Pose& pose) {
  Pose optimum(pose.size());
  for (std::size_t axis = 0; axis < pose.size(); ++axis) optimum[axis] = axis % 2 ? -0.21 : 0.17;
  return bowl(pose, optimum);
}

inline FakeSetup bowl_setup(std::uint32_t axes) {
  FakeSetup setup;
  setup.axes = axes;
  setup.merit = [](const Pose& pose, std::uint32_t) { return off_centre_bowl(pose); };
  return setup;
}

inline FakeSetup bowl_setup(std::uint32_t axes, std::uint32_t budget) {
  FakeSetup setup = bowl_setup(axes);
  setup.budget = budget;
  return setup;
}

// One trial of the plugin in this folder of the tree, by its id or a preset's.
inline void run_plugin(const std::string& folder, const std::string& id, const Json& parameters,
                       const FakeConversation& conversation) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/" + folder);
  plugin_host::Algorithm algorithm(catalog.resolve_or_throw(plugin_host::Kind::optimizer, id, parameters), {});
  algorithm.run(conversation.talk());
}

}  // namespace relign::test
