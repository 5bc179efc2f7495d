// Changes of the process state by plugins: restored and reported.
#include "plugin_host/guard.h"

#include <gmock/gmock.h>
#include <signal.h>

#include <cfenv>
#include <clocale>
#include <filesystem>
#include <limits>
#include <locale>

#include "base/machine.h"
#include "contract/fake_trial.h"
#include "plugin_host/objects.h"
#include "test_folder.h"

namespace relign::plugin_host {
namespace {

using test::FakeSetup;
using test::FakeTrial;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Half of the smallest normal number: zero in flush-to-zero mode.
double half_of_smallest() {
  volatile double smallest = std::numeric_limits<double>::min();
  return smallest / 2;
}

Choice misbehaving(const std::string& deed) {
  Catalog catalog;
  catalog.add(std::string(RELIGN_TEST_PLUGINS) + "/misbehaving");
  return catalog.resolve_or_throw(Kind::optimizer, "misbehaving", {{"deed", deed}});
}

FakeSetup plain_setup() {
  FakeSetup setup;
  setup.merit = [](const test::Pose&, std::uint32_t) { return half_of_smallest() > 0 ? 1.0 : 0.0; };
  return setup;
}

// One trial under watch, as run_trial does it.
std::vector<std::string> changes_by(const std::string& deed) {
  const Choice choice = misbehaving(deed);
  EnvironmentWatch watch;
  Algorithm algorithm(choice, {});
  FakeTrial trial(plain_setup());
  algorithm.run(trial.handle());
  return watch.changes();
}

TEST(Guard, ReportsNoChangesOfACleanPlugin) { EXPECT_THAT(changes_by("nothing"), IsEmpty()); }

TEST(Guard, RestoresFloatingPointModeAndNamesThePlugin) {
  EXPECT_THAT(changes_by("flush to zero"),
              ElementsAre(AllOf(HasSubstr("'misbehaving'"), HasSubstr("flush-to-zero was switched on"))));
  EXPECT_GT(half_of_smallest(), 0);
  EXPECT_THAT(changes_by("flush to zero in create"), ElementsAre(HasSubstr("flush-to-zero")));
  EXPECT_GT(half_of_smallest(), 0);
  EXPECT_THAT(changes_by("rounding"), ElementsAre(AllOf(HasSubstr("rounding mode"), HasSubstr("x87"))));
  EXPECT_EQ(std::fegetround(), FE_TONEAREST);
  EXPECT_THAT(changes_by("nothing"), IsEmpty());  // each watch reports only changes since its construction
}

TEST(Guard, KeepsFloatingPointModesOfHostAndPluginApart) {
  const Choice choice = misbehaving("flush to zero and step");
  FakeTrial trial(plain_setup());
  Algorithm algorithm(choice, {});
  algorithm.run(trial.handle());  // fails if the plugin loses its mode
  ASSERT_EQ(trial.steps.size(), 1u);
  EXPECT_EQ(trial.steps[0].merit, 1.0);  // the host computed with subnormal numbers
  EXPECT_GT(half_of_smallest(), 0);
}

class FastMathTest : public test::FolderTest {};

TEST_F(FastMathTest, LoadingAFastMathLibraryChangesNothing) {
  plugin("fast", R"({"id": "foreign", "kind": "optimizer", "summary": "For tests."})", "foreign.so");
  std::filesystem::copy_file(std::string(RELIGN_TEST_PLUGINS) + "/foreign/fast_math.so", folder_ / "fast/foreign.so",
                             std::filesystem::copy_options::overwrite_existing);
  Catalog catalog;
  catalog.add(folder_ / "fast");
  EnvironmentWatch watch;
  Algorithm algorithm(catalog.resolve_or_throw(Kind::optimizer, "foreign"), {});
  EXPECT_GT(half_of_smallest(), 0);
  EXPECT_THAT(watch.changes(), ElementsAre(HasSubstr("'foreign'")));
}

TEST(Guard, RestoresFolderLocaleAndSignalHandlers) {
  const auto folder = std::filesystem::current_path();
  ASSERT_NE(folder, "/");
  EXPECT_THAT(changes_by("folder"), ElementsAre("the working directory was changed to /"));
  EXPECT_EQ(std::filesystem::current_path(), folder);

  const std::string locale = std::setlocale(LC_ALL, nullptr);
  EXPECT_THAT(changes_by("locale"), ElementsAre(HasSubstr("the locale was changed from")));
  EXPECT_EQ(std::setlocale(LC_ALL, nullptr), locale);
  EXPECT_THAT(changes_by("thread locale"), ElementsAre(HasSubstr("locale of the thread")));
  EXPECT_THAT(changes_by("thread locale"), ElementsAre(HasSubstr("locale of the thread")));
  const std::locale cpp_locale;
  EXPECT_THAT(changes_by("c++ locale"), ElementsAre(HasSubstr("C++ locale")));
  EXPECT_TRUE(std::locale() == cpp_locale);

  EXPECT_THAT(changes_by("signal"), ElementsAre("the handler of SIGUSR2 was changed"));
  struct sigaction now {};
  ::sigaction(SIGUSR2, nullptr, &now);
  EXPECT_EQ(now.sa_handler, SIG_DFL);
}

TEST(Guard, ReportsEachChangeOnce) {
  EnvironmentWatch watch;
  std::fesetround(FE_DOWNWARD);
  EXPECT_THAT(watch.changes(), ElementsAre(HasSubstr("rounding mode")));
  EXPECT_EQ(std::fegetround(), FE_TONEAREST);
  EXPECT_THAT(watch.changes(), IsEmpty());
}

TEST(Guard, TurnsExceptionsIntoFailuresWithTheirText) {
  const auto failure = [](const std::string& deed) {
    FakeTrial trial(plain_setup());
    return test::error_text(ErrorKind::plugin_failed, [&] { Algorithm(misbehaving(deed), {}).run(trial.handle()); });
  };
  EXPECT_EQ(failure("throw"), "plugin 'misbehaving' failed in run: thrown on purpose");
  EXPECT_EQ(failure("throw an int"), "plugin 'misbehaving' failed in run: an exception that is no std::exception");
  EXPECT_EQ(failure("fail in create"), "plugin 'misbehaving' failed in create: made to fail");
  EXPECT_EQ(failure("run out of memory"),
            "plugin 'misbehaving' failed in run: out of memory: it may use " + memory_words() +
                "; raise the limit, or let it do less: fewer pixels, wavelengths or workers");
}

TEST(Guard, PassesHostExceptionsAroundThePlugin) {
  FakeSetup setup = plain_setup();
  setup.merit = [](const test::Pose&, std::uint32_t) -> double { throw std::out_of_range("of the host"); };
  FakeTrial trial(setup);
  Algorithm algorithm(misbehaving("flush to zero and step"), {});
  EXPECT_THROW(algorithm.run(trial.handle()), std::out_of_range);
  EXPECT_GT(half_of_smallest(), 0);
}

TEST(FloatingPointState, IgnoresStickyFlags) {
  const FloatingPointState before = FloatingPointState::current();
  volatile double third = 1;
  third = third / 3;  // inexact
  EXPECT_TRUE(before.same_mode(FloatingPointState::current()));
}

}  // namespace
}  // namespace relign::plugin_host
