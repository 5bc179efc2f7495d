// slurm script and slurm status without Slurm, which tests/cluster uses. The approved script is in tests/golden/slurm;
// after an intended change: RELIGN_UPDATE_GOLDEN=1 build/release/tests/test_cli_slurm
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// 8 trials of 4 instances.
const char* const kSuite = R"({
  "name": "tiny", "scenes": ["relign_od"], "noise_levels": ["rho0", "rho0.5"],
  "algorithms": ["random", "home"], "instances": 2, "steps": 3
})";

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
  return text;
}

class CliSlurm : public testing::Test {
 protected:
  void SetUp() override {
    place_.write("suites/tiny.json", kSuite);
    ASSERT_EQ(call({"plan", "suites/tiny.json", "--shards", "4"}).exit_code, 0);
  }
  Outcome call(const std::vector<std::string>& arguments) { return relign_bench(place_, arguments); }
  Outcome status() { return call({"slurm", "status", "--plan", "plan.json", "--json"}); }
  void run_shard(const std::string& shard) {
    EXPECT_EQ(call({"run", "--plan", "plan.json", "--shard", shard}).exit_code, 0);
  }
  Workplace place_;
};

TEST_F(CliSlurm, ScriptMatchesApprovedText) {
  const Outcome made = call({"slurm", "script", "--plan", "plan.json", "-o", "results/a b", "--cpus", "4",
                             "--max-parallel", "2", "--mem", "4G", "--time", "00:30:00"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::string script = replaced(made.out, fs::canonical(RELIGN_PROGRAM).string(), "/PROGRAM");
  script = replaced(script, fs::canonical(place_.folder()).string(), "/FOLDER");
  script = replaced(script, place_.folder().string(), "/FOLDER");
  const fs::path file = fs::path(RELIGN_TEST_DATA) / "slurm/job.sh";
  if (std::getenv("RELIGN_UPDATE_GOLDEN") != nullptr) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << script;
  }
  std::ifstream stream(file);
  const std::string approved((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  EXPECT_EQ(script, approved) << file << ": approve an intended change with RELIGN_UPDATE_GOLDEN=1";
}

// Runs the script as Slurm does, with Slurm's environment variables, in a folder whose name contains shell syntax.
TEST_F(CliSlurm, QuotesHostileNames) {
  const std::string hostile = "it's $(touch pwned) `touch pwned`; touch pwned & \"x\" *";
  fs::create_directories(place_.path(hostile));
  fs::rename(place_.path("plan.json"), place_.path(hostile) / "plan.json");
  fs::create_directories(place_.path("elsewhere"));
  const Outcome made = call({"slurm", "script", "--plan", hostile + "/plan.json", "-o", hostile + "/out"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  place_.write("job.sh", made.out);
  EXPECT_EQ(shell(place_, "bash -n job.sh").exit_code, 0);
  // The plan is no longer in its suite's folder; no plugin of this suite reads files there.
  const Outcome ran = shell(place_, "cd elsewhere && SLURM_ARRAY_TASK_COUNT=1 SLURM_ARRAY_TASK_ID=3 bash ../job.sh");
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_FALSE(fs::exists(place_.path("pwned")) || fs::exists(place_.path("elsewhere/pwned")));
  const json result =
      json::parse(call({"slurm", "status", "--plan", hostile + "/plan.json", "-o", hostile + "/out", "--json"}).out);
  EXPECT_EQ(result["array"], "0-2");
  EXPECT_EQ(result["parts"][3]["state"], "complete");
}

TEST_F(CliSlurm, ScriptReturnsTheProgramsExitCode) {
  place_.write("job.sh", call({"slurm", "script", "--plan", "plan.json"}).out);
  EXPECT_THAT(shell(place_, "bash job.sh").err, HasSubstr("submit it with sbatch"));
  EXPECT_EQ(shell(place_, "SLURM_ARRAY_TASK_ID=4 bash job.sh").exit_code, 2) << "the plan has 4 shards";
}

// With stand-ins for the program, which exits with 75 on SIGTERM, and for scontrol.
TEST_F(CliSlurm, TimeLimitStopsTheProgramAndRequeuesUpToTheGivenNumber) {
  std::string script = call({"slurm", "script", "--plan", "plan.json", "--requeues", "2"}).out;
  place_.write("job.sh", replaced(script, fs::canonical(RELIGN_PROGRAM).string(), "./stand_in"));
  place_.write("stand_in",
               "#!/bin/bash\ntrap 'sleep 0.2; exit 75' TERM\nsleep 0.1\ntouch begun\nwhile :; do sleep 0.05; done\n");
  // Slurm ends the task as soon as it accepts the requeue request, possibly before scontrol returns.
  place_.write("bin/scontrol", "#!/bin/sh\necho \"$@\" >> scontrol.txt\nkill -TERM $PPID $$\n");
  const auto notice = [this](const std::string& restarts) {
    return shell(place_,
                 "chmod +x stand_in bin/scontrol; rm -f begun; export PATH=\"$PWD/bin:$PATH\"; "
                 "export SLURM_ARRAY_TASK_ID=3 SLURM_ARRAY_JOB_ID=17 SLURM_RESTART_COUNT=" +
                     restarts +
                     "; bash job.sh & while [ ! -e begun ]; do sleep 0.02; done; kill -USR1 $!; "
                     "kill -USR1 $!; wait $!");
  };
  const Outcome first = notice("1");
  EXPECT_EQ(first.exit_code, 75);
  EXPECT_THAT(first.err, HasSubstr("shard 3 resumes when Slurm starts it again"));
  EXPECT_EQ(place_.read("scontrol.txt"), "requeue 17_3\n");
  const Outcome last = notice("2");
  EXPECT_EQ(last.exit_code, 75);
  EXPECT_EQ(place_.read("scontrol.txt"), "requeue 17_3\n") << "no third requeue";
  EXPECT_THAT(last.err, HasSubstr("sbatch --array=3"));
}

TEST_F(CliSlurm, StatusReadsTheRecords) {
  const Outcome before = status();
  EXPECT_EQ(before.exit_code, 75);
  EXPECT_EQ(json::parse(before.out)["array"], "0-3");
  for (const char* shard : {"0/4", "2/4"}) run_shard(shard);
  // A shard whose job was killed in its second trial.
  fs::path folder;
  for (const auto& entry : fs::directory_iterator(place_.path("results/tiny")))
    if (entry.path().filename().string().rfind("shard-0002", 0) == 0) folder = entry.path();
  const fs::path file = folder / "trials/0000.jsonl";
  fs::resize_file(file, fs::file_size(file) - 20);
  const Outcome outcome = status();
  EXPECT_EQ(outcome.exit_code, 75);
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["array"], "1-3");
  EXPECT_EQ(result["done"], 3);
  EXPECT_EQ(result["trials"], 8);
  EXPECT_EQ(result["parts"][2]["state"], "partly");
  EXPECT_EQ(result["parts"][2]["done"], 1);
  const Outcome text = call({"slurm", "status", "--plan", "plan.json"});
  EXPECT_THAT(text.out, AllOf(HasSubstr("complete  1: 0\n"), HasSubstr("partly    1: 2\n"),
                              HasSubstr("missing   2: 1,3\n"), HasSubstr("\n--array=1-3\n")));
  for (const char* shard : {"1/4", "2/4", "3/4"}) run_shard(shard);
  const Outcome after = call({"slurm", "status", "--plan", "plan.json"});
  EXPECT_EQ(after.exit_code, 0);
  EXPECT_THAT(after.out,
              AllOf(HasSubstr("complete  4: 0-3\n"), HasSubstr("trials    8 of 8"), Not(HasSubstr("--array"))));
}

TEST_F(CliSlurm, RejectsInvalidOptions) {
  const auto refused = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"slurm", "script", "--plan", "plan.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = call(arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  EXPECT_THAT(refused({"--time", "soon"}), HasSubstr("HH:MM:SS"));
  EXPECT_THAT(refused({"--time", "00:04:59"}), HasSubstr("00:05:00 or longer"));
  EXPECT_THAT(refused({"--mem", "4G\n#SBATCH --uid=root"}), HasSubstr("not a memory size"));
  EXPECT_THAT(refused({"-o", "two\nlines"}), HasSubstr("control character"));
  EXPECT_EQ(call({"slurm", "status", "--plan", "suites/tiny.json"}).exit_code, 2);
  run_shard("0/4");
  ASSERT_EQ(call({"plan", "suites/tiny.json", "-o", "other.json", "--shards", "2"}).exit_code, 0);
  EXPECT_THAT(call({"slurm", "status", "--plan", "other.json"}).err, HasSubstr("another plan"));
}

}  // namespace
}  // namespace relign::cli_test
