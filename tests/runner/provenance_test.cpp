#include "runner/provenance.h"

#include <gtest/gtest.h>

namespace relign::runner {
namespace {

plugin_host::Choice choice_that_promises(const std::string& where) {
  auto plugin = std::make_shared<plugin_host::Manifest>();
  plugin->reproducible = where;
  plugin_host::Choice choice;
  choice.plugin = plugin;
  return choice;
}

TEST(Provenance, AnAlgorithmIsAsReproducibleAsThoseThatItRuns) {
  const auto anywhere = choice_that_promises("anywhere"), this_cpu = choice_that_promises("this_cpu");
  EXPECT_EQ(reproducible_of(anywhere), "anywhere");
  EXPECT_EQ(reproducible_of(this_cpu), "this_cpu");

  plugin_host::Choice hand_over = anywhere;
  hand_over.algorithms["first"] = std::make_shared<plugin_host::Choice>(anywhere);
  EXPECT_EQ(reproducible_of(hand_over), "anywhere");
  hand_over.algorithms["then"] = std::make_shared<plugin_host::Choice>(this_cpu);
  EXPECT_EQ(reproducible_of(hand_over), "this_cpu");

  plugin_host::Choice outer = anywhere;
  outer.algorithms["first"] = std::make_shared<plugin_host::Choice>(hand_over);
  EXPECT_EQ(reproducible_of(outer), "this_cpu") << "however deep";
}

}  // namespace
}  // namespace relign::runner
