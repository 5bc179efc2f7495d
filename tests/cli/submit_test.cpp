// relign-bench submit: from a folder to an evaluation, and archives that a stranger may send.
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "harness/submissions/hostile_archives.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using submissions_test::ArchiveMaker;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const char* const kBoard = R"({"name": "board", "scenes": ["gaussian_spot"], "noise_levels": ["rho0"],
  "algorithms": ["nlopt-sbplx"], "instances": 2, "steps": 4})";

class CliSubmit : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed";
    if (const Outcome doctor =
            call({"try", "random", "--scene", "gaussian_spot", "--noise-level", "none", "--steps", "1", "--sandbox"});
        doctor.err.find("not possible on this machine") != std::string::npos)
      GTEST_SKIP() << doctor.err;
    fs::create_directories(place_.path("sub"));
    fs::copy_file(RELIGN_SOURCE_DIR "/examples/compass_python/compass.py", place_.path("sub/compass.py"));
    write_manifest(json::object());
    place_.write("board.json", kBoard);
  }
  void write_manifest(const json& changes) const {
    json manifest = {{"name", "ours"},
                     {"version", "1.0"},
                     {"summary", "Compass search."},
                     {"authors", {"A. Nonymous"}},
                     {"licence", "Apache-2.0"},
                     {"plugin", "compass.py"},
                     {"algorithm", {{"use", "compass"}, {"parameters", {{"first_stride", 0.2}}}}}};
    manifest.update(changes);
    place_.write("sub/submission.json", manifest.dump());
  }
  Outcome call(const std::vector<std::string>& arguments) { return relign_bench(place_, arguments); }
  Outcome pack(const std::string& archive = "ours.tar.gz") { return call({"submit", "pack", "sub", "-o", archive}); }
  Outcome evaluate(const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {"submit", "evaluate", "ours.tar.gz", "--suite", "board.json", "-o", "ev"};
    command.insert(command.end(), more.begin(), more.end());
    return call(command);
  }
  // Expects one sentence, exit code 2, and no folder.
  void expect_refused(const Outcome& outcome, const std::string& words) const {
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, AllOf(testing::StartsWith("error: "), HasSubstr(words)));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(place_.path("ev")));
  }
  json read_json(const std::string& file) const { return json::parse(place_.read(file)); }
  Workplace place_;
};

TEST_F(CliSubmit, PacksEvaluatesAndVerifies) {
  const Outcome packed = pack();
  ASSERT_EQ(packed.exit_code, 0) << packed.err;
  EXPECT_THAT(packed.out, HasSubstr("compass.py, submission.json"));
  EXPECT_THAT(packed.err, HasSubstr("The self-test passed."));
  const std::string bytes = place_.read("ours.tar.gz");
  ASSERT_EQ(pack().exit_code, 0);
  EXPECT_EQ(place_.read("ours.tar.gz"), bytes);

  const Outcome done = evaluate();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(place_.read("ev/submission.json"), place_.read("sub/submission.json"));
  const json evaluation = read_json("ev/evaluation.json");
  EXPECT_EQ(evaluation["format"], "relign-bench/evaluation/1");
  EXPECT_EQ(evaluation["sandbox"], true);
  EXPECT_EQ(evaluation["sealed"], false);
  EXPECT_EQ(evaluation["class"], json({"box", "merit", "start"}));
  EXPECT_EQ(evaluation["budget"]["steps"], 4);
  EXPECT_EQ(evaluation["suite"]["instance_set"], read_json("ev/results/manifest.json")["instance_set"]);
  EXPECT_TRUE(read_json("ev/results/manifest.json").contains("sandbox"));
  ASSERT_EQ(evaluation["methods"].size(), 4U);
  for (const json& method : evaluation["methods"]) EXPECT_EQ(method["submitted"], method["name"] == "ours");
  EXPECT_FALSE(fs::exists(place_.path("ev/run")));
  EXPECT_FALSE(fs::exists(place_.path("ev/archive.sha256")));
  const Outcome verified = call({"verify", "ev/results", "--sandbox"});
  EXPECT_THAT(verified.out, AllOf(HasSubstr("8 equal bit for bit"), HasSubstr("the results are reproduced")));
  // Elsewhere, with another path.
  fs::rename(place_.path("ev"), place_.path("moved"));
  EXPECT_THAT(call({"verify", "moved/results", "--sandbox", "--suite-folder", "moved"}).out,
              HasSubstr("the results are reproduced"));
}

TEST_F(CliSubmit, JoinsBaselinesWhichDoNotRunAgain) {
  ASSERT_EQ(pack().exit_code, 0);
  ASSERT_EQ(call({"run", "board.json", "-o", "baselines", "--sandbox"}).exit_code, 0);
  ASSERT_EQ(evaluate().exit_code, 0);
  fs::rename(place_.path("ev"), place_.path("all"));
  const Outcome joined = evaluate({"--baselines", "baselines", "--json"});
  ASSERT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_EQ(json::parse(joined.out)["trials"], 2);
  EXPECT_EQ(place_.read("ev/results/trials/0000.jsonl").size(), place_.read("all/results/trials/0000.jsonl").size());
  EXPECT_EQ(read_json("ev/evaluation.json")["methods"].size(), 4U);
  EXPECT_TRUE(read_json("ev/results/manifest.json").contains("sandbox"));
  EXPECT_THAT(call({"verify", "ev/results", "--sandbox"}).out, HasSubstr("the results are reproduced"));
}

TEST_F(CliSubmit, BaselinesHaveTheSameInstances) {
  ASSERT_EQ(pack().exit_code, 0);
  json other = json::parse(kBoard);
  other["seed"] = 2;
  place_.write("other.json", other.dump());
  ASSERT_EQ(call({"run", "other.json", "-o", "baselines"}).exit_code, 0);
  expect_refused(evaluate({"--baselines", "baselines"}), "'baselines' has other instances than the suite");
}

TEST_F(CliSubmit, BaselinesHaveTheSamePrices) {
  ASSERT_EQ(pack().exit_code, 0);
  json other = json::parse(kBoard);
  other["cost"] = {{"station_per_hour", 60}};
  place_.write("other.json", other.dump());
  ASSERT_EQ(call({"run", "other.json", "-o", "baselines"}).exit_code, 0);
  const Outcome refused = evaluate({"--baselines", "baselines"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("cannot merge"), HasSubstr("cost"), Not(HasSubstr("of 2 trials"))));
  EXPECT_FALSE(fs::exists(place_.path("ev")));
}

TEST_F(CliSubmit, BaselinesHaveTheSameProtocol) {
  write_manifest({{"algorithm", {{"use", "compass"}, {"protocol", "blind"}}}});
  ASSERT_EQ(pack().exit_code, 0);
  ASSERT_EQ(call({"run", "board.json", "-o", "baselines"}).exit_code, 0);
  expect_refused(evaluate({"--baselines", "baselines"}),
                 "the submission 'ours' has the protocol 'blind', the baselines 'paper'");
}

TEST_F(CliSubmit, SealedSuitesNeedTheSecret) {
  ASSERT_EQ(pack().exit_code, 0);
  json suite = json::parse(kBoard);
  suite["commitment"] = json::parse(call({"seal", "-o", "secret.txt", "--json"}).out)["commitment"];
  place_.write("board.json", suite.dump());
  expect_refused(evaluate(), "is sealed: its instances need the secret");
  const Outcome sealed = evaluate({"--secret", "secret.txt"});
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_EQ(read_json("ev/evaluation.json")["sealed"], true);
  const std::string secret = place_.read("secret.txt").substr(0, 64);
  for (const fs::directory_entry& file : fs::recursive_directory_iterator(place_.path("ev")))
    if (file.is_regular_file()) {
      EXPECT_THAT(place_.read(fs::relative(file.path(), place_.folder())), Not(HasSubstr(secret))) << file.path();
    }
}

TEST_F(CliSubmit, HostileArchivesAreRefusedInOneSentence) {
  for (const submissions_test::Hostile& hostile : submissions_test::hostile_archives()) {
    SCOPED_TRACE(hostile.name);
    hostile.write(place_.path("ours.tar.gz"));
    expect_refused(evaluate(), hostile.refusal);
    EXPECT_FALSE(fs::exists(place_.path("escaped")));
  }
}

TEST_F(CliSubmit, HostileManifestsAreRefusedInOneSentence) {
  const auto evaluate_with = [&](const std::string& manifest, const std::string& plugin = "") {
    {
      ArchiveMaker maker(place_.path("ours.tar.gz"));
      maker.add("notes.txt");
      if (!manifest.empty()) maker.add("submission.json", manifest);
      if (!plugin.empty()) maker.add("mine/relign-plugin.json", plugin);
      if (!plugin.empty()) maker.add("mine/mine.so", "nothing");
    }
    return evaluate();
  };
  const auto with = [&](const json& changes) {
    write_manifest(changes);
    return place_.read("sub/submission.json");
  };
  expect_refused(evaluate_with(""), "is not a submission: it has no submission.json");
  expect_refused(evaluate_with(std::string(2'000'000, ' ')), "submission.json");
  expect_refused(evaluate_with(std::string(100'000, '[')), "nested");
  expect_refused(evaluate_with(with({{"plugin", "/etc"}})), "an absolute path is not allowed");
  expect_refused(evaluate_with(with({{"plugin", "missing.py"}})), "'missing.py' does not exist in the submission");
  expect_refused(evaluate_with(with({{"algorithm", {{"use", "../../plugin.py"}}}})), "a path must be relative");
  // A parameter's default that leads to the organiser's files, which a sandbox would show.
  place_.write("secret", "s");
  const std::string mine = with({{"plugin", "mine"}, {"algorithm", {{"use", "mine"}}}});
  expect_refused(evaluate_with(mine, R"({"id": "mine", "kind": "optimizer", "summary": "S.", "parameters": {
    "model": {"type": "file", "default": "../../../secret", "description": "D."}}})"),
                 "which is outside the submission");
  expect_refused(evaluate_with(mine, R"({"id": "mine", "kind": "scene", "summary": "S."})"), "'plugin' is a scene");
}

TEST_F(CliSubmit, SelfTestFindsFailuresAndMethodsThatCannotBeReplayed) {
  const std::string example = place_.read("sub/compass.py");
  std::string broken = example;
  broken.replace(broken.find("best, stride ="), 0, "raise RuntimeError('broken')\n        ");
  place_.write("sub/compass.py", broken);
  const Outcome failed = pack();
  EXPECT_EQ(failed.exit_code, 2);
  EXPECT_THAT(failed.err, AllOf(HasSubstr("self-test of 'ours'"), HasSubstr("broken")));
  EXPECT_FALSE(fs::exists(place_.path("ours.tar.gz")));
  std::string random = example;
  random.replace(random.find("stride = trial.first, self.first_stride"), 39,
                 "stride = trial.first, __import__('random').random() / 3");
  place_.write("sub/compass.py", random);
  EXPECT_THAT(pack().err, HasSubstr("a second trial differs"));
}

TEST_F(CliSubmit, NetworksNeedNoPlugin) {
  const std::string imitation = RELIGN_SOURCE_DIR "/plugins/agents/imitation/imitation.onnx";
  ASSERT_EQ(call({"plugin", "new", "--kind", "agent", "--onnx", imitation, "net"}).exit_code, 0);
  const json test = {{"scene", "relign_od"}, {"noise_level", "rho0"}, {"steps", 1}};
  write_manifest({{"algorithm", {{"use", "net.json"}}}, {"self_test", test}, {"training", {{"hours", 2}}}});
  json manifest = read_json("sub/submission.json");
  manifest.erase("plugin");
  place_.write("net/submission.json", manifest.dump());
  const Outcome packed = call({"submit", "pack", "net", "-o", "ours.tar.gz"});
  ASSERT_EQ(packed.exit_code, 0) << packed.err;
  json suite = json::parse(kBoard);
  suite["scenes"] = {"relign_od"};
  suite["instances"] = suite["steps"] = 1;
  place_.write("board.json", suite.dump());
  const Outcome done = evaluate();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(read_json("ev/evaluation.json")["class"], json({"images"}));
  for (const json& method : read_json("ev/evaluation.json")["methods"])
    EXPECT_EQ(method["training"], method["submitted"] ? json({{"hours", 2}}) : json());
  EXPECT_THAT(call({"verify", "ev/results", "--sandbox"}).out, HasSubstr("the results are reproduced"));
}

TEST_F(CliSubmit, EnvironmentIsChecked) {
  place_.write("sub/requirements.lock", "relign-no-such-package==1.0\n");
  write_manifest({{"environment", "requirements.lock"}});
  EXPECT_THAT(pack().err, HasSubstr("'python3' lacks packages of 'requirements.lock': relign-no-such-package 1.0 (not "
                                    "installed)"));
  place_.write("sub/requirements.lock", "# nothing\n");
  EXPECT_EQ(pack().exit_code, 0);
}

TEST_F(CliSubmit, OtherFoldersAreLeftAlone) {
  ASSERT_EQ(pack().exit_code, 0);
  place_.write("ev/notes.txt", "precious");
  const Outcome outcome = evaluate();
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("already exists and is not an interrupted evaluation"));
  EXPECT_EQ(place_.read("ev/notes.txt"), "precious");
  EXPECT_THAT(call({"submit", "pack", "sub", "-o", "ours.zip"}).err, HasSubstr("ends in .tar.zst, .tar.gz or .tar"));
}

TEST_F(CliSubmit, InterruptedEvaluationResumes) {
  ASSERT_EQ(pack().exit_code, 0);
  json suite = json::parse(kBoard);
  suite["instances"] = 60;
  suite["algorithms"] = json::array({"random"});
  place_.write("board.json", suite.dump());
  Running first(place_, {RELIGN_PROGRAM, "submit", "evaluate", "ours.tar.gz", "--suite", "board.json", "-o", "ev",
                         "--jobs", "1"});
  while (!first.ended() && !fs::exists(place_.path("ev/run/trials/0000.jsonl"))) usleep(1000);
  first.send(SIGTERM);
  const Outcome stopped = first.wait();
  ASSERT_EQ(stopped.exit_code, 75) << stopped.err;
  EXPECT_FALSE(fs::exists(place_.path("ev/evaluation.json")));
  const Outcome done = evaluate({"--json"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(json::parse(done.out)["trials"], 180);
  EXPECT_EQ(json::parse(done.out)["failed"], 0);
}

// As if killed while it wrote the report.
TEST_F(CliSubmit, ResumesAfterItsResultsWereInPlace) {
  ASSERT_EQ(pack().exit_code, 0);
  const Outcome first = evaluate({"--json"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const std::string trials = place_.read("ev/results/trials/0000.jsonl");
  fs::remove(place_.path("ev/evaluation.json"));
  place_.write("ev/archive.sha256", json::parse(first.out)["archive_sha256"].get<std::string>());
  const Outcome again = evaluate();
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(place_.read("ev/results/trials/0000.jsonl"), trials);
  EXPECT_TRUE(fs::exists(place_.path("ev/evaluation.json")));
  EXPECT_FALSE(fs::exists(place_.path("ev/run")));
}

}  // namespace
}  // namespace relign::cli_test
