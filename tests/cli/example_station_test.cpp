// examples/station as described in its README: a machine behind a line protocol, a Python plugin, and a lost
// connection.
#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <thread>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const fs::path kExample = RELIGN_SOURCE_DIR "/examples/station";

// The machine's server; ends with the test.
class Machine {
 public:
  Machine(const Workplace& place, const std::string& options)
      : place_(place),
        server_(place, {"/bin/sh", "-c",
                        "exec python3 -B '" + (kExample / "server.py").string() + "' --port 0 --program '" +
                            RELIGN_PROGRAM "' " + options + " >server.log 2>&1"}) {}

  // Empty if the server does not start.
  std::string port() {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const std::regex listening("listening on 127.0.0.1:([0-9]+)\n");
    while (std::chrono::steady_clock::now() < deadline && !server_.ended()) {
      const std::string log = place_.read("server.log");
      if (std::smatch found; std::regex_search(log, found, listening)) return found[1];
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ADD_FAILURE() << "the server does not listen: " << place_.read("server.log");
    return "";
  }

 private:
  const Workplace& place_;
  Running server_;
};

// The perturbations that the machine drew, as digits that could appear in a file.
std::vector<std::string> hidden_numbers(const Workplace& place) {
  place.write("hidden.py", R"py(import re, sys
sys.path.insert(0, sys.argv[1])
import server
for seed in re.findall(r"NEXT (\d+)", open("server.log").read()):
    lens = server.Lens(1, int(seed))
    offsets = [value for element in lens.elements.values() for part in element.values() for value in part]
    for value in [*lens.grip, *(value for row in lens.distortion for value in row), *offsets]:
        print(repr(value).split("e")[0][:11])
)py");
  const Outcome outcome = shell(place, "python3 -B hidden.py '" + kExample.string() + "'");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::vector<std::string> numbers;
  for (std::string line; std::getline(lines, line);) numbers.push_back(line);
  return numbers;
}

TEST(CliExampleStation, HidesGroundTruthAndFailsOneTrialOnLostConnection) {
  if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed";
  const Workplace place;
  Machine machine(place, "--drop-at 6");
  const std::string port = machine.port();
  ASSERT_NE(port, "");
  fs::copy_file(kExample / "station.py", place.path("station.py"));
  ASSERT_EQ(relign_bench(place, {"render", "--noise-free", "-o", "golden.npy"}).exit_code, 0);
  place.write("suite.json", R"({"name": "station", "noise_levels": ["none"], "protocol": "blind", "instances": 2,
    "scenes": [{"use": "./station.py", "name": "bench", "parameters": {"port": )" +
                                port + R"(}}], "algorithms": ["nlopt-sbplx"], "steps": 3})");

  // Four trials of four captures each: the sixth capture is the second of the second trial.
  const Outcome outcome = relign_bench(place, {"run", "suite.json", "--out", "out"});
  ASSERT_EQ(outcome.exit_code, 3) << outcome.err;  // done, one trial failed
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("3 of 4 trials finished, 1 failed"), HasSubstr("measured only")));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("dropped the connection during 'SNAP'"), HasSubstr("--plugin station.py")));

  std::istringstream lines(place.read("out/trials/0000.jsonl"));
  std::vector<std::string> ends;
  for (std::string line; std::getline(lines, line);) {
    const json record = json::parse(line);
    if (record.contains("end")) {
      ends.push_back(record["end"]);
      if (ends.back() == "failed") {
        EXPECT_EQ(record["steps"], 1) << "the capture at the start stays";
        EXPECT_THAT(record["message"].get<std::string>(),
                    AllOf(HasSubstr("'bench_station' failed"), HasSubstr("dropped the connection during 'SNAP'"),
                          HasSubstr(" of 80000 bytes came")));
      }
      continue;
    }
    for (const char* known : {"measured", "merit", "machine_seconds"}) EXPECT_TRUE(record[known].is_number()) << line;
    for (const char* unknown : {"commanded_mse", "commanded_mse_error", "recommended_mse", "recommended_mse_error"})
      EXPECT_TRUE(record.at(unknown).is_null()) << line;
    for (const char* unknown : {"true_pose", "recommended_true_pose"})
      EXPECT_EQ(record.at(unknown), json(std::vector<json>(5))) << line;
  }
  EXPECT_THAT(ends, testing::UnorderedElementsAre("budget_spent", "budget_spent", "budget_spent", "failed"));

  EXPECT_THAT(place.read("out/report.html"),
              AllOf(HasSubstr("Measured only: a station has no ground truth"),
                    HasSubstr("True poses, noise-free errors"), HasSubstr("lens, start pose and stage are real"),
                    HasSubstr("dropped the connection"), Not(HasSubstr("were given the same instances"))));

  const std::vector<std::string> hidden = hidden_numbers(place);
  EXPECT_EQ(hidden.size(), 4U * (5 + 25 + 2 * 5));
  for (const auto& entry : fs::recursive_directory_iterator(place.path("out"))) {
    if (!entry.is_regular_file()) continue;
    const std::string text = place.read(entry.path());
    for (const std::string& number : hidden) EXPECT_THAT(text, Not(HasSubstr(number))) << entry.path();
  }
}

TEST(CliExampleStation, ValidatesWithoutMachineAndReportsUnreachableAddress) {
  if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed";
  const Workplace place;
  fs::copy_file(kExample / "station.py", place.path("station.py"));
  ASSERT_EQ(relign_bench(place, {"render", "--noise-free", "-o", "golden.npy"}).exit_code, 0);
  place.write("alone.json", R"({"noise_levels": ["none"], "instances": 1, "steps": 1, "algorithms": ["random"],
    "scenes": [{"use": "./station.py", "name": "bench", "parameters": {"port": 1}}]})");
  EXPECT_EQ(relign_bench(place, {"validate", "alone.json"}).exit_code, 0);
  const Outcome outcome = relign_bench(place, {"run", "alone.json"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("no station answers at 127.0.0.1:1"));
}

}  // namespace
}  // namespace relign::cli_test
