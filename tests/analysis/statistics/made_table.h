// Trial tables from synthetic records, written by the same writer as a run's.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "records/results_folder.h"
#include "statistics/trial_table.h"

namespace relign::statistics {

class MadeTable : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("relign-stats-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // The table of a folder with these trials; times are optional.
  TrialTable table(const std::vector<records::TrialRecord>& trials,
                   const std::vector<records::TrialTimes>& times = {}) {
    std::filesystem::remove_all(folder_);
    records::ResultsWriter writer(folder_);
    writer.write_manifest({});
    for (std::size_t place = 0; place < trials.size(); ++place) {
      records::TrialTimes of_trial;
      of_trial.trial = trials[place].trial;
      for (const records::TrialTimes& candidate : times)
        if (candidate.trial == of_trial.trial) of_trial = candidate;
      writer.append(place, trials[place], of_trial);
    }
    return read_trial_table(folder_).table;
  }

  std::filesystem::path folder_;
};

}  // namespace relign::statistics
