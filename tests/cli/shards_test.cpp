// plan, run --plan, merge and verify on the command line.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "resealed.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class CliShards : public testing::Test {
 protected:
  void SetUp() override { place_.write("suites/tiny.json", kSmallestSuite); }
  Outcome call(const std::vector<std::string>& arguments) { return relign_bench(place_, arguments); }
  Workplace place_;
};

TEST_F(CliShards, MergedShardsEqualOneRun) {
  ASSERT_EQ(call({"run", "suites/tiny.json", "-o", "one"}).exit_code, 0);
  const Outcome plan = call({"plan", "suites/tiny.json", "-o", "plan.json", "--shards", "3"});
  ASSERT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, AllOf(HasSubstr("trials   8"), HasSubstr("shards   3, of 2 to 4 trials")));
  EXPECT_THAT(plan.err, HasSubstr("relign-bench run --plan plan.json --shard 0/3   ... 2/3"));
  for (const char* shard : {"2/3", "0/3", "1/3"}) {
    const Outcome part = call({"run", "--plan", "plan.json", "--shard", shard});
    ASSERT_EQ(part.exit_code, 0) << part.err;
    EXPECT_THAT(part.out, HasSubstr("results/tiny/shard-000"));
  }
  EXPECT_THAT(call({"run", "--plan", "plan.json", "--shard", "1/3"}).err, HasSubstr("2 trials"));
  const Outcome merged = call({"merge", "results/tiny", "-o", "merged"});
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_THAT(merged.out, AllOf(HasSubstr("trials   8"), HasSubstr("shards   3 of 3")));
  EXPECT_EQ(place_.read("merged/trials/0000.jsonl"), place_.read("one/trials/0000.jsonl"));
  ASSERT_EQ(call({"report", "merged"}).exit_code, 0);
  EXPECT_EQ(place_.read("merged/curves.csv"), place_.read("one/curves.csv"));
  EXPECT_EQ(place_.read("merged/instances.csv"), place_.read("one/instances.csv"));
  EXPECT_THAT(call({"run", "suites/tiny.json", "-o", "merged"}).err, HasSubstr("is a merged folder"));
  const Outcome verified = call({"verify", "merged"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_THAT(verified.out, AllOf(HasSubstr("8 equal bit for bit"), HasSubstr("the results are reproduced")));
}

TEST_F(CliShards, PlanKeepsShardsApartFromAFinishedRun) {
  ASSERT_EQ(call({"run", "suites/tiny.json"}).exit_code, 0);
  const Outcome plan = call({"plan", "suites/tiny.json", "--shards", "2"});
  EXPECT_THAT(plan.err, AllOf(HasSubstr("--shard 0/2 -o results/tiny-shards   ... 1/2"),
                              HasSubstr("merge results/tiny-shards -o results/tiny-merged")));
}

TEST_F(CliShards, RejectsInvalidShardsAndPlans) {
  ASSERT_EQ(call({"plan", "suites/tiny.json", "--shards", "3"}).exit_code, 0);
  const auto refused = [&](const std::vector<std::string>& arguments) {
    const Outcome outcome = call(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(refused({"run", "--plan", "plan.json", "--shard", "0/4"}), HasSubstr("use --shard 0/3"));
  EXPECT_THAT(refused({"run", "--plan", "plan.json", "--shard", "3/3"}), HasSubstr("the last one is 2/3"));
  EXPECT_THAT(refused({"run", "--plan", "plan.json", "--shard", "one"}), HasSubstr("of the form i/n"));
  EXPECT_THAT(refused({"run", "--plan", "plan.json"}), HasSubstr("--shard"));
  EXPECT_THAT(refused({"run"}), HasSubstr("SUITE is required"));
  EXPECT_THAT(refused({"run", "suites/tiny.json", "--plan", "plan.json", "--shard", "0/3"}), HasSubstr("SUITE"));
  EXPECT_THAT(refused({"run", "--plan", "suites/tiny.json", "--shard", "0/3"}), HasSubstr("is not a plan"));
  EXPECT_THAT(refused({"plan", "suites/tiny.json", "-o", "suites/tiny.json"}), HasSubstr("is not a plan"));
  EXPECT_THAT(refused({"plan", "suites/tiny.json", "--shards", "5"}), HasSubstr("1 to 4 shards"));
}

TEST_F(CliShards, VerifyAndMergeDetectForgedRecords) {
  ASSERT_EQ(call({"run", "suites/tiny.json", "-o", "original"}).exit_code, 0);
  fs::copy(place_.path("original"), place_.path("forged"), fs::copy_options::recursive);
  std::string trials = place_.read("forged/trials/0000.jsonl");
  const std::string digit = "\"step\":2,\"commanded_pose\":[0.";
  const std::size_t at = trials.find(digit) + digit.size();
  trials[at] = trials[at] == '9' ? '8' : static_cast<char>(trials[at] + 1);
  place_.write("forged/trials/0000.jsonl", records::resealed(trials));

  const Outcome verified = call({"verify", "forged", "--json"});
  EXPECT_EQ(verified.exit_code, 4);
  const json result = json::parse(verified.out);
  EXPECT_EQ(result["verdict"], "different");
  EXPECT_EQ(result["equal"], 7);
  EXPECT_EQ(result["differences"][0]["step"], 2);
  EXPECT_EQ(result["differences"][0]["field"], "commanded_pose[0]");

  const Outcome merged = call({"merge", "original", "forged", "-o", "both", "--json"});
  EXPECT_EQ(merged.exit_code, 4);
  EXPECT_THAT(merged.err, AllOf(HasSubstr("not reproducible"), HasSubstr("step 2, commanded_pose[0]")));
  EXPECT_EQ(json::parse(merged.out)["duplicates"], 7);
  EXPECT_EQ(place_.read("both/trials/0000.jsonl"), place_.read("original/trials/0000.jsonl"));
}

TEST_F(CliShards, VerifyReplaysOneTrialWithFrames) {
  ASSERT_EQ(call({"run", "suites/tiny.json", "-o", "a", "--only", "algorithm=random"}).exit_code, 0);
  const std::string trials = place_.read("a/trials/0000.jsonl");
  const std::string id = trials.substr(10, 16);
  const Outcome shown = call({"verify", "a", "--trial", id, "--frames", "frames"});
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("4 in frames"));
  for (const char* frame : {"step-000.png", "step-003.png"}) EXPECT_TRUE(fs::exists(place_.path("frames") / frame));
  EXPECT_EQ(call({"verify", "a", "--frames", "frames"}).exit_code, 2);
  EXPECT_EQ(call({"verify", "a", "--trial", "0000000000000000"}).exit_code, 2);
  EXPECT_EQ(call({"verify", "nowhere"}).exit_code, 2);
}

}  // namespace
}  // namespace relign::cli_test
