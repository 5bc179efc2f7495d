// hand_over_test.cpp tests the code; here the manifests are compared.
#include <gtest/gtest.h>

#include <set>

#include "plugin_host/objects.h"

namespace relign::hand_over {
namespace {

using plugin_host::Kind;

plugin_host::Catalog& design_catalog() {
  static auto* catalog = [] {
    auto* fresh = new plugin_host::Catalog;
    fresh->scan(RELIGN_PLUGIN_DIR);
    return fresh;
  }();
  return *catalog;
}

TEST(HandOverDesign, ObservesTheDesignAndTheLevelInAdditionToHandOver) {
  const auto observed = [](const char* id) {
    const auto words = design_catalog().resolve_or_throw(Kind::optimizer, id, {}).plugin->observes;
    return std::set<std::string>(words.begin(), words.end());
  };
  std::set<std::string> wanted = observed("hand-over");
  wanted.insert({"design", "level"});
  EXPECT_EQ(observed("hand-over-design"), wanted);
}

TEST(HandOverDesign, HasTheParametersOfHandOver) {
  const plugin_host::Choice one = design_catalog().resolve_or_throw(Kind::optimizer, "hand-over", {});
  const plugin_host::Choice other = design_catalog().resolve_or_throw(Kind::optimizer, "hand-over-design", {});
  for (const auto& [name, value] : one.parameters.items()) EXPECT_TRUE(other.parameters.contains(name)) << name;
  EXPECT_EQ(other.parameters.size(), one.parameters.size());
  EXPECT_EQ(other.algorithms.at("first")->id, "sensitivity-linear");
  EXPECT_EQ(other.algorithms.at("then")->id, "field-focus");
}

}  // namespace
}  // namespace relign::hand_over
