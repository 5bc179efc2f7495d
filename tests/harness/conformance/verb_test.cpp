// relign-bench plugin check as a user calls it: lines, JSON, exit codes.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kSaboteurs = RELIGN_SABOTEURS;

TEST(PluginCheck, PrintsALinePerCheckAndASummary) {
  const Outcome outcome = relign_bench(Workplace(), {"plugin", "check", kSaboteurs + "/sound"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("[ok]      stop"), HasSubstr("[ok]      same-trace"), HasSubstr("0 failed"),
                                 HasSubstr(": passed\n"), Not(HasSubstr("[failed]"))));
}

TEST(PluginCheck, ContinuesAfterAFailureAndExitsWithFive) {
  const Outcome outcome = relign_bench(
      Workplace(), {"plugin", "check", kSaboteurs + "/throws", kSaboteurs + "/none", kSaboteurs + "/sound"});
  EXPECT_EQ(outcome.exit_code, 5);
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("[failed]  runs"), HasSubstr("thrown on purpose"), HasSubstr("[skipped] stop"),
                    HasSubstr("needs 'runs'"), HasSubstr("[refused]"), HasSubstr("does not exist"),
                    HasSubstr("throws (optimizer): "), HasSubstr(": not passed\n"), HasSubstr("sound (optimizer): ")));
}

TEST(PluginCheck, WritesJson) {
  const Workplace place;
  const Outcome outcome = relign_bench(place, {"plugin", "check", "--json", kSaboteurs + "/throws", "./nowhere"});
  EXPECT_EQ(outcome.exit_code, 5);
  const json all = json::parse(outcome.out);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].at("plugin"), "throws");
  EXPECT_EQ(all[0].at("kind"), "optimizer");
  EXPECT_EQ(all[0].at("passed"), false);
  EXPECT_FALSE(all[0].contains("refused"));
  bool found = false;
  for (const json& check : all[0].at("checks"))
    if (check.at("check") == "runs") {
      found = true;
      EXPECT_EQ(check.at("verdict"), "failed");
      EXPECT_THAT(check.at("reason"), HasSubstr("thrown on purpose"));
    }
  EXPECT_TRUE(found);
  EXPECT_THAT(all[1].at("refused"), HasSubstr("does not exist"));
  EXPECT_TRUE(all[1].at("checks").empty());
}

TEST(PluginCheck, AcceptsAnIdAndADeadline) {
  const Outcome outcome = relign_bench(Workplace(), {"plugin", "check", "home", "--deadline", "50", "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_EQ(json::parse(outcome.out).at(0).at("plugin"), "home");
  EXPECT_EQ(relign_bench(Workplace(), {"plugin", "check", "home", "--deadline", "0"}).exit_code, 2);
  EXPECT_EQ(relign_bench(Workplace(), {"plugin", "check"}).exit_code, 2);
}

}  // namespace
}  // namespace relign::cli_test
