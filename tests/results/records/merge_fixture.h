// Folders of one scene "toy" and one level "calm" to be merged; trials "w0" are of walker, "r0" of runner, number =
// instance.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "base/files.h"
#include "base/seeds.h"
#include "error_text.h"
#include "records/merge.h"
#include "records/results_folder.h"
#include "results/records/made_manifest.h"
#include "sample_records.h"

namespace relign::records {

namespace fs = std::filesystem;
using test::error_text;

class MergeTest : public testing::Test {
 protected:
  void SetUp() override {
    const fs::path memory = "/dev/shm";
    folder_ = (::access(memory.c_str(), W_OK) == 0 ? memory : fs::temp_directory_path()) /
              ("relign-merge-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static TrialRecord trial(const std::string& id) {
    TrialRecord record = sample_trial(id);
    record.algorithm = record.algorithm_id = id[0] == 'w' ? "walker" : "runner";
    record.instance = std::stoull(id.substr(1));
    record.instance_seed = instance_seed(1, SeedDomain::benchmark, record.instance);
    return record;
  }
  static Json algorithm(const std::string& name) {
    return {{"name", name},
            {"id", name},
            {"plugin", name},
            {"protocol", "paper"},
            {"parameters", {{"stride", 0.1}}},
            {"merit", "combined"},
            {"steps", 2},
            {"plugin_hash", "h" + name},
            {"reproducible", "anywhere"}};
  }
  static Json manifest(const std::vector<std::string>& algorithms, const std::vector<std::string>& order) {
    Json list = Json::array();
    for (const std::string& name : algorithms) list.push_back(algorithm(name));
    return {{"format", 1},
            {"suite", "{\"algorithms\": [\"" + algorithms.front() + "\"]}"},
            {"suite_file", "toy.json"},
            {"suite_name", "toy"},
            {"seed", 1},
            {"first_instance", 0},
            {"instances", 5000},
            {"limits", "soft"},
            {"instance_set", "5e7"},
            {"program", {{"version", "1"}, {"hash", "p"}, {"flags", "-O3"}}},
            {"machine", {{"cpu", "one"}, {"cores", 2}}},
            {"scenes", {{{"name", "toy"}, {"plugin", "toy"}, {"identity", "i"}, {"plugin_hash", "s"}}}},
            {"noise_levels", {{{"name", "calm"}, {"plugin", "calm"}, {"identity", "i"}, {"plugin_hash", "l"}}}},
            {"algorithms", list},
            {"trials", order.size()},
            {"order", order},
            {"command", "run toy.json"}};
  }
  fs::path make(const std::string& name, const std::vector<TrialRecord>& trials, const Json& manifest) {
    ResultsWriter writer(folder_ / name);
    writer.write_manifest(made_manifest(manifest));
    std::size_t place = 0;
    for (const TrialRecord& record : trials) writer.append(place++, record, sample_times(record.trial));
    return folder_ / name;
  }
  MergeSummary join(const std::vector<fs::path>& sources, const std::string& out = "out") {
    MergeOptions options;
    options.sources = sources;
    options.out = folder_ / out;
    options.on_message = [this](const std::string& note) { notes_.push_back(note); };
    return merge(options);
  }
  std::string refused(const std::vector<fs::path>& sources, const std::string& out = "out") {
    return error_text(ErrorKind::bad_input, [&] { join(sources, out); });
  }
  std::vector<std::string> merged() {
    std::vector<std::string> ids;
    for (const TrialRecord& record : read_planned_trials(folder_ / "out")) ids.push_back(record.trial);
    return ids;
  }
  std::string bytes(const fs::path& file) { return read_file(folder_ / file); }

  fs::path folder_;
  std::vector<std::string> notes_;
};

}  // namespace relign::records
