// relign-bench plugin new: the files that it writes, and errors, which leave nothing behind. tests/out_of_tree builds
// and uses the projects.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Files in the folder, drafts included, except the test's own.
std::vector<std::string> left_behind(const Workplace& place) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(place.folder())) {
    const std::string name = entry.path().filename();
    if (name.rfind(".std", 0) != 0) names.push_back(name);
  }
  return names;
}

void expect_refused(const std::vector<std::string>& arguments, const testing::Matcher<std::string>& message) {
  const Workplace place;
  std::vector<std::string> command = {"plugin", "new"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  const Outcome outcome = relign_bench(place, command);
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, message);
  EXPECT_THAT(left_behind(place), testing::IsEmpty());
}

TEST(PluginNew, PrintsFolderAndNextCommands) {
  const Workplace place;
  const Outcome outcome = relign_bench(place, {"plugin", "new", "--kind", "optimizer", "my-own_search2"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "my-own_search2\n");
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("cmake --build build"), HasSubstr("relign-bench try ./build/my-own_search2")));
  EXPECT_THAT(place.read("my-own_search2/my-own_search2.cpp"), HasSubstr("RELIGN_PLUGIN(MyOwnSearch2)"));
  EXPECT_EQ(nlohmann::json::parse(place.read("my-own_search2/relign-plugin.json")).at("id"), "my-own_search2");
  EXPECT_THAT(left_behind(place), testing::ElementsAre("my-own_search2"));
}

TEST(PluginNew, PrintsJson) {
  const Workplace place;
  const Outcome outcome =
      relign_bench(place, {"plugin", "new", "--kind", "noise_level", "loose", "-o", "deep/er/", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result.at("kind"), "noise-level");
  EXPECT_TRUE(fs::exists(place.path("deep/er/loose.cpp")));
}

TEST(PluginNew, HasPythonTemplateForEveryKind) {
  const Workplace place;
  const std::map<std::string, std::string> use = {{"optimizer", "try ./mine.py"},
                                                  {"agent", "try ./mine.py"},
                                                  {"scene", "--scene ./mine.py"},
                                                  {"noise-level", "--noise-level ./mine.py"}};
  for (const auto& [kind, words] : use) {
    const Outcome outcome =
        relign_bench(place, {"plugin", "new", "--kind", kind, "--lang", "python", "mine", "-o", kind});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, AllOf(HasSubstr(words), HasSubstr("python3 test_mine.py"), Not(HasSubstr("cmake"))));
    EXPECT_THAT(place.read(kind + "/mine.py"), AllOf(HasSubstr("serve(Mine)"), Not(HasSubstr("my_plugin"))));
  }
}

TEST(PluginNew, ScenesOfReadingsPassTheChecksAndShowTheirImages) {
  if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed";
  const Workplace place;
  for (const char* observes : {"readings", "both"}) {
    ASSERT_EQ(relign_bench(place, {"plugin", "new", "--kind", "scene", "--lang", "python", "--observes", observes,
                                   std::string("of_") + observes})
                  .exit_code,
              0);
    const std::string file = std::string("./of_") + observes + "/of_" + observes + ".py";
    const Outcome checked = relign_bench(place, {"plugin", "check", file});
    EXPECT_THAT(checked.out, HasSubstr("0 with a warning, 0 failed")) << observes;
  }
  place.write("suite.json",
              R"({"name": "both", "scenes": ["./of_both/of_both.py", "./of_readings/of_readings.py"],
                  "noise_levels": ["declared"], "protocol": "blind", "algorithms": ["random"],
                  "instances": 1, "steps": 3})");
  const Outcome run = relign_bench(place, {"run", "suite.json", "-o", "out"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto index = nlohmann::json::parse(place.read("out/pictures/index.json"));
  ASSERT_FALSE(index["trials"].empty());
  for (const auto& trial : index["trials"]) EXPECT_EQ(trial["scene"], "of_both") << "readings have no picture";
  const std::string png = place.read("out/pictures/" + index["trials"][0]["frames"][0]["file"].get<std::string>());
  EXPECT_EQ(png.substr(16, 8), std::string("\0\0\0\x20\0\0\0\x18", 8)) << "32 x 24, without the line of readings";
}

TEST(PluginNew, AvoidsClassNamesOfTheTemplate) {
  const Workplace place;
  ASSERT_EQ(relign_bench(place, {"plugin", "new", "--kind", "agent", "policy"}).exit_code, 0);
  EXPECT_THAT(place.read("policy/policy.cpp"), HasSubstr("RELIGN_PLUGIN(PolicyPlugin)"));
}

TEST(PluginNew, RejectsInvalidAndExistingNames) {
  for (const char* name : {"", "../up", "3d", "a b", "ä", "-x", ".hidden"})
    expect_refused({"--kind", "agent", "--", name}, HasSubstr("invalid plugin name"));
  expect_refused({"--kind", "optimizer", "nlopt"}, HasSubstr("'nlopt' already"));
  expect_refused({"--kind", "agent", "nlopt_sbplx"}, HasSubstr("'nlopt-sbplx' already"));
}

TEST(PluginNew, RejectsUnknownKindAndLanguage) {
  expect_refused({"--kind", "optimiser", "mine"}, HasSubstr("did you mean 'optimizer'?"));
  expect_refused({"--kind", "scene", "--lang", "rust", "mine"}, HasSubstr("rust"));
}

TEST(PluginNew, NetworkRunsAsItsOwnAgent) {
  const Workplace place;
  const std::string imitation = RELIGN_SOURCE_DIR "/plugins/agents/imitation/imitation.onnx";
  const Outcome outcome = relign_bench(place, {"plugin", "new", "--kind", "agent", "--onnx", imitation, "mine"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "mine\n");
  EXPECT_THAT(outcome.err, HasSubstr("relign-bench try mine/mine.json --scene relign_od"));
  EXPECT_THAT(place.read("mine/README.md"), HasSubstr("`observation.mean`, `observation.deviation`"));
  const auto steps = [&](const std::string& algorithm) {
    const Outcome tried = relign_bench(place, {"try", algorithm, "--steps", "3", "--noise-level", "rho0.25", "--json"});
    EXPECT_EQ(tried.exit_code, 0) << tried.err;
    return nlohmann::json::parse(tried.out)["steps"];
  };
  const nlohmann::json as_imitation = steps("imitation");
  EXPECT_EQ(steps("mine/mine.json"), as_imitation);
  // Half of each output is half of each move.
  nlohmann::json side = nlohmann::json::parse(place.read("mine/mine.json"));
  side["scales"] = {0.5, 0.5, 0.5, 0.5, 0.5};
  place.write("mine/mine.json", side.dump());
  const nlohmann::json halved = steps("mine/mine.json");
  EXPECT_NEAR(
      halved[0]["recommended_pose"][0].get<double>() - halved[0]["commanded_pose"][0].get<double>(),
      0.5 * (as_imitation[0]["recommended_pose"][0].get<double>() - as_imitation[0]["commanded_pose"][0].get<double>()),
      1e-9);
}

TEST(PluginNew, RefusesNetworksThatItCannotRun) {
  const std::string golden = RELIGN_TEST_DATA "/policies/";
  expect_refused({"--kind", "agent", "--onnx", golden + "tiny.onnx", "mine"},
                 HasSubstr("tiny.onnx': the network returns 2 values; allowed: one for each of the 5 axes"));
  expect_refused({"--kind", "agent", "--onnx", golden + "make.py", "mine"}, HasSubstr("not an ONNX network"));
  expect_refused({"--kind", "agent", "--onnx", golden + "missing.onnx", "mine"}, HasSubstr("missing.onnx"));
  expect_refused({"--kind", "optimizer", "--onnx", golden + "tiny.onnx", "mine"}, HasSubstr("requires --kind agent"));
  expect_refused({"--kind", "agent", "--lang", "cpp", "--onnx", golden + "tiny.onnx", "mine"}, HasSubstr("--onnx"));
}

TEST(PluginNew, LeavesExistingFilesUnchanged) {
  const Workplace place;
  place.write("mine/notes.txt", "precious");
  place.write("file", "precious");
  fs::create_symlink("nowhere", place.path("dangling"));
  for (const char* name : {"mine", "mine/", "file", "dangling"}) {
    const Outcome outcome = relign_bench(place, {"plugin", "new", "--kind", "scene", "fresh", "-o", name});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr("already exists; nothing was written"));
  }
  EXPECT_THAT(left_behind(place), testing::UnorderedElementsAre("mine", "file", "dangling"));
  EXPECT_EQ(place.read("mine/notes.txt"), "precious");
  EXPECT_EQ(std::distance(fs::directory_iterator(place.path("mine")), fs::directory_iterator()), 1);
  // A folder below a file cannot be made.
  EXPECT_EQ(relign_bench(place, {"plugin", "new", "--kind", "scene", "fresh", "-o", "file/below"}).exit_code, 2);
}

}  // namespace
}  // namespace relign::cli_test
