// Plans in files, their shards, and attempts at one shard.
#include "records/merge.h"
#include "runner/frozen_plan.h"
#include "runner/shard_attempt.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ShardTest : public ToyTest {
 protected:
  FrozenPlan freeze_as(const std::string& name, const PreparedPlan& plan, unsigned shards) {
    write_file_atomically(folder_ / name, json_of(freeze(plan, shards, folder_)).dump(1));
    return read_plan(folder_ / name);
  }
  // Like the verb: runs the remaining trials of the shard.
  RunSummary run_part(PreparedPlan plan, const FrozenPlan& frozen, unsigned shard, const std::string& name,
                      const std::atomic<bool>* stop = nullptr) {
    const ShardAttempt attempt(folder_ / name, shard, frozen.hash, {});
    std::vector<suites::PlannedTrial> part;
    for (const std::size_t place : places_of_shard(plan.plan, shard, frozen.shards))
      if (!attempt.done_elsewhere().count(plan.plan.trials[place].id)) part.push_back(plan.plan.trials[place]);
    plan.plan.trials = part;
    plan.shard = records::Shard{shard, frozen.shards, frozen.hash, frozen.trials};
    RunOptions part_options = options(name);
    part_options.results = attempt.folder();
    part_options.stop = stop;
    return run(plan, part_options);
  }
  records::MergeSummary join(const std::string& name) {
    records::MergeOptions options;
    options.sources = {folder_ / name};
    options.out = folder_ / (name + "-merged");
    return records::merge(options);
  }
};

TEST_F(ShardTest, ShardsPartitionThePlan) {
  const suites::Plan plan = prepared(suite_text(kWalkers)).plan;
  for (const unsigned shards : {1U, 2U, 5U, 12U}) {
    std::set<std::size_t> all;
    std::map<std::pair<std::size_t, std::uint64_t>, std::set<unsigned>> parts_of_instance;
    for (unsigned shard = 0; shard < shards; ++shard)
      for (const std::size_t place : places_of_shard(plan, shard, shards)) {
        EXPECT_TRUE(all.insert(place).second);
        parts_of_instance[{plan.trials[place].level, plan.trials[place].instance}].insert(shard);
      }
    EXPECT_EQ(all.size(), 36U);
    for (const auto& [instance, parts] : parts_of_instance) EXPECT_EQ(parts.size(), 1U);
  }
}

TEST_F(ShardTest, PlansKeepThatTheyWereMadeInASandbox) {
  const PreparedPlan plan = prepared(suite_text(R"("toy-walker")"));
  const Json open = json_of(freeze(plan, 2, folder_)), sandboxed = json_of(freeze(plan, 2, folder_, true));
  EXPECT_FALSE(open.contains("sandbox")) << "as in earlier plans";
  EXPECT_NE(sandboxed["plan"], open["plan"]) << "removing it is noticed";
  write_file_atomically(folder_ / "plan.json", sandboxed.dump());
  const FrozenPlan frozen = read_plan(folder_ / "plan.json");
  EXPECT_TRUE(frozen.sandbox);
  check_unchanged(frozen, plan);
  EXPECT_FALSE(freeze_as("open.json", plan, 2).sandbox);
  Json removed = sandboxed;
  removed.erase("sandbox");
  write_file_atomically(folder_ / "plan.json", removed.dump());
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_plan(folder_ / "plan.json"); }), HasSubstr("was edited"));
}

TEST_F(ShardTest, ReadsShardIdsFromThePlanFileAlone) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  for (const unsigned shards : {1U, 5U, 7U, 12U}) {
    const FrozenPlan frozen = freeze_as("plan.json", plan, shards);
    for (unsigned shard = 0; shard < shards; ++shard) {
      std::vector<std::string> ids;
      for (const std::size_t place : places_of_shard(plan.plan, shard, shards))
        ids.push_back(plan.plan.trials[place].id);
      EXPECT_EQ(ids_of_shard(frozen, shard), ids) << shard << " of " << shards;
    }
  }
}

TEST_F(ShardTest, MergedShardsHaveTheBytesOfOneRun) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, options("one", 2));
  const auto one = contents("one");
  for (const unsigned shards : {1U, 7U}) {
    const std::string name = std::to_string(shards);
    const FrozenPlan frozen = freeze_as(name + ".json", plan, shards);
    for (unsigned shard = shards; shard-- > 0;) run_part(plan, frozen, shard, name);
    const records::MergeSummary summary = join(name);
    EXPECT_EQ(summary.trials, 36U);
    EXPECT_EQ(summary.missing, 0U);
    EXPECT_EQ(summary.shards, shards);
    EXPECT_THAT(summary.missing_shards, testing::Optional(testing::IsEmpty()));
    const auto merged = contents(name + "-merged");
    for (const auto& [file, bytes] : one)
      if (file.rfind("trials/", 0) == 0 || file.rfind("times/", 0) == 0 || file.rfind("logs/", 0) == 0) {
        EXPECT_EQ(merged.at(file), bytes) << file;
      }
    EXPECT_EQ(records::read_manifest_json(folder_ / (name + "-merged"))["order"],
              records::read_manifest_json(folder_ / "one")["order"]);
  }
}

TEST_F(ShardTest, PlanRoundTripsWithItsSuite) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  fs::create_directories(folder_ / "sub");
  write_file_atomically(folder_ / "sub/plan.json", json_of(freeze(plan, 4, folder_ / "sub")).dump());
  const FrozenPlan frozen = read_plan(folder_ / "sub/plan.json");
  EXPECT_EQ(frozen.shards, 4U);
  EXPECT_EQ(frozen.trials, 36U);
  EXPECT_EQ(frozen.suite, suite_text(kWalkers));
  EXPECT_EQ(fs::weakly_canonical(frozen.folder()), fs::weakly_canonical(fs::current_path()));
  std::string ids;
  for (const suites::PlannedTrial& trial : plan.plan.trials) ids += trial.id;
  std::string frozen_ids;
  for (const PlanBlock& block : frozen.blocks) frozen_ids += block.ids;
  EXPECT_EQ(frozen_ids, ids);
  check_unchanged(frozen, plan);
  EXPECT_NE(freeze(plan, 5, folder_).hash, frozen.hash);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { freeze(plan, 13, folder_); }), HasSubstr("1 to 12 shards"));
}

TEST_F(ShardTest, RejectsChangedPluginOrSuiteAndNamesTheChange) {
  const FrozenPlan frozen = freeze_as("plan.json", prepared(suite_text(kWalkers)), 2);
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [&] { check_unchanged(frozen, prepared(suite_text(kWalkers), "toy_walker_changed")); }),
              AllOf(HasSubstr("plan.json"), HasSubstr("algorithm 'toy-walker', plugin_hash: was")));
  EXPECT_THAT(
      error_text(ErrorKind::bad_input, [&] { check_unchanged(frozen, prepared(suite_text(R"("toy-walker")"))); }),
      HasSubstr("'short-walker' was removed"));
}

TEST_F(ShardTest, RejectsDamagedAndNewerPlans) {
  Json content = json_of(freeze(prepared(suite_text(R"("toy-walker")")), 2, folder_));
  const auto refused = [&](const Json& text) {
    write_file_atomically(folder_ / "plan.json", text.is_string() ? text.get<std::string>() : text.dump());
    return error_text(ErrorKind::bad_input, [&] { read_plan(folder_ / "plan.json"); });
  };
  EXPECT_THAT(refused(Json(content.dump().substr(0, 200))), HasSubstr("is not a plan"));
  EXPECT_THAT(refused(Json(suite_text(kWalkers))), HasSubstr("is not a plan"));
  Json changed = content;
  changed["shards"] = 3;
  EXPECT_THAT(refused(changed), HasSubstr("was edited"));
  changed = content;
  changed.erase("suite");
  EXPECT_THAT(refused(changed), HasSubstr("'suite'"));
  changed = content;
  changed["format"] = 2;
  EXPECT_THAT(refused(changed), HasSubstr("newer"));
  EXPECT_THAT(error_text(ErrorKind::io, [&] { read_plan(folder_ / "none.json"); }), HasSubstr("none.json"));
}

TEST_F(ShardTest, ConcurrentAttemptsHaveSeparateFolders) {
  fs::path first, second;
  {
    const ShardAttempt a(folder_ / "r", 3, "hash", {});
    const ShardAttempt b(folder_ / "r", 3, "hash", {});
    first = a.folder();
    second = b.folder();
    EXPECT_NE(first, second);
    EXPECT_THAT(first.filename().string(), testing::StartsWith("shard-0003."));
    EXPECT_NE(ShardAttempt(folder_ / "r", 4, "hash", {}).folder(), first);
  }
  EXPECT_EQ(ShardAttempt(folder_ / "r", 3, "hash", {}).folder(), first);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "r"), fs::directory_iterator()), 0);
}

TEST_F(ShardTest, AttemptOnAnotherMachineRunsRemainingTrials) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  const FrozenPlan frozen = freeze_as("plan.json", plan, 2);
  EXPECT_EQ(run_part(plan, frozen, 0, "r").finished, 18U);
  // Simulates another machine, which died before it had finished.
  const fs::path own = ShardAttempt(folder_ / "r", 0, frozen.hash, {}).folder();
  const fs::path dead = folder_ / "r/shard-0000.dead-abc123";
  fs::rename(own, dead);
  const std::string text = read_file(dead / "trials/0000.jsonl");
  std::size_t cut = 0;
  for (int closing = 0; closing < 10; ++closing) cut = text.find("\n", text.find("\"end\":", cut)) + 1;
  write_file_atomically(dead / "trials/0000.jsonl", text.substr(0, cut + 40));
  EXPECT_EQ(run_part(plan, frozen, 0, "r").trials, 8U);
  EXPECT_EQ(run_part(plan, frozen, 0, "r").reused, 8U);  // and continues in its own folder
  run_part(plan, frozen, 1, "r");
  const records::MergeSummary summary = join("r");
  EXPECT_EQ(summary.trials, 36U);
  EXPECT_EQ(summary.half_written, 0U);  // one cut line, no complete step
  EXPECT_EQ(summary.missing + summary.duplicates + summary.disagreeing, 0U);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ShardAttempt(folder_ / "r", 0, "another", {}); }),
              HasSubstr("another plan"));
}

TEST_F(ShardTest, ConcurrentAttemptsAgree) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  const FrozenPlan frozen = freeze_as("plan.json", plan, 1);
  run_part(plan, frozen, 0, "r");
  const fs::path own = ShardAttempt(folder_ / "r", 0, frozen.hash, {}).folder();
  fs::rename(own, folder_ / "away");
  run_part(plan, frozen, 0, "r");
  fs::rename(folder_ / "away", folder_ / "r/shard-0000.lost-abc123");
  const records::MergeSummary summary = join("r");
  EXPECT_EQ(summary.trials, 36U);
  EXPECT_EQ(summary.duplicates, 36U);
  EXPECT_EQ(summary.disagreeing, 0U);
}

}  // namespace
}  // namespace relign::runner
