// Every plugin of the tree passes the conformance checks that users' plugins must pass.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "conformance/child_main.h"
#include "conformance/inspection.h"
#include "tree_catalog.h"

namespace relign::conformance {
namespace {

// The plugins of part RELIGN_KIT_PART (0 to 3) of four, which ctest runs side by side; without it all.
bool is_in_part(std::size_t plugin) {
  const char* const part = std::getenv("RELIGN_KIT_PART");
  return !part || plugin % 4 == std::stoul(part);
}

TEST(Kit, PassesForEveryPlugin) {
  InspectionSetup setup;
  setup.program = kThisProgram;
  setup.deadline_s = 300;  // sanitizers are slow
  std::size_t number = 0;
  for (const auto& plugin : test::tree_catalog().plugins()) {
    if (!is_in_part(number++)) continue;
    SCOPED_TRACE(plugin->id);
    const Inspection inspection = inspect(plugin->folder, setup);
    EXPECT_TRUE(inspection.passed()) << inspection.refused;
    for (const CheckResult& result : inspection.results) {
      EXPECT_NE(result.finding.verdict, Verdict::failed) << result.check << ": " << result.finding.sentence;
      // "none" draws the same for every seed by design.
      if (plugin->id != "none") {
        EXPECT_NE(result.finding.verdict, Verdict::warning) << result.check << ": " << result.finding.sentence;
      }
    }
    // "network" runs nothing before a user names a network; "imitation" is the same agent with one.
    EXPECT_GE(inspection.count(Verdict::ok), plugin->id == "network" ? 4u : 10u);
  }
}

}  // namespace
}  // namespace relign::conformance

int main(int argc, char** argv) { return relign::conformance::run_child_or_tests(argc, argv); }
