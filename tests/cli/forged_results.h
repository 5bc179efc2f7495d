// A results folder that a test changes and writes again with correct checksums.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cli/program.h"
#include "records/checksum.h"

namespace relign::cli_test::forged {

using Json = nlohmann::ordered_json;  // keeps the order of members, as the writer of records has it

struct Trial {
  std::vector<Json> steps;
  Json closing;
  std::string replace, by;  // a change of the text of the lines
  std::string text() const {
    std::string lines;
    for (const Json& step : steps) lines += step.dump() + "\n";
    Json last = closing;
    last["steps"] = steps.size();
    lines += last.dump();
    if (!replace.empty()) lines.replace(lines.find(replace), replace.size(), by);
    return records::with_checksum(lines) + "\n";
  }
};

// A results folder in memory.
struct Results {
  Json manifest;
  std::vector<Trial> trials;
  std::vector<Json> times;
  std::string replace, by;            // a change of the manifest's text
  std::string replace_time, by_time;  // of the first line of times

  std::vector<Trial*> of(const std::string& method) {
    std::vector<Trial*> found;
    for (Trial& trial : trials)
      if (trial.closing["algorithm"] == method) found.push_back(&trial);
    return found;
  }
  Json& method(const std::string& name) {
    for (Json& entry : manifest["algorithms"])
      if (entry["name"] == name) return entry;
    throw std::runtime_error("no method " + name);
  }
  Json suite() const { return Json::parse(manifest["suite"].get<std::string>()); }
};

inline Json without_checksum(const std::string& line) {
  Json read = Json::parse(line);
  read.erase("sha256");
  return read;
}

inline Results read_results(const Workplace& place, const std::string& folder) {
  Results results;
  results.manifest = Json::parse(place.read(folder + "/manifest.json"));
  std::istringstream lines(place.read(folder + "/trials/0000.jsonl")), times(place.read(folder + "/times/0000.jsonl"));
  Trial trial;
  for (std::string line; std::getline(lines, line);) {
    Json read = without_checksum(line);
    if (read.contains("end")) {
      trial.closing = std::move(read);
      results.trials.push_back(std::exchange(trial, {}));
    } else {
      trial.steps.push_back(std::move(read));
    }
  }
  for (std::string line; std::getline(times, line);) results.times.push_back(without_checksum(line));
  return results;
}

inline void write_results(const Workplace& place, const std::string& folder, const Results& results) {
  std::string manifest = results.manifest.dump(1), trials, times;
  if (!results.replace.empty()) manifest.replace(manifest.find(results.replace), results.replace.size(), results.by);
  for (const Trial& trial : results.trials) trials += trial.text();
  for (const Json& line : results.times) {
    std::string text = line.dump();
    if (times.empty() && !results.replace_time.empty())
      text.replace(text.find(results.replace_time), results.replace_time.size(), results.by_time);
    times += records::with_checksum(text) + "\n";
  }
  place.write(folder + "/manifest.json", manifest);
  place.write(folder + "/trials/0000.jsonl", trials);
  place.write(folder + "/times/0000.jsonl", times);
}

struct Forgery {
  const char* name;
  std::function<void(Results&)> change;
  std::string finding;  // that each command states
};

inline const std::string kRival = "nlopt-bobyqa", kOwn = "nlopt-sbplx";

// Of the last step of the rival's first trial.
inline std::function<void(Results&)> last_step(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.of(kRival)[0]->steps.back()[key] = value; };
}

inline std::function<void(Results&)> closing(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.of(kRival)[0]->closing[key] = value; };
}

// Forges copies of an evaluated folder.
class ForgedFolders : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    place_ = new Workplace;
    evaluate("good", "gaussian_spot");
  }
  // A folder in which a method was submitted.
  static void evaluate(const std::string& folder, const std::string& scene) {
    const Json suite = {{"scenes", {scene}}, {"noise_levels", {"rho0"}}, {"instances", 2},
                        {"steps", 4},        {"spec", {{"rmse", 0.01}}}, {"algorithms", {kOwn, kRival}}};
    place_->write("tiny.json", suite.dump());
    const Outcome run = relign_bench(*place_, {"run", "tiny.json", "-o", folder + "/results"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Json manifest = Json::parse(place_->read(folder + "/results/manifest.json"));
    Json methods = Json::array(), own;
    for (const Json& entry : manifest["algorithms"]) {
      methods.push_back({{"name", entry["name"]},
                         {"observes", entry["observes"]},
                         {"protocol", entry["protocol"]},
                         {"training", nullptr},
                         {"submitted", entry["name"] == kOwn}});
      if (entry["name"] == kOwn) own = methods.back();
    }
    place_->write(
        folder + "/evaluation.json",
        Json({{"format", "relign-bench/evaluation/1"},
              {"name", kOwn},
              {"version", "1.0"},
              {"archive_sha256", std::string(64, '0')},
              {"suite",
               {{"name", "tiny"}, {"sha256", std::string(64, '1')}, {"instance_set", manifest["instance_set"]}}},
              {"sealed", false},
              {"sandbox", false},
              {"date", "2026-11-24"},
              {"program_version", manifest["program"]["version"]},
              {"class", own["observes"]},
              {"budget", {{"steps", 4}}},
              {"methods", methods}})
            .dump());
    place_->write(folder + "/submission.json", Json({{"name", kOwn}, {"version", "1.0"}}).dump());
  }
  static void TearDownTestSuite() {
    delete place_;
    place_ = nullptr;
  }
  void TearDown() override { fs::remove_all(place_->path("forged")); }

  static void forge(const std::function<void(Results&)>& change, const std::string& from = "good") {
    fs::remove_all(place_->path("forged"));
    fs::copy(place_->path(from), place_->path("forged"), fs::copy_options::recursive);
    Results results = read_results(*place_, "forged/results");
    change(results);
    write_results(*place_, "forged/results", results);
  }
  static Outcome call(const std::vector<std::string>& arguments) { return relign_bench(*place_, arguments); }
  static inline Workplace* place_ = nullptr;
};

}  // namespace relign::cli_test::forged
