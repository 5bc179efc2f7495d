// Synthetic results folders for one test, written by the same writer as a run's.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/hash.h"
#include "records/results_folder.h"

namespace relign::report {

class MadeResults : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("relign-report-" + std::string(test->name()) + "-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // A trial with these errors at step 0, 1, ..., both recommended and commanded.
  static records::TrialRecord trial(const std::string& algorithm, std::uint64_t instance,
                                    const std::vector<double>& errors, const std::string& level = "rho0") {
    records::TrialRecord record;
    record.trial = short_id(level + algorithm + std::to_string(instance));
    record.scene = "relign_od";
    record.noise_level = level;
    record.protocol = "paper";
    record.algorithm = record.algorithm_id = algorithm;
    record.instance = instance;
    record.end = "budget_spent";
    record.budget = errors.empty() ? 0 : static_cast<unsigned>(errors.size() - 1);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      records::StepRecord step;
      step.step = static_cast<unsigned>(i);
      step.commanded_pose = step.true_pose = step.recommended_pose = step.recommended_true_pose = {0.5};
      step.recommendation = "own";
      step.measured = step.merit = errors[i] + 0.03;
      step.machine_seconds = step.recommended_seconds = 0.5 * static_cast<double>(i);
      step.commanded_mse = step.recommended_mse = errors[i] * errors[i];
      record.steps.push_back(step);
    }
    return record;
  }

  // Writes manifest and trials; `extra` further trials are planned but not run.
  void write(const std::vector<records::TrialRecord>& trials, const std::string& suite_name = "made",
             std::size_t extra = 0) {
    records::ResultsWriter writer(folder_);
    Json order = Json::array();
    for (std::size_t i = 0; i < trials.size(); ++i) {
      records::TrialTimes times;
      times.trial = trials[i].trial;
      times.algorithm_seconds.assign(trials[i].steps.size(), 0.001);
      times.simulation_seconds = times.truth_seconds = times.algorithm_seconds;
      writer.append(i, trials[i], times);
      order.push_back(trials[i].trial);
    }
    for (std::size_t i = 0; i < extra; ++i) order.push_back("never-run-" + std::to_string(i));
    writer.write_manifest({{"format", 1},
                           {"suite_name", suite_name},
                           {"suite", R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "algorithms": ["a"]})"},
                           {"trials", order.size()},
                           {"order", order},
                           {"program", {{"version", "0.1.0"}}}});
  }

  // A trial on a station, which measures but has no ground truth.
  static records::TrialRecord on_station(const std::string& algorithm, const std::vector<double>& measured) {
    records::TrialRecord record = trial(algorithm, 0, measured, "none");
    record.scene = "bench";
    record.protocol = "blind";
    for (std::size_t i = 0; i < measured.size(); ++i) {
      records::StepRecord& step = record.steps[i];
      step.measured = step.merit = measured[i];
      step.commanded_mse = step.recommended_mse = step.recommended_seconds = std::numeric_limits<double>::quiet_NaN();
    }
    return record;
  }

  // Adds members of a run's manifest: scenes, algorithms, ...; and to the suite, if the run has them from there.
  void add_to_manifest(const Json& more) {
    Json manifest = Json::parse(read_file(folder_ / "manifest.json"));
    manifest.update(more);
    if (more.contains("suite")) return write_file_atomically(folder_ / "manifest.json", manifest.dump());
    Json suite = Json::parse(manifest["suite"].get<std::string>());
    for (const char* key : {"scenes", "noise_levels", "algorithms", "instances", "seed", "first_instance", "spec",
                            "limits", "machine_time", "cycle", "cost", "targets"})
      if (more.contains(key)) suite[key] = more[key];
    Json& methods = suite["algorithms"];
    methods.erase(std::remove_if(methods.begin(), methods.end(),
                                 [](const Json& one) { return one.is_object() && one.value("added", false); }),
                  methods.end());
    manifest["suite"] = suite.dump();
    write_file_atomically(folder_ / "manifest.json", manifest.dump());
  }

  // Adds an analysis plan to suite and manifest, and further members.
  void add_plan(const Json& plan, const Json& more = Json::object()) {
    add_to_manifest(more);
    Json suite = Json::parse(Json::parse(read_file(folder_ / "manifest.json"))["suite"].get<std::string>());
    suite["analysis"] = plan;
    add_to_manifest({{"suite", suite.dump()}, {"analysis", plan}, {"analysis_hash", sha256_hex(canonical_json(plan))}});
  }

  static std::string short_id(const std::string& text) {
    std::uint64_t hash = 1469598103934665603u;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    std::string id(16, '0');
    for (std::size_t i = 0; i < 16; ++i) id[15 - i] = "0123456789abcdef"[hash >> (4 * i) & 15];
    return id;
  }

  std::filesystem::path folder_;
};

// A name that tries to escape from text, attributes, scripts and terminals.
inline const std::string kHostile =
    "\"><img src=x onerror=alert(1)></script><script>alert(2)</script>'&{{data}}\x1b[31m";

}  // namespace relign::report
