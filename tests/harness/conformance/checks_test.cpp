// The list of checks is consistent, and equal to the documented one.
#include "conformance/checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "base/files.h"

namespace relign::conformance {
namespace {

using plugin_host::Kind;

const char* kinds_of(const Check& check) {
  if (check.applies(Kind::scene) && check.applies(Kind::noise_level)) return "all";
  if (check.applies(Kind::scene)) return "scenes";
  return check.applies(Kind::noise_level) ? "noise levels" : "algorithms";
}

TEST(Checks, NeedOnlyEarlierChecks) {
  std::set<std::string> before;
  for (const Check& check : all_checks()) {
    for (const char* needed : check.needs) EXPECT_TRUE(before.count(needed)) << check.name << " needs " << needed;
    EXPECT_TRUE(before.insert(check.name).second) << "duplicate check " << check.name;
    EXPECT_EQ(check_by_name(check.name), &check);
  }
  EXPECT_EQ(check_by_name("nothing"), nullptr);
}

TEST(Checks, MatchTheDocumentedList) {
  const std::string page = read_file(RELIGN_SOURCE_DIR "/docs/plugin_check.md");
  std::string table;
  for (const Check& check : all_checks())
    table += std::string("| `") + check.name + "` | " + kinds_of(check) + " | " + check.promise + " |\n";
  EXPECT_THAT(page, testing::HasSubstr("|---|---|---|\n" + table + "\n"));
}

TEST(Checks, VerdictsHaveNames) {
  for (const Verdict verdict : {Verdict::ok, Verdict::warning, Verdict::failed, Verdict::skipped})
    EXPECT_EQ(verdict_from_name(verdict_name(verdict)), verdict);
  EXPECT_EQ(verdict_from_name("fine"), std::nullopt);
}

}  // namespace
}  // namespace relign::conformance
