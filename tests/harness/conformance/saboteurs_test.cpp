// Plugins that break one promise each fail exactly its check, with a message that names it; checks that depend on it
// are skipped. Sound plugins pass, however they were built.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <set>

#include "base/files.h"
#include "conformance/checks.h"
#include "conformance/child_main.h"
#include "conformance/inspection.h"

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kOwnAllocator = true;
#else
constexpr bool kOwnAllocator = false;
#endif

namespace relign::conformance {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct Misdeed {
  const char* plugin;
  const char* check;
  Verdict verdict;
  const char* sentence;  // part of the expected message
};

constexpr Verdict kFailed = Verdict::failed;
constexpr Verdict kWarning = Verdict::warning;

const Misdeed kMisdeeds[] = {
    {"two_symbols", "symbols", kFailed, "helper_of_two_symbols"},
    {"other_interface", "interface", kFailed, "built for another version of the plugin interface"},
    {"refuses_preset", "creates", kFailed, "not in this mood"},
    {"throws", "runs", kFailed, "thrown on purpose"},
    {"exits", "runs", kFailed, "ended the process with exit status 0"},
    {"ignores_stop", "stop", kFailed, "stopped at request 1, it did not return within 2 s"},
    {"insists", "stop", kWarning, "requests up to 3 more steps after RELIGN_STOP"},
    {"sends_nan", "poses", kFailed, "after 7 steps it sent an invalid pose"},
    {"looks_back", "poses", kFailed, "requested step 0 again too late"},
    {"fails_in_preset", "presets", kFailed, "'fails_in_preset-moody': plugin 'fails_in_preset' failed in run: not in"},
    {"always_five", "dimensions", kFailed, "with 1 axes it sent a pose"},
    {"five_alone", "dimensions", kWarning, "it supports only five axes"},
    {"leaves_box", "box", kWarning, "step 8 commands 3 on axis 0"},
    {"remembers", "same-trace", kFailed, "differ at step 1"},
    {"crashes_on_nan", "merits", kFailed,
     kOwnAllocator ? "with merits that are NaN" : "it crashed with merits that are NaN with SIGSEGV"},
    {"forgets", "prepared", kFailed, "it saves no data during pretraining"},
    {"believes", "prepared", kFailed, "it accepts no bytes as pretrained data"},
    {"flush_to_zero", "floating-point", kFailed, "flush"},
    {"changes_folder", "surroundings", kFailed, "the working directory was changed to /"},
    {"changes_locale", "surroundings", kFailed, "the locale was changed from C to C.UTF-8"},
    {"changes_signals", "surroundings", kFailed, "the handler of SIGUSR2 was changed"},
    {"changes_environment", "surroundings", kFailed, "the environment variable OMP_NUM_THREADS was set"},
    {"keeps_files", "surroundings", kFailed, "was left open (/dev/null)"},
    {"prints", "stdout", kFailed, "it writes to stdout: 'best so far: 0.01'"},
    {"leaks", "heap", kFailed, "its memory grew by 4"},
    {"scene_description", "description", kFailed, "axes"},
    {"scene_reference", "reference", kFailed, "a second object has another reference image"},
    {"scene_remembers", "same-pixels", kFailed, "another image after other captures"},
    {"scene_nan", "same-pixels", kFailed, "non-finite or missing pixels"},
    {"scene_biased", "truth", kFailed, "the ground truth is biased"},
    {"scene_overconfident", "truth", kFailed, "times the stated standard error"},
    {"scene_optimum", "optimum", kFailed, "less than at its optimum"},
    {"scene_mtf", "mtf", kFailed, "the MTF at 1000 lp/mm is higher than at"},
    {"scene_any_element", "elements", kFailed, "it accepts offsets of the unknown element"},
    {"scene_afraid_of_ends", "travel", kFailed, "with every axis at 1, inside the travel"},
    {"station_moves_nan", "stage", kFailed, "the reported move of axis 1 is nan"},
    {"station_too_many_axes", "stage", kFailed, "limit flags exceed its 2 axes"},
    {"station_back_in_time", "stage", kFailed, "machine_seconds is -0.1"},
    {"station_timeless", "stage", kFailed, "machine_seconds is inf"},
    {"station_silent", "stage", kFailed, "but no limit"},
    {"station_endless", "stage", kFailed, "it reports a move of 1.1"},
    {"station_afraid", "stage", kFailed, "it met a limit"},
    {"station_dark", "stage", kFailed, "non-finite or missing pixels"},
    {"noise_level_remembers", "same-draw", kFailed, "when called again with seed"},
    {"noise_level_outside", "perturbations", kFailed, "start"},
};

void PrintTo(const Misdeed& misdeed, std::ostream* out) { *out << misdeed.plugin; }

std::string to_text(const Inspection& inspection) {
  std::string text = inspection.refused;
  for (const CheckResult& result : inspection.results)
    text +=
        std::string("\n") + verdict_name(result.finding.verdict) + " " + result.check + ": " + result.finding.sentence;
  return text;
}

Inspection inspect_folder(const fs::path& plugin) {
  InspectionSetup setup;
  setup.program = kThisProgram;
  setup.deadline_s = 60;
  return inspect(plugin, setup);
}

// Expects exactly one failure or warning, of this check, with this verdict and message.
void expect_only(const Inspection& inspection, const Misdeed& misdeed) {
  SCOPED_TRACE(to_text(inspection));
  EXPECT_EQ(inspection.refused, "");
  EXPECT_EQ(inspection.passed(), misdeed.verdict != Verdict::failed);
  EXPECT_EQ(inspection.count(Verdict::failed) + inspection.count(Verdict::warning), 1U);
  for (const CheckResult& result : inspection.results)
    if (result.check == misdeed.check) {
      EXPECT_EQ(result.finding.verdict, misdeed.verdict);
      EXPECT_THAT(result.finding.sentence, HasSubstr(misdeed.sentence));
    }
}

class Saboteurs : public testing::TestWithParam<Misdeed> {};

TEST_P(Saboteurs, FailExactlyTheirCheck) {
  const Misdeed& misdeed = GetParam();
  if (kOwnAllocator && std::string(misdeed.check) == "heap")
    GTEST_SKIP() << "the sanitizer's allocator does not report its memory";
  const Inspection inspection = inspect_folder(fs::path(RELIGN_SABOTEURS) / misdeed.plugin);
  expect_only(inspection, misdeed);
  EXPECT_EQ(inspection.plugin, misdeed.plugin);
}

INSTANTIATE_TEST_SUITE_P(Each, Saboteurs, testing::ValuesIn(kMisdeeds),
                         [](const auto& test) { return std::string(test.param.plugin); });

class Sound : public testing::TestWithParam<const char*> {};

TEST_P(Sound, PassesEveryCheckOfItsKind) {
  const Inspection inspection = inspect_folder(fs::path(RELIGN_SABOTEURS) / GetParam());
  SCOPED_TRACE(to_text(inspection));
  EXPECT_TRUE(inspection.passed());
  EXPECT_EQ(inspection.count(Verdict::warning), 0U);
  EXPECT_GE(inspection.count(Verdict::ok), 11U);
}

INSTANTIATE_TEST_SUITE_P(Each, Sound,
                         testing::Values("sound", "uses_services", "learns", "fast_math", "own_library", "old_strings",
                                         "scene_sound", "station_sound", "station_wanders", "noise_level_sound"),
                         [](const auto& test) { return std::string(test.param); });

#ifdef RELIGN_TOY_STATION
TEST(Station, ToyStationPasses) {
  const Inspection inspection = inspect_folder(RELIGN_TOY_STATION);
  SCOPED_TRACE(to_text(inspection));
  EXPECT_TRUE(inspection.passed());
  for (const CheckResult& result : inspection.results)
    if (result.check == "stage") {
      EXPECT_EQ(result.finding.verdict, Verdict::ok);
    }
}
#endif

// A damaged copy of the sound plugin.
class Copy : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("relign-saboteur-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::copy(fs::path(RELIGN_SABOTEURS) / "sound", folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(Copy, FailsIfTruncated) {
  const std::string whole = read_file(folder_ / "sound.so");
  write_file_atomically(folder_ / "sound.so", whole.substr(0, whole.size() / 2));
  expect_only(inspect_folder(folder_), {"", "library", kFailed, "its library is truncated"});
}

TEST_F(Copy, FailsWithAnotherManifest) {
  write_file_atomically(folder_ / "relign-plugin.json", read_file(folder_ / "relign-plugin.json") + "\n");
  expect_only(inspect_folder(folder_), {"", "manifest", kFailed, "differs from the one inside the library"});
}

TEST(Promises, HaveASaboteurEach) {
  // The copies, and the scenes of tests/cli/scores_test.cpp.
  std::set<std::string> broken = {"library", "manifest", "devices", "further-scores"};
  for (const Misdeed& misdeed : kMisdeeds) broken.insert(misdeed.check);
  for (const Check& check : all_checks()) EXPECT_TRUE(broken.count(check.name)) << check.name;
}

TEST(Inspection, RejectsMissingPlugin) {
  const Inspection inspection = inspect_folder(fs::path(RELIGN_SABOTEURS) / "there_is_none");
  EXPECT_FALSE(inspection.passed());
  EXPECT_THAT(inspection.refused, HasSubstr("does not exist"));
  EXPECT_TRUE(inspection.results.empty());
}

}  // namespace
}  // namespace relign::conformance

int main(int argc, char** argv) { return relign::conformance::run_child_or_tests(argc, argv); }
