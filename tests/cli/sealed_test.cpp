// seal, unseal, and runs of sealed suites on the command line.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class CliSealed : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome sealed = call({"seal", "-o", "secret.txt", "--json"});
    ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
    json suite = json::parse(kSmallestSuite);
    suite["name"] = "sealed";
    suite["commitment"] = json::parse(sealed.out)["commitment"];
    place_.write("sealed.json", suite.dump());
  }
  Outcome call(const std::vector<std::string>& arguments, const Options& options = {}) {
    return relign_bench(place_, arguments, options);
  }
  std::string secret() const { return place_.read("secret.txt").substr(0, 64); }
  // Everything that a run wrote as text.
  std::string all_text(const std::string& folder) const {
    std::string text;
    for (const fs::directory_entry& file : fs::recursive_directory_iterator(place_.path(folder)))
      if (file.is_regular_file()) text += place_.read(fs::relative(file.path(), place_.folder()).string());
    return text;
  }
  Workplace place_;
};

TEST_F(CliSealed, SecretIsForItsOwnerAndNeverOverwritten) {
  struct stat status = {};
  ASSERT_EQ(stat(place_.path("secret.txt").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  const Outcome again = call({"seal", "-o", "secret.txt"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("a secret that is overwritten is lost"));
}

TEST_F(CliSealed, RunNeedsTheSecretAndKeepsIt) {
  const Outcome without = call({"run", "sealed.json", "-o", "a"});
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_THAT(without.err, HasSubstr("suite 'sealed' is sealed: its instances need the secret"));
  place_.write("wrong.txt", std::string(64, '0'));
  const Outcome wrong = call({"run", "sealed.json", "-o", "a", "--secret", "wrong.txt"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("this is not the secret of suite 'sealed'"));
  EXPECT_FALSE(fs::exists(place_.path("a")));
  EXPECT_EQ(call({"validate", "sealed.json"}).exit_code, 0);

  const Outcome run = call({"run", "sealed.json", "-o", "a", "--secret", "secret.txt"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, Not(HasSubstr("relign-bench try")));
  EXPECT_THAT(all_text("a"), Not(HasSubstr(secret())));
  EXPECT_THAT(place_.read("a/trials/0000.jsonl"), HasSubstr("\"instance_seed\":\"0\""));
  ASSERT_EQ(call({"run", "sealed.json", "-o", "b"}, {{{"RELIGN_SECRET", secret()}}}).exit_code, 0);
  EXPECT_EQ(place_.read("b/trials/0000.jsonl"), place_.read("a/trials/0000.jsonl"));

  // Another secret draws other instances.
  const std::string commitment = json::parse(place_.read("sealed.json"))["commitment"];
  const std::string other = json::parse(call({"seal", "-o", "third.txt", "--json"}).out)["commitment"];
  std::string suite = place_.read("sealed.json");
  suite.replace(suite.find(commitment), commitment.size(), other);
  place_.write("third.json", suite);
  ASSERT_EQ(call({"run", "third.json", "-o", "c", "--secret", "third.txt"}).exit_code, 0);
  const auto start = [&](const char* folder) {
    const std::string lines = place_.read(std::string(folder) + "/trials/0000.jsonl");
    return json::parse(lines.substr(0, lines.find('\n')))["true_pose"];
  };
  EXPECT_NE(start("c"), start("a"));
}

TEST_F(CliSealed, AnybodyCanVerifyOnceTheSecretIsPublished) {
  ASSERT_EQ(call({"run", "sealed.json", "-o", "a", "--secret", "secret.txt"}).exit_code, 0);
  const Outcome early = call({"verify", "a"});
  EXPECT_EQ(early.exit_code, 2);
  EXPECT_THAT(early.err, HasSubstr("these results are sealed"));
  EXPECT_THAT(call({"verify", "a", "--secret", "secret.txt"}).out, HasSubstr("the results are reproduced"));
  place_.write("wrong.txt", std::string(64, '0'));
  EXPECT_THAT(call({"unseal", "a", "--secret", "wrong.txt"}).err, HasSubstr("this is not the secret of 'a'"));
  EXPECT_THAT(call({"unseal", "a"}).err, HasSubstr("'a' is sealed: its instances need the secret"));

  ASSERT_EQ(call({"unseal", "a", "--secret", "secret.txt"}).exit_code, 0);
  EXPECT_EQ(json::parse(place_.read("a/manifest.json"))["secret"], secret());
  const Outcome verified = call({"verify", "a"});
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_THAT(verified.out, AllOf(HasSubstr("8 equal bit for bit"), HasSubstr("the results are reproduced")));
  // A later run of the same folder does not take it back.
  ASSERT_EQ(call({"run", "sealed.json", "-o", "a", "--secret", "secret.txt"}).exit_code, 0);
  EXPECT_EQ(json::parse(place_.read("a/manifest.json"))["secret"], secret());
  ASSERT_EQ(call({"report", "a"}).exit_code, 0);
  EXPECT_THAT(place_.read("a/report.html"), HasSubstr(secret()));
}

// A plan of a sandbox is run in one, and the advice of unseal can be pasted into a shell.
TEST_F(CliSealed, PlansAndAdviceKeepTheSandbox) {
  const Outcome planned = call({"plan", "sealed.json", "--sandbox"});
  if (planned.err.find("not possible on this machine") != std::string::npos) GTEST_SKIP() << planned.err;
  ASSERT_EQ(planned.exit_code, 0) << planned.err;
  const std::vector<std::string> run = {"run", "--plan", "plan.json", "--shard", "0/1", "--secret", "secret.txt"};
  const Outcome open = call(run);
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_THAT(open.err,
              HasSubstr("--plan: 'plan.json' was made with --sandbox, so that its algorithms run in a sandbox "
                        "only; add --sandbox"));
  EXPECT_FALSE(fs::exists(place_.path("results")));
  EXPECT_THAT(call({"slurm", "script", "--plan", "plan.json"}).out, HasSubstr("\n  --sandbox\n"));
  std::vector<std::string> inside = run;
  inside.insert(inside.end(), {"--sandbox", "-o", "it's mine"});
  ASSERT_EQ(call(inside).exit_code, 0);
  ASSERT_EQ(call({"merge", "it's mine", "-o", "all of it"}).exit_code, 0);
  const Outcome unsealed = call({"unseal", "all of it", "--secret", "secret.txt"});
  EXPECT_THAT(unsealed.err, HasSubstr("relign-bench verify 'all of it' --sandbox\n"));
  EXPECT_THAT(shell(place_, "\"$RELIGN_BENCH\" verify 'all of it' --sandbox").out,
              HasSubstr("the results are reproduced"));

  ASSERT_EQ(call({"plan", "sealed.json", "-o", "open.json"}).exit_code, 0);
  EXPECT_THAT(call({"slurm", "script", "--plan", "open.json"}).out, Not(HasSubstr("--sandbox")));
  ASSERT_EQ(call({"run", "sealed.json", "-o", "open", "--secret", "secret.txt"}).exit_code, 0);
  EXPECT_THAT(call({"unseal", "open", "--secret", "secret.txt"}).err, HasSubstr("relign-bench verify open\n"));
}

TEST_F(CliSealed, OpenResultsCannotPassAsSealed) {
  place_.write("open.json", kSmallestSuite);
  ASSERT_EQ(call({"run", "open.json", "-o", "a"}).exit_code, 0);
  json manifest = json::parse(place_.read("a/manifest.json"));
  manifest["commitment"] = json::parse(place_.read("sealed.json"))["commitment"];
  manifest["secret"] = secret();
  place_.write("a/manifest.json", manifest.dump());
  for (const char* verb : {"verify", "report"}) {
    const Outcome outcome = call({verb, "a"});
    EXPECT_EQ(outcome.exit_code, 2) << verb;
    EXPECT_THAT(outcome.err, HasSubstr("the suite is open, since it has no commitment")) << verb;
  }
}

TEST_F(CliSealed, NothingIsRemovedOrAddedAfterTheRun) {
  place_.write("open.json", R"({"scenes": ["gaussian_spot"], "noise_levels": ["none"], "instances": 2, "steps": 2,
                                "algorithms": ["random", "nlopt-bobyqa"]})");
  ASSERT_EQ(call({"run", "open.json", "-o", "a"}).exit_code, 0);
  ASSERT_EQ(call({"verify", "a"}).exit_code, 0);
  const json honest = json::parse(place_.read("a/manifest.json"));
  const auto refusal = [&](const auto& change) {
    json manifest = honest;
    change(manifest);
    place_.write("a/manifest.json", manifest.dump());
    const Outcome outcome = call({"verify", "a"});
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(refusal([](json& manifest) {
                manifest["order"].erase(0);
                manifest["trials"] = manifest["order"].size();
              }),
              HasSubstr("but 'order' has"));
  EXPECT_THAT(refusal([](json& manifest) { manifest["instances"] = 1; }), HasSubstr("'instances' is 2 in the suite"));
  EXPECT_THAT(refusal([](json& manifest) { manifest["first_instance"] = 1; }),
              HasSubstr("'first_instance' is 0 in the suite and 1"));
  EXPECT_THAT(refusal([](json& manifest) { manifest["algorithms"].erase(1); }),
              HasSubstr("the suite has 2 'algorithms', the manifest 1"));
  EXPECT_THAT(refusal([](json& manifest) { manifest["algorithms"][1]["observes"] = json::array({"merit"}); }),
              HasSubstr("observes [\"merit\"] by the manifest"));
  EXPECT_THAT(
      refusal([](json& manifest) { manifest["algorithms"][1]["oracle"] = true; }),
      HasSubstr("'nlopt-bobyqa' (protocol paper) is marked as an oracle, but this protocol gives the true start"));
  EXPECT_THAT(refusal([](json& manifest) { manifest["algorithms"][1]["parameters"]["first_step"] = 0.5; }),
              HasSubstr("'parameters' of the algorithm 'nlopt-bobyqa' is"));
  EXPECT_THAT(refusal([](json& manifest) { manifest["limits"] = "hard"; }),
              HasSubstr("'limits' is \"soft\" in the suite"));
  EXPECT_THAT(refusal([](json& manifest) {
                manifest["spec"] = {{"rmse", 0.5}};
              }),
              HasSubstr("'spec' is null in the suite"));
  EXPECT_THAT(refusal([](json& manifest) { manifest["instance_set"] = std::string(16, '0'); }),
              HasSubstr("'instance_set' is '0000000000000000'"));
  EXPECT_THAT(refusal([](json& manifest) {
                json suite = json::parse(manifest["suite"].get<std::string>());
                suite["analysis"] = {{"primary", "rmse"}};
                manifest["suite"] = suite.dump();
              }),
              HasSubstr("the suite has an analysis plan, the manifest has none"));
}

TEST_F(CliSealed, VerifyNamesOtherBuildsOfPlugins) {
  place_.write("open.json", R"({"scenes": ["gaussian_spot"], "noise_levels": ["none"], "instances": 2, "steps": 2,
                                "algorithms": ["random"]})");
  ASSERT_EQ(call({"run", "open.json", "-o", "a"}).exit_code, 0);
  json manifest = json::parse(place_.read("a/manifest.json"));
  manifest["algorithms"][0]["plugin_hash"] = std::string(64, 'b');
  place_.write("a/manifest.json", manifest.dump());
  const Outcome verified = call({"verify", "a"});
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_THAT(verified.out, AllOf(HasSubstr("changed    plugin random: was bbbbbbbbbbbbbbbb, is "),
                                  HasSubstr("the results are reproduced; they were recorded with other builds")));
}

TEST_F(CliSealed, ShardsOfASealedPlanMergeToTheSameResults) {
  ASSERT_EQ(call({"run", "sealed.json", "-o", "one", "--secret", "secret.txt"}).exit_code, 0);
  ASSERT_EQ(call({"plan", "sealed.json", "--shards", "2"}).exit_code, 0);
  for (const char* shard : {"0/2", "1/2"}) {
    const Outcome part = call({"run", "--plan", "plan.json", "--shard", shard, "--secret", "secret.txt"});
    ASSERT_EQ(part.exit_code, 0) << part.err;
  }
  ASSERT_EQ(call({"merge", "results/sealed", "-o", "merged"}).exit_code, 0);
  EXPECT_EQ(place_.read("merged/trials/0000.jsonl"), place_.read("one/trials/0000.jsonl"));
  ASSERT_EQ(call({"unseal", "merged", "--secret", "secret.txt"}).exit_code, 0);
  EXPECT_THAT(call({"verify", "merged"}).out, HasSubstr("the results are reproduced"));
}

TEST_F(CliSealed, UnsealedSuitesTakeNoSecret) {
  place_.write("plain.json", kSmallestSuite);
  EXPECT_THAT(call({"run", "plain.json", "--secret", "secret.txt"}).err, HasSubstr("is not sealed"));
  place_.write(
      "bad.json",
      R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "algorithms": ["compass"], "commitment": "sha256:1"})");
  EXPECT_THAT(call({"run", "bad.json"}).err, HasSubstr("expected \"sha256:\" and 64 hexadecimal digits"));
}

}  // namespace
}  // namespace relign::cli_test
