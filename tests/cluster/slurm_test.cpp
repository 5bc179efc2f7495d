// A plan in a real queue: the result equals that of one plain run, whatever happens to jobs and nodes.
// Checks only files: Slurm's states of jobs are not reliable.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "slurm_cluster.h"

namespace relign::cluster_test {
namespace {

namespace fs = std::filesystem;
using cli_test::Outcome;
using nlohmann::json;
using testing::HasSubstr;

constexpr unsigned kShards = 4;  // two instances and six trials each

std::unique_ptr<SlurmCluster> cluster;

class Slurm : public testing::Test {
 protected:
  static void SetUpTestSuite() { cluster = std::make_unique<SlurmCluster>(); }
  static void TearDownTestSuite() { cluster.reset(); }

  void SetUp() override {
    if (!cluster->problem().empty()) GTEST_SKIP() << cluster->problem();
    if (waited_too_long()) FAIL() << "no time left after another test has waited without success";
    prepare("2", json::array({patient()}));
  }
  // Jobs of a failed test must not fail the next one.
  void TearDown() override {
    if (!cluster->problem().empty() || !HasFailure()) return;
    open_gate();
    cluster->shell(place_, "scancel --user=$(id -un); scontrol update nodename=n[1-2] state=resume");
    wait_for([this] { return cluster->shell(place_, "squeue -h").out.empty(); });
  }

  // An algorithm that waits for the gate before its first step.
  json patient() const {
    return {{"use", "toy-patient"}, {"name", "patient"}, {"parameters", {{"gate", gate().string()}}}};
  }
  void prepare(const std::string& cpus, const json& algorithms) {
    place_.write("suites/patient.json", json{{"scenes", {"toy-scene"}},
                                             {"noise_levels", {"toy-level", "toy-wild"}},
                                             {"algorithms", algorithms},
                                             {"instances", 4},
                                             {"steps", 4}}
                                            .dump());
    bench({"plan", "suites/patient.json", "--shards", std::to_string(kShards)});
    ASSERT_FALSE(HasFailure());
    place_.write("job.sh", bench({"slurm", "script", "--plan", "plan.json", "--cpus", cpus, "-o", "parts"}).out);
  }

  fs::path gate() const { return place_.path("the gate's open"); }
  void open_gate() const { std::ofstream(gate()) << "yes"; }

  Outcome bench(std::vector<std::string> arguments) {
    for (const char* toy : {"toy_scene", "toy_level"})
      arguments.insert(arguments.end(), {"--plugin", RELIGN_RUNNER_TEST_PLUGINS + std::string("/") + toy});
    arguments.insert(arguments.end(), {"--plugin", RELIGN_CLUSTER_TEST_PLUGINS "/toy_patient"});
    const Outcome outcome = cli_test::relign_bench(place_, arguments);
    if (arguments.front() != "slurm") {
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    }
    return outcome;
  }
  std::string slurm(const std::string& command) {
    const Outcome outcome = cluster->shell(place_, command);
    EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.err;
    return outcome.out;
  }
  void submit(const std::string& options = "") { slurm("sbatch " + options + " job.sh"); }
  json status() { return json::parse(bench({"slurm", "status", "--plan", "plan.json", "-o", "parts", "--json"}).out); }

  void wait_until(const std::string& what, const std::function<bool()>& holds) {
    if (HasFatalFailure()) return;
    if (!wait_for(holds)) FAIL() << "timeout while waiting for " << what << "\n" << slurm("squeue") << logs();
  }
  void wait_until_the_queue_is_empty() {
    wait_until("an empty queue", [this] { return slurm("squeue -h").empty(); });
  }
  // The coordinators that run a shard.
  static std::vector<pid_t> programs_of(unsigned shard) {
    const std::string words = "--shard " + std::to_string(shard) + "/" + std::to_string(kShards);
    std::vector<Process> found;
    for (Process& process : cluster->processes())
      if (process.command.rfind(RELIGN_PROGRAM, 0) == 0 && process.command.find(words) != std::string::npos)
        found.push_back(std::move(process));
    return without_starting_children(found);
  }
  // Attempts that have locked their folder and read those of the others.
  std::vector<std::string> attempts_at(unsigned shard) {
    std::vector<std::string> names;
    const std::string start = "shard-000" + std::to_string(shard) + ".";
    std::error_code code;
    for (fs::directory_iterator entry(place_.path("parts"), code), end; !code && entry != end; entry.increment(code))
      if (entry->path().filename().string().rfind(start, 0) == 0 && fs::exists(entry->path() / "manifest.json"))
        names.push_back(entry->path().filename().string());
    return names;
  }
  void wait_until_at_work(unsigned shard, std::size_t attempts = 1) {
    wait_until("shard " + std::to_string(shard) + " at work", [&] { return attempts_at(shard).size() == attempts; });
  }
  // The logs of the jobs.
  std::string logs() const {
    std::string text;
    for (const auto& entry : fs::directory_iterator(place_.folder())) {
      const std::string name = entry.path().filename().string();
      if (name.rfind("slurm-", 0) == 0) text += name + ":\n" + place_.read(name);
    }
    return text;
  }
  void wait_until_all_shards_logged(const std::string& what) {
    for (unsigned shard = 0; shard < kShards; ++shard) {
      const std::string words = "shard " + std::to_string(shard) + " " + what;
      wait_until(words, [&] { return logs().find(words) != std::string::npos; });
    }
  }
  // Expects that all shards are complete and merge to the bytes of one run. Returns the output of merge.
  json expect_the_results_of_one_run() {
    EXPECT_EQ(status()["array"], "") << logs();
    bench({"run", "suites/patient.json", "-o", "one"});
    const json merged = json::parse(bench({"merge", "parts", "-o", "merged", "--json"}).out);
    EXPECT_EQ(merged["trials"], status()["trials"]);
    EXPECT_FALSE(place_.read("one/trials/0000.jsonl").empty());
    EXPECT_EQ(place_.read("merged/trials/0000.jsonl"), place_.read("one/trials/0000.jsonl"));
    return merged;
  }

  cli_test::Workplace place_;
};

TEST_F(Slurm, ArrayHasTheResultsOfOneRun) {
  open_gate();
  submit();
  wait_until_the_queue_is_empty();
  EXPECT_EQ(expect_the_results_of_one_run()["duplicates"], 0);
}

TEST_F(Slurm, ResubmitsOnlyTheFailedIndex) {
  submit();
  wait_until_at_work(2);
  for (const pid_t program : programs_of(2)) ::kill(program, SIGKILL);
  open_gate();
  wait_until_the_queue_is_empty();
  ASSERT_EQ(status()["array"], "2");
  submit("--array=2");
  wait_until_the_queue_is_empty();
  expect_the_results_of_one_run();
}

TEST_F(Slurm, ConcurrentAttemptsAtOneShardAgree) {
  submit();
  wait_until_at_work(1);
  submit("--array=1");
  wait_until_at_work(1, 2);
  open_gate();
  wait_until_the_queue_is_empty();
  EXPECT_EQ(expect_the_results_of_one_run()["duplicates"], status()["parts"][1]["trials"]);
}

TEST_F(Slurm, ResumesShardStoppedBeforeItsTimeLimit) {
  const json hasty = {{"use", "toy-patient"}, {"name", "hasty"}};
  prepare("1", json::array({hasty, patient()}));
  submit();
  const auto begun = [this] {
    const json parts = status()["parts"];
    return std::all_of(parts.begin(), parts.end(), [](const json& part) { return part["done"] > 0; });
  };
  wait_until("a finished trial of every shard, and the next one at the gate", begun);
  // Slurm does the same two minutes before the time limit.
  slurm("scancel --batch --signal=USR1 $(squeue -h -r -o %A)");
  wait_until_all_shards_logged("stops");
  open_gate();
  wait_until_all_shards_logged("resumes when Slurm starts it again");
  EXPECT_THAT(logs(), HasSubstr("Stopped with"));
  wait_until_the_queue_is_empty();
  EXPECT_EQ(expect_the_results_of_one_run()["duplicates"], 0) << "it must continue in the same folder";
}

TEST_F(Slurm, RequeuesJobsOfALostNodeWhileTheyContinue) {
  slurm("scontrol update nodename=n1 state=drain reason=test");
  submit();
  for (unsigned shard = 0; shard < kShards; ++shard) wait_until_at_work(shard);
  cluster->lose_node("n2");
  slurm("scontrol update nodename=n1 state=resume");
  for (unsigned shard = 0; shard < kShards; ++shard) {
    wait_until_at_work(shard, 2);
    EXPECT_EQ(programs_of(shard).size(), 2U) << "the old one must continue";
  }
  cluster->return_node("n2");
  wait_until("the return of the node", [this] { return slurm("sinfo -h -N -n n2 -o %T") == "idle\n"; });
  open_gate();
  wait_until_the_queue_is_empty();
  for (unsigned shard = 0; shard < kShards; ++shard)  // the old ones are no longer in the queue
    wait_until("the end of the old programs", [shard] { return programs_of(shard).empty(); });
  EXPECT_EQ(expect_the_results_of_one_run()["duplicates"], status()["trials"]);
}

}  // namespace
}  // namespace relign::cluster_test
