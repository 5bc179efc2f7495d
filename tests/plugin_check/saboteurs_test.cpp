// Plugins that break one promise each fail the one check that is for it, with a sentence that names it;
// what cannot be told without that promise is skipped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "plugin_check/child_main.h"
#include "plugin_check/inspection.h"

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kOwnAllocator = true;
#else
constexpr bool kOwnAllocator = false;
#endif

namespace relign::plugin_check {
namespace {

using testing::HasSubstr;

struct Misdeed {
  const char* plugin;
  const char* check;  // empty: none
  Verdict verdict;
  const char* sentence;  // what it must say
};

void PrintTo(const Misdeed& misdeed, std::ostream* out) { *out << misdeed.plugin; }

class Saboteurs : public testing::TestWithParam<Misdeed> {};

std::string told(const Inspection& inspection) {
  std::string text = inspection.refused;
  for (const CheckResult& result : inspection.results)
    text +=
        std::string("\n") + verdict_name(result.finding.verdict) + " " + result.check + ": " + result.finding.sentence;
  return text;
}

Inspection inspect_saboteur(const std::string& name) {
  InspectionSetup setup;
  setup.program = kThisProgram;
  setup.deadline_s = 60;
  return inspect(std::filesystem::path(RELIGN_SABOTEURS) / name, setup);
}

TEST_P(Saboteurs, FailTheCheckThatIsForThemAndNoOther) {
  const Misdeed& misdeed = GetParam();
  const Inspection inspection = inspect_saboteur(misdeed.plugin);
  SCOPED_TRACE(told(inspection));
  EXPECT_EQ(inspection.refused, "");
  EXPECT_EQ(inspection.plugin, misdeed.plugin);
  EXPECT_EQ(inspection.passed(), misdeed.verdict != Verdict::failed);
  bool seen = false;
  for (const CheckResult& result : inspection.results) {
    if (result.check == misdeed.check) {
      seen = true;
      EXPECT_EQ(result.finding.verdict, misdeed.verdict);
      EXPECT_THAT(result.finding.sentence, HasSubstr(misdeed.sentence));
    } else {
      EXPECT_NE(result.finding.verdict, Verdict::failed) << result.check;
      EXPECT_NE(result.finding.verdict, Verdict::warning) << result.check;
      if (misdeed.verdict != Verdict::failed && !kOwnAllocator) {
        EXPECT_EQ(result.finding.verdict, Verdict::ok) << result.check;
      }
    }
  }
  EXPECT_TRUE(seen || *misdeed.check == '\0');
}

INSTANTIATE_TEST_SUITE_P(
    Each, Saboteurs,
    testing::Values(
        Misdeed{"sound", "", Verdict::ok, ""}, Misdeed{"fast_math", "", Verdict::ok, ""},
        Misdeed{"two_symbols", "symbols", Verdict::failed, "helper_of_two_symbols"},
        Misdeed{"throws", "runs", Verdict::failed, "thrown on purpose"},
        Misdeed{"exits", "runs", Verdict::failed, "ended the process, with exit status 0"},
        Misdeed{"ignores_stop", "stop", Verdict::failed, "stopped at request 1, it did not return within 2 s"},
        Misdeed{"sends_nan", "poses", Verdict::failed, "after 7 steps it sent a pose that is not finite"},
        Misdeed{"leaves_box", "box", Verdict::warning, "step 8 commands 3 on axis 0"},
        Misdeed{"remembers", "same-trace", Verdict::failed, "part at step 1"},
        Misdeed{"crashes_on_nan", "merits", Verdict::failed,
                kOwnAllocator ? "with merits that are NaN" : "it crashed with merits that are NaN with SIGSEGV"},
        Misdeed{"flush_to_zero", "floating-point", Verdict::failed, "flush"},
        Misdeed{"changes_folder", "surroundings", Verdict::failed, "the working directory was changed to /"},
        Misdeed{"changes_locale", "surroundings", Verdict::failed, "the locale was changed from C to C.UTF-8"},
        Misdeed{"changes_signals", "surroundings", Verdict::failed, "the handler of SIGUSR2 was changed"},
        Misdeed{"changes_environment", "surroundings", Verdict::failed,
                "the environment variable OMP_NUM_THREADS was set"},
        Misdeed{"keeps_files", "surroundings", Verdict::failed, "was left open (/dev/null)"},
        Misdeed{"prints", "stdout", Verdict::failed, "it writes to stdout: 'best so far: 0.01'"},
        Misdeed{"scene_remembers", "same-pixels", Verdict::failed, "another image after other captures"},
        Misdeed{"scene_nan", "same-pixels", Verdict::failed, "pixels that are not finite"},
        Misdeed{"scene_biased", "truth", Verdict::failed, "the truth is biased"},
        Misdeed{"scene_overconfident", "truth", Verdict::failed, "times the standard error they tell"},
        Misdeed{"scene_any_element", "elements", Verdict::failed, "it mounts offsets of an element"},
        Misdeed{"scene_description", "description", Verdict::failed, "axes"},
        Misdeed{"noise_level_remembers", "same-draw", Verdict::failed, "when it is asked for seed"},
        Misdeed{"noise_level_outside", "variances", Verdict::failed, "start"}),
    [](const auto& test) { return std::string(test.param.plugin); });

TEST(Saboteur, ThatLeaksIsFoundByItsHeap) {
  if (kOwnAllocator) GTEST_SKIP() << "the sanitizer's allocator tells nothing";
  const Inspection inspection = inspect_saboteur("leaks");
  SCOPED_TRACE(told(inspection));
  EXPECT_EQ(inspection.count(Verdict::failed), 1u);
  EXPECT_EQ(inspection.results.back().check, "heap");
  EXPECT_THAT(inspection.results.back().finding.sentence, HasSubstr("its memory grew by 4"));
}

TEST(Inspection, PassesSoundScenesAndNoiseLevels) {
  for (const char* name : {"scene_sound", "noise_level_sound"}) {
    const Inspection inspection = inspect_saboteur(name);
    SCOPED_TRACE(told(inspection));
    EXPECT_TRUE(inspection.passed());
    EXPECT_EQ(inspection.count(Verdict::warning), 0u);
    EXPECT_GE(inspection.count(Verdict::ok), 10u);
  }
}

TEST(Inspection, RefusesWhatIsNoPlugin) {
  const Inspection inspection = inspect_saboteur("there_is_none");
  EXPECT_FALSE(inspection.passed());
  EXPECT_THAT(inspection.refused, HasSubstr("does not exist"));
  EXPECT_TRUE(inspection.results.empty());
}

}  // namespace
}  // namespace relign::plugin_check

int main(int argc, char** argv) { return relign::plugin_check::run_child_or_tests(argc, argv); }
