#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "base/files.h"
#include "suites/suite.h"

namespace relign::suites {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// A catalogue of manifests; suites are read without loading a library.
class SuiteReaderTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("relign-suite-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    plugin("toy", R"({"id": "toy", "kind": "scene", "summary": "A scene.", "document": "prescription",
      "parameters": {"prescription": {"type": "file", "default": "", "description": "A file."},
                     "white": {"type": "number", "default": 1, "minimum": 0, "maximum": 2, "description": "White."}}})");
    plugin("rho", R"({"id": "rho", "kind": "noise-level", "summary": "A level.",
      "parameters": {"width": {"type": "number", "default": 0, "minimum": 0, "maximum": 1, "description": "Width."}},
      "presets": {"rho0": {"summary": "None.", "parameters": {"width": 0}},
                  "rho0.5": {"summary": "Half.", "parameters": {"width": 0.5}}}})");
    plugin("bo", R"({"id": "bo-gp", "kind": "optimizer", "summary": "A search.", "observes": ["merit", "box"],
      "parameters": {"kappa": {"type": "number", "default": 2, "minimum": 0, "maximum": 10, "description": "Kappa."}}})");
    plugin("home", R"({"id": "home", "kind": "optimizer", "summary": "One move.", "observes": ["start"]})");
    plugin("random", R"({"id": "random", "kind": "optimizer", "summary": "Chance.", "observes": ["box"]})");
    catalog_.scan(folder_ / "plugins");
    ASSERT_THAT(catalog_.refused(), testing::IsEmpty());
  }
  void TearDown() override { fs::remove_all(folder_); }

  void plugin(const std::string& name, const std::string& manifest) {
    write_file_atomically(folder_ / "plugins" / name / "relign-plugin.json", manifest);
    const Json json = Json::parse(manifest);
    write_file_atomically(folder_ / "plugins" / name / (json["id"].get<std::string>() + ".so"), "no library");
  }
  // An agent with a trained model, and three models.
  void add_trained() {
    plugin("net", R"({"id": "net", "kind": "agent", "summary": "Learnt.", "observes": ["images"], "training": "model",
      "parameters": {"model": {"type": "file", "description": "A model."},
                     "gain": {"type": "number", "default": 1, "minimum": 0, "maximum": 1, "description": "Gain."}}})");
    for (const char* file : {"a/one.onnx", "a/two.onnx", "b/one.onnx"}) write_file_atomically(folder_ / file, file);
    catalog_.scan(folder_ / "plugins");
    ASSERT_THAT(catalog_.refused(), testing::IsEmpty());
  }
  Suite read(const std::string& text) {
    return read_suite(JsonSource::from_text(text, "quick.json"), folder_, catalog_);
  }
  std::string mistakes(const std::string& text) {
    try {
      read(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      return error.what();
    }
    ADD_FAILURE() << "no error for " << text;
    return "";
  }
  // A suite whose algorithms are these.
  static std::string with(const std::string& algorithms, const std::string& more = "") {
    return R"({"scenes": ["toy"], "noise_levels": ["rho0"], "algorithms": [)" + algorithms + "]" + more + "}";
  }
  static std::vector<std::string> names(const Suite& suite) {
    std::vector<std::string> found;
    for (const AlgorithmEntry& entry : suite.algorithms) found.push_back(entry.name);
    return found;
  }
  fs::path folder_;
  plugin_host::Catalog catalog_;
};

TEST_F(SuiteReaderTest, RefusesAlgorithmsThatCannotRunInsideOthers) {
  const std::string inner =
      R"("parameters": {"inner": {"type": "algorithm", "default": "bo-gp", "description": "Inner."}}})";
  plugin("told", R"({"id": "told", "kind": "optimizer", "summary": "T.", "observes": ["start"], "oracle": true})");
  plugin("aim", R"({"id": "aim", "kind": "optimizer", "summary": "A.", "observes": ["start", "history"], )" + inner);
  plugin("wrap", R"({"id": "wrap", "kind": "optimizer", "summary": "W.", "observes": ["start"], )" + inner);
  catalog_.scan(folder_ / "plugins");
  ASSERT_THAT(catalog_.refused(), testing::IsEmpty());
  const auto of = [](const std::string& outer, const std::string& given, const std::string& protocol) {
    return with(R"({"use": ")" + outer + R"(", "name": "n", "protocol": ")" + protocol +
                R"(", "parameters": {"inner": )" + given + "}}");
  };
  EXPECT_THAT(mistakes(of("wrap", R"("told")", "blind")),
              HasSubstr("quick.json:1:136: /algorithms/0/parameters/inner: 'told' cannot run inside 'wrap': it is an "
                        "oracle, which needs the start pose"));
  EXPECT_THAT(mistakes(of("aim", R"({"use": "wrap", "parameters": {"inner": "told"}})", "blind")),
              HasSubstr("/algorithms/0/parameters/inner/parameters/inner: 'told' cannot run inside 'wrap'"));
  EXPECT_NO_THROW(read(of("wrap", R"("told")", "paper"))) << "both observe the start";
  EXPECT_NO_THROW(read(of("aim", R"("wrap")", "blind")));
}

TEST_F(SuiteReaderTest, FillsInDefaults) {
  const std::string text =
      R"({"$schema": "x", "scenes": ["toy"], "noise_levels": ["rho0", "rho0.5"], "algorithms": ["bo-gp"]})";
  const Suite suite = read(text);
  EXPECT_EQ(suite.name, "quick");
  EXPECT_EQ(suite.file, "quick.json");
  EXPECT_EQ(suite.text, text);
  EXPECT_EQ(suite.seed, 1U);
  EXPECT_EQ(suite.instances, 100U);
  EXPECT_EQ(suite.first_instance, 0U);
  EXPECT_EQ(suite.limits, "soft");
  EXPECT_TRUE(suite.spec.is_null());
  EXPECT_TRUE(suite.targets.empty());
  EXPECT_FALSE(suite.machine_time.settle_ms.has_value());
  ASSERT_EQ(suite.levels.size(), 2U);
  EXPECT_EQ(suite.levels[1].name, "rho0.5");
  EXPECT_EQ(suite.levels[1].choice.parameters["width"], 0.5);
  EXPECT_THAT(names(suite), testing::ElementsAre("bo-gp", "home", "random"));
  EXPECT_EQ(suite.algorithms[0].steps, 50U);
  EXPECT_EQ(suite.algorithms[0].protocol, "paper");
  EXPECT_EQ(suite.algorithms[0].merit, "");
  EXPECT_FALSE(suite.algorithms[0].added);
  EXPECT_TRUE(suite.algorithms[1].added);
  EXPECT_EQ(suite.algorithms[1].choice.plugin->id, "home");
}

TEST_F(SuiteReaderTest, AcceptsEveryKey) {
  const Suite suite = read(with(R"({"use": "bo-gp", "name": "bo-bold", "parameters": {"kappa": 5}, "steps": 10,
                                   "protocol": "paper", "merit": "rmse"}, "home")",
                                R"(, "name": "mine", "seed": 9, "instances": 7, "first_instance": 3, "steps": 30,
      "protocol": "blind", "limits": "hard", "targets": [0.05, 0.01], "spec": {"rmse": 0.02, "mtf": {"lp_per_mm": 80, "centre": 0.5}},
      "machine_time": {"speed_mm_per_s": 4, "readout_ms": 0})"));
  EXPECT_EQ(suite.name, "mine");
  EXPECT_EQ(suite.seed, 9U);
  EXPECT_EQ(suite.instances, 7U);
  EXPECT_EQ(suite.first_instance, 3U);
  EXPECT_EQ(suite.limits, "hard");
  EXPECT_EQ(suite.spec["mtf"]["centre"], 0.5);
  EXPECT_EQ(suite.targets, (std::vector<double>{0.05, 0.01}));
  EXPECT_EQ(suite.machine_time.speed_mm_per_s, 4);
  EXPECT_EQ(suite.machine_time.readout_ms, 0);
  EXPECT_FALSE(suite.machine_time.exposure_ms.has_value());
  const AlgorithmEntry& bold = suite.algorithms[0];
  EXPECT_EQ(bold.name, "bo-bold");
  EXPECT_EQ(bold.choice.parameters["kappa"], 5);
  EXPECT_EQ(bold.steps, 10U);
  EXPECT_EQ(bold.protocol, "paper");
  EXPECT_EQ(bold.merit, "rmse");
  EXPECT_EQ(suite.algorithms[1].protocol, "blind");
  EXPECT_EQ(suite.algorithms[1].steps, 30U);
}

// Tables are compared within a protocol, so that each protocol in use gets its baselines.
TEST_F(SuiteReaderTest, AddsBaselinesUnderEveryProtocolInUse) {
  const Suite suite = read(with(R"({"use": "bo-gp", "protocol": "blind"}, "home", "random", "bo_gp")"));
  ASSERT_EQ(suite.algorithms.size(), 6U);
  for (std::size_t index : {4U, 5U}) {
    EXPECT_EQ(suite.algorithms[index].protocol, "blind");
    EXPECT_TRUE(suite.algorithms[index].added);
  }
}

TEST_F(SuiteReaderTest, RefusesOtherMethodsUnderTheNameOfABaseline) {
  for (const char* name : {"random", "Random", " home", "h-o-m-e"})
    EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "name": ")" + std::string(name) + "\"}")),
                AllOf(HasSubstr("/algorithms/0: '" + std::string(name) + "' reads as the baseline '"),
                      HasSubstr("the entry is the plugin 'bo-gp'; give it another 'name'")));
  EXPECT_THAT(mistakes(with(R"({"use": "random", "name": "home"})")), HasSubstr("the entry is the plugin 'random'"));
  EXPECT_EQ(
      read(with(R"({"use": "bo-gp", "name": "random-start"}, {"use": "random", "name": "Random"})")).algorithms[1].name,
      "Random");
}

TEST_F(SuiteReaderTest, RefusesHiddenCharactersInNames) {
  for (const char* name : {"bo\\u202e", "bo\\u200f", "b\\u200bo", "bo\\u0085", "b\\no"})
    EXPECT_THAT(
        mistakes(with(R"({"use": "bo-gp", "name": ")" + std::string(name) + "\"}")),
        HasSubstr("/algorithms/0/name: line ends, control characters and marks of the writing direction are not"));
}

TEST_F(SuiteReaderTest, RunsEntriesUnderEachProtocolOfTheList) {
  const Suite suite = read(R"({"scenes": ["toy"], "noise_levels": ["rho0"], "protocols": ["paper", "blind"],
    "algorithms": ["bo_gp", {"use": "home", "protocol": "blind"}, {"use": "random", "protocols": ["blind", "paper"]}]})");
  std::vector<std::string> found;
  for (const AlgorithmEntry& entry : suite.algorithms) found.push_back(entry.name + " " + entry.protocol);
  EXPECT_THAT(found, testing::ElementsAre("bo-gp paper", "bo-gp blind", "home blind", "random blind", "random paper",
                                          "home paper"));
  const auto with_protocols = [this](const std::string& more) {
    return mistakes(R"({"scenes": ["toy"], "noise_levels": ["rho0"], "algorithms": ["home"], )" + more + "}");
  };
  EXPECT_THAT(with_protocols(R"("protocols": ["paper", "papier"])"),
              HasSubstr("/protocols: expected a list of different"));
  EXPECT_THAT(with_protocols(R"("protocols": ["paper", "paper"])"),
              HasSubstr("/protocols: expected a list of different"));
  EXPECT_THAT(with_protocols(R"("protocols": ["paper"], "protocol": "blind")"),
              HasSubstr("expected one of them, not both"));
  EXPECT_THAT(mistakes(R"({"scenes": ["toy"], "noise_levels": ["rho0"], "protocols": ["paper", "blind"],
                           "algorithms": ["home", {"use": "random", "name": "home", "protocol": "blind"}]})"),
              HasSubstr("already used by /algorithms/0 under the same protocol"));
}

TEST_F(SuiteReaderTest, ReadsAnalysisPlanAndReportsItsMistakes) {
  const auto suite_with = [](const std::string& plan) {
    return R"({"scenes": ["toy"], "noise_levels": ["rho0"], "algorithms": ["bo_gp"], "analysis": )" + plan + "}";
  };
  EXPECT_FALSE(read(R"({"scenes": ["toy"], "noise_levels": ["rho0"], "algorithms": ["bo_gp"]})").analysis);
  EXPECT_EQ(json_of(read(suite_with(R"({"rule": "best", "contrasts": [["bo-gp", "random"]]})")).analysis),
            Json({{"primary", "rmse"},
                  {"rule", "best"},
                  {"contrasts", Json::array({Json::array({"bo-gp", "random"})})},
                  {"smallest_relevant_ratio", 1.1},
                  {"yield", nullptr}}));
  EXPECT_THAT(mistakes(suite_with(R"({"rule": "bset"})")), HasSubstr("/analysis/rule: found 'bset'"));
  EXPECT_THAT(mistakes(suite_with(R"({"contrasts": [["bo-gp", "randm"]]})")),
              HasSubstr("/analysis/contrasts/0/1: unknown algorithm 'randm' in this suite; did you mean 'random'?"));
  EXPECT_THAT(mistakes(suite_with(R"({"contrasts": [["bo-gp", "bo-gp"]]})")),
              HasSubstr("is listed twice; list each once"));
  EXPECT_THAT(mistakes(suite_with(R"({"smallest_relevant_ratio": 0.9})")),
              HasSubstr("/analysis/smallest_relevant_ratio"));
  EXPECT_THAT(mistakes(suite_with(R"({"alpha": 0.05})")), HasSubstr("/analysis/alpha: unknown key"));
}

TEST_F(SuiteReaderTest, ResolvesPathsRelativeToTheSuite) {
  write_file_atomically(folder_ / "my_lens" / "scene.json", R"({"use": "toy"})");
  write_file_atomically(folder_ / "my_lens" / "suite.json",
                        R"({"scenes": ["scene.json"], "noise_levels": ["rho0"], "algorithms": ["../plugins/bo"]})");
  const Suite suite = read_suite(folder_ / "my_lens" / "suite.json", catalog_);
  EXPECT_EQ(suite.name, "suite");
  EXPECT_EQ(suite.scenes[0].name, "scene");
  EXPECT_EQ(suite.scenes[0].choice.plugin->id, "toy");
  EXPECT_EQ(suite.algorithms[0].name, "bo-gp");
}

TEST_F(SuiteReaderTest, MakesOneEntryPerTraining) {
  add_trained();
  const Suite suite = read(with(R"({"use": "net", "name": "ours", "trainings": ["a/one.onnx", "a/two.onnx"], "steps": 7,
                                   "parameters": {"gain": 0.5}})"));
  EXPECT_THAT(names(suite), testing::ElementsAre("ours (one)", "ours (two)", "home", "random"));
  const AlgorithmEntry& two = suite.algorithms[1];
  EXPECT_EQ(two.method, "ours");
  EXPECT_EQ(two.training, "two");
  EXPECT_EQ(two.steps, 7U);
  EXPECT_EQ(two.choice.parameters["model"], (folder_ / "a" / "two.onnx").string());
  EXPECT_EQ(two.choice.parameters["gain"], 0.5);
  EXPECT_NE(two.choice.identity, suite.algorithms[0].choice.identity);
  EXPECT_EQ(suite.algorithms[2].method, "");
  EXPECT_EQ(suite.algorithms[2].training, "");
}

TEST_F(SuiteReaderTest, NamesTrainingsOfEqualFileNamesByFolder) {
  add_trained();
  const Suite suite = read(with(R"({"use": "net", "name": "ours", "trainings": ["a/one.onnx", "./b/one.onnx"]})"));
  EXPECT_THAT(names(suite), testing::ElementsAre("ours (a-one)", "ours (b-one)", "home", "random"));
}

TEST_F(SuiteReaderTest, ReportsMistakesInTrainingsWithPosition) {
  add_trained();
  EXPECT_THAT(mistakes(with(R"({"use": "net", "trainings": ["a/one.onnx"]})")),
              HasSubstr("a list of trainings needs a 'name'"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "name": "ours", "trainings": ["a/one.onnx"]})")),
              HasSubstr("'bo-gp' has no trained model"));
  EXPECT_THAT(mistakes(with(R"({"use": "net", "name": "ours", "trainings": []})")),
              HasSubstr("a list of 1 to 100 model"));
  EXPECT_THAT(mistakes(with(R"({"use": "net", "name": "ours", "trainings": ["a/one.onnx", 3]})")),
              HasSubstr("a list of 1 to 100 model"));
  EXPECT_THAT(
      mistakes(with(R"({"use": "net", "name": "ours", "trainings": ["a/one.onnx"], "parameters": {"model": "x"}})")),
      HasSubstr("'trainings' sets this parameter"));
  EXPECT_THAT(
      mistakes(with("{\"use\": \"net\", \"name\": \"ours\",\n \"trainings\": [\"a/one.onnx\",\n  \"none.onnx\"]}")),
      AllOf(HasSubstr("quick.json:3:3"), HasSubstr("none.onnx")));
  EXPECT_THAT(mistakes(with(R"({"use": "net", "name": "ours", "trainings": ["a/one.onnx", "a/../a/one.onnx"]})")),
              HasSubstr("duplicate of the model at"));
  EXPECT_THAT(mistakes(with(R"({"use": "nte", "name": "ours", "trainings": ["a/one.onnx"]})")),
              HasSubstr("did you mean 'net'"));
  EXPECT_THAT(mistakes(R"({"scenes": [{"use": "toy", "name": "x", "trainings": ["a"]}], "noise_levels": ["rho0"],
                           "algorithms": ["home"]})"),
              HasSubstr("unknown key"));
}

TEST_F(SuiteReaderTest, ReportsAllMistakesWithPosition) {
  const std::string found = mistakes(R"({
  "scenes": ["toy"],
  "noise_levels": ["rho1"],
  "algoritms": [],
  "algorithms": [
    "bo-pg",
    {"use": "bo-gp", "name": "x", "parameters": {"kapa": 1}, "stepz": 3},
    {"use": "bo-gp", "name": "y", "parameters": {"kappa": -1}, "steps": 0}
  ],
  "protocol": "papier",
  "instances": 0
})");
  EXPECT_THAT(found, HasSubstr("quick.json:3:20: /noise_levels/0: unknown"));
  EXPECT_THAT(found, HasSubstr("quick.json:4:16: /algoritms: unknown key 'algoritms'; did you mean 'algorithms'?"));
  EXPECT_THAT(found, AllOf(HasSubstr("quick.json:6:5: /algorithms/0: unknown"), HasSubstr("did you mean 'bo-gp'?")));
  EXPECT_THAT(found, HasSubstr("quick.json:7:58: /algorithms/1/parameters/kapa: "));
  EXPECT_THAT(found, HasSubstr("quick.json:7:71: /algorithms/1/stepz: unknown key 'stepz'; did you mean 'steps'?"));
  EXPECT_THAT(found, HasSubstr("quick.json:8:59: /algorithms/2/parameters/kappa: "));
  EXPECT_THAT(found, HasSubstr("quick.json:8:73: /algorithms/2/steps: expected an integer from 1"));
  EXPECT_THAT(found, HasSubstr("quick.json:10:15: /protocol: found 'papier'; allowed: paper, blind; did you mean "
                               "'paper'?"));
  EXPECT_THAT(found, HasSubstr("quick.json:11:16: /instances: expected an integer from 1"));
  EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 8);
  EXPECT_LT(found.find("quick.json:7:58"), found.find("quick.json:7:71"));  // in the file's order
  EXPECT_LT(found.find("quick.json:8:73"), found.find("quick.json:10:15"));
}

TEST_F(SuiteReaderTest, NamesEachMistake) {
  EXPECT_THAT(mistakes("[]"), HasSubstr("expected an object, found array"));
  EXPECT_THAT(mistakes("{"), HasSubstr("quick.json:1:"));
  EXPECT_THAT(mistakes("{}"), AllOf(HasSubstr("missing key 'scenes'"), HasSubstr("missing key 'noise_levels'"),
                                    HasSubstr("missing key 'algorithms'")));
  EXPECT_THAT(mistakes(with("")), HasSubstr("/algorithms: expected at least one entry"));
  EXPECT_THAT(mistakes(with("3")), HasSubstr("/algorithms/0: expected an id, a path or an object"));
  EXPECT_THAT(mistakes(with("{}")), HasSubstr("missing key 'use'"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "parameters": 3})")), HasSubstr("/parameters: expected an object"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "parameters": {"kappa": 3}})")),
              HasSubstr("changed parameters need a 'name'"));
  EXPECT_THAT(mistakes(with(R"("bo-gp", "bo_gp")")),
              HasSubstr("duplicate name 'bo-gp', already used by /algorithms/0"));
  EXPECT_THAT(mistakes(with(R"("bo-gp", {"use": "home", "name": "bo-gp"})")), HasSubstr("duplicate name"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "name": "a/b"})")), HasSubstr("slashes"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "name": " "})")), HasSubstr("must not be empty"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "name": "bo-gp "})")), HasSubstr("begin or end with a space"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "name": ""})")), HasSubstr("must not be empty"));
  EXPECT_THAT(mistakes(with(R"({"use": "bo-gp", "merit": "rms"})")), HasSubstr("did you mean 'rmse'?"));
  EXPECT_THAT(mistakes(with(R"("rho0")")), HasSubstr("noise level"));
  EXPECT_THAT(mistakes(with(R"("./missing.so")")), HasSubstr("does not exist"));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "spec": {"rms": 1})")), HasSubstr("did you mean 'rmse'?"));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "spec": {"mtf": {}})")), HasSubstr("missing key 'lp_per_mm'"));
  for (const char* targets : {"[]", "0.1", "[0.1, \"0.05\"]", "[0.1, 0.1]", "[0.05, 0.1]", "[0.1, 0]"})
    EXPECT_THAT(mistakes(with("\"bo-gp\"", std::string(R"(, "targets": )") + targets)), HasSubstr("descending list"))
        << targets;
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "machine_time": {"settle": 1})")),
              HasSubstr("/machine_time/settle: unknown key"));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "cycle": {"load_s": -1, "cure": 3, "computing": 1})")),
              AllOf(HasSubstr("/cycle/load_s"), HasSubstr("/cycle/cure: unknown key"), HasSubstr("/cycle/computing")));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "cost": {"module": -1, "baseline": 3, "parts": 2})")),
              AllOf(HasSubstr("missing key 'station_per_hour'"), HasSubstr("/cost/module"), HasSubstr("/cost/baseline"),
                    HasSubstr("/cost/parts: unknown key")));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "cost": {"station_per_hour": 60, "baseline": "bo-gb"})")),
              HasSubstr("/cost/baseline: unknown algorithm 'bo-gb' in this suite; did you mean 'bo-gp'?"));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "machine_time": {"speed_mm_per_s": 0})")),
              HasSubstr("/machine_time/speed_mm_per_s: expected a number"));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "limits": "none")")), HasSubstr("allowed: soft, hard"));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "seed": -1)")), HasSubstr("/seed"));
  EXPECT_THAT(mistakes(with("\"bo-gp\"", R"(, "name": "../up")")), HasSubstr("/name"));
}

TEST_F(SuiteReaderTest, RejectsProtocolOfScenesAndLevels) {
  EXPECT_THAT(mistakes(R"({"scenes": [{"use": "toy", "protocol": "blind"}], "noise_levels": ["rho0"],
                           "algorithms": ["bo-gp"]})"),
              HasSubstr("/scenes/0/protocol: unknown key"));
}

// Two names for one noise level would run and show the same trials twice.
TEST_F(SuiteReaderTest, RejectsDuplicateNoiseLevels) {
  EXPECT_THAT(mistakes(R"({"scenes": ["toy"], "algorithms": ["bo-gp"],
      "noise_levels": ["rho0.5", {"use": "rho", "name": "half", "parameters": {"width": 0.5}}]})"),
              HasSubstr("/noise_levels/1: duplicate of /noise_levels/0"));
}

TEST_F(SuiteReaderTest, ReportsMissingFileAsIoError) {
  try {
    read_suite(folder_ / "missing.json", catalog_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
    EXPECT_THAT(error.what(), HasSubstr("missing.json"));
  }
}

TEST_F(SuiteReaderTest, BoundsTrialsAndNames) {
  EXPECT_THAT(mistakes(R"({"scenes": [")" + std::string(1 << 20, 'x') +
                       R"("], "noise_levels": ["rho0"], "algorithms": ["compass"]})"),
              HasSubstr("an id or a path has at most 4096 characters, found 1048576"));
  std::string many;
  for (int i = 0; i < 12; ++i)
    many += (i ? ", " : "") + std::string(R"({"use": "bo-gp", "name": "c)") + std::to_string(i) + "\"}";
  EXPECT_THAT(mistakes(with(many, R"(, "instances": 1000000)")),
              HasSubstr("1.40e+07 trials: 1 scenes x 1 noise levels x 14 methods"));
}

}  // namespace
}  // namespace relign::suites
