// Scenes that declare their score, for the tests of the command line: the example of a fibre, copied.
#pragma once

#include <gmock/gmock.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "cli/program.h"

namespace relign::cli_test {

class ScoredScene : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed";
    for (const char* file : {"fibre.py", "coupling.py"})
      std::filesystem::copy_file(std::filesystem::path(RELIGN_SOURCE_DIR "/examples/fibre") / file, place_.path(file));
    place_.write("suite.json", suite(R"("score": 1.0)"));
  }
  static std::string suite(const std::string& spec) {
    return R"({"name": "fibre", "scenes": ["./fibre.py"], "noise_levels": ["declared"], "protocol": "blind",
               "algorithms": ["nlopt-neldermead", "coordinate-walk"], "instances": 3, "steps": 12, "spec": {)" +
           spec + "}}";
  }
  Outcome call(const std::vector<std::string>& arguments) { return relign_bench(place_, arguments); }
  // The example with a replacement, as scene.py.
  void scene_with(const std::string& text, const std::string& other) {
    std::string source = place_.read("fibre.py");
    const std::size_t at = source.find(text);
    ASSERT_NE(at, std::string::npos) << text;
    place_.write("scene.py", source.replace(at, text.size(), other));
  }
  // The last step and the closing line of each trial in "out".
  std::vector<std::pair<nlohmann::json, nlohmann::json>> trials() {
    std::vector<std::pair<nlohmann::json, nlohmann::json>> found;
    std::istringstream lines(place_.read("out/trials/0000.jsonl"));
    nlohmann::json last;
    for (std::string line; std::getline(lines, line);) {
      nlohmann::json read = nlohmann::json::parse(line);
      if (read.contains("end"))
        found.emplace_back(last, std::move(read));
      else
        last = std::move(read);
    }
    EXPECT_FALSE(found.empty());
    return found;
  }
  std::string found_by_the_checks(const std::string& text, const std::string& other) {
    scene_with(text, other);
    const Outcome outcome = call({"plugin", "check", "./scene.py"});
    EXPECT_NE(outcome.exit_code, 0) << outcome.out;
    return outcome.out + outcome.err;
  }

  Workplace place_;
};

}  // namespace relign::cli_test
