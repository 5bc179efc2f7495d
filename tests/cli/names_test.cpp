// Hostile names in suites, plugins and results: rejected, or printed as plain text, and never executed.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::vector<std::string> kNames = {"<script>alert(1)</script>",
                                         "\"><img src=x onerror=alert(1)>",
                                         "$(touch pwned)",
                                         "; touch pwned",
                                         "`touch pwned`",
                                         "two\nlines",
                                         "\x1b[2J\x1b[31mred",
                                         "\xc2\x9b"
                                         "31mred",
                                         "\xe2\x80\xae"
                                         "back",
                                         "../../pwned",
                                         "-o pwned"};

void expect_harmless(const Workplace& place, const Outcome& outcome, const std::string& name) {
  for (const std::string* text : {&outcome.out, &outcome.err})
    for (const char* bytes : {"\x1b", "\xc2\x9b", "\xe2\x80\xae"})
      EXPECT_THAT(*text, Not(HasSubstr(bytes))) << Json(name).dump();
  EXPECT_LT(outcome.exit_code, 128) << Json(name).dump();
  for (const fs::path& file : {place.path("pwned"), place.folder().parent_path() / "pwned"})
    EXPECT_FALSE(fs::exists(file)) << Json(name).dump();
}

TEST(CliNames, OfSuitesAreRejectedOrPrintedAsText) {
  const Workplace place;
  for (const std::string& name : kNames) {
    for (const char* list : {"scenes", "noise_levels", "algorithms"}) {
      Json suite = {{"scenes", {"gaussian_spot"}}, {"noise_levels", {"none"}}, {"algorithms", {"random"}}};
      suite[list] = {name};
      place.write("suite.json", suite.dump());
      const Outcome unknown = relign_bench(place, {"validate", "suite.json"});
      expect_harmless(place, unknown, name);
      EXPECT_EQ(unknown.exit_code, 2) << unknown.err;
    }
    place.write(
        "suite.json",
        Json{{"name", name}, {"scenes", {"gaussian_spot"}}, {"noise_levels", {"none"}}, {"algorithms", {"random"}}}
            .dump());
    expect_harmless(place, relign_bench(place, {"validate", "suite.json"}), name);
    expect_harmless(place, relign_bench(place, {"try", name, "--scene", name}), name);
  }
}

TEST(CliNames, CommandsOfferedForCopyingAreQuoted) {
  const Workplace place;
  place.write("suite.json",
              Json{{"scenes", {"gaussian_spot"}}, {"noise_levels", {"none"}}, {"algorithms", {"random"}}}.dump());
  const std::string name = "$(touch pwned) x";
  const Outcome plan = relign_bench(place, {"plan", "suite.json", "-o", name});
  ASSERT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.err, HasSubstr("run --plan '$(touch pwned) x' --shard"));
  const Outcome made = relign_bench(place, {"plugin", "new", "mine", "--kind", "optimizer", "--out", name + "2"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.err, HasSubstr("cd '$(touch pwned) x2'"));
  fs::create_directories(place.path(name + "4"));
  fs::copy_file(RELIGN_SOURCE_DIR "/examples/compass_python/compass.py", place.path(name + "4") / "compass.py");
  place.write("own.json", Json{{"scenes", {"gaussian_spot"}},
                               {"noise_levels", {"none"}},
                               {"algorithms", {"./" + name + "4/compass.py"}},
                               {"instances", 1},
                               {"steps", 1}}
                              .dump());
  const Outcome ran = relign_bench(place, {"run", "own.json", "-o", name + "3"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("--plugin '$(touch pwned) x4/compass.py'"));
  expect_harmless(place, made, name);
}

TEST(CliNames, OfPluginsAreRejectedOrPrintedAsText) {
  const Workplace place;
  for (const std::string& name : kNames) {
    const auto write = [&](const std::string& id) {
      const Json manifest = {{"id", id},
                             {"kind", "optimizer"},
                             {"summary", name},
                             {"citation", name},
                             {"command", {"python3", "made.py"}},
                             {"observes", {"box"}}};
      place.write("made/relign-plugin.json", manifest.dump());
    };
    write(name);
    const Outcome refused = relign_bench(place, {"--plugin", "made", "list"});
    expect_harmless(place, refused, name);
    EXPECT_NE(refused.exit_code, 0) << "invalid plugin id: " << Json(name).dump();
    write("made");
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"list", "optimizers"}, std::vector<std::string>{"describe", "made"}}) {
      std::vector<std::string> arguments = {"--plugin", "made"};
      arguments.insert(arguments.end(), words.begin(), words.end());
      const Outcome shown = relign_bench(place, arguments);
      EXPECT_EQ(shown.exit_code, 0) << shown.err;
      expect_harmless(place, shown, name);
    }
  }
}

TEST(CliNames, AreEscapedInReports) {
  const Workplace place;
  const std::string name = "<b>\"$(touch pwned)'`touch pwned`;";
  place.write("suite.json", Json{{"name", name},
                                 {"instances", 1},
                                 {"steps", 2},
                                 {"scenes", {{{"use", "gaussian_spot"}, {"name", name}}}},
                                 {"noise_levels", {{{"use", "none"}, {"name", name}}}},
                                 {"algorithms", {{{"use", "random"}, {"name", name}}}}}
                                .dump());
  const Outcome run = relign_bench(place, {"run", "suite.json", "-o", "results"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  expect_harmless(place, run, name);
  const std::string page = place.read("results/report.html");
  EXPECT_THAT(page, Not(HasSubstr("<b>\"$(touch")));
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;&quot;$(touch pwned)"));
}

}  // namespace
}  // namespace relign::cli_test
