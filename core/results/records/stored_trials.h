// Reads trials from their place in the files: a few out of many, or all of them one by one, without loading a folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "records/record.h"
#include "records/step_numbers.h"

namespace relign::records {

struct StoredTrial {
  std::size_t file = 0;              // number of the file below trials/
  std::size_t offset = 0, size = 0;  // bytes
};

// Calls `visit` for every complete trial of a results folder; the record has no steps. Memory grows with the longest
// line. Throws Error for a folder that is not a results folder, and for unreadable, damaged or newer files.
void for_each_stored(const std::filesystem::path& folder,
                     const std::function<void(const TrialRecord& closing, const StoredTrial& where)>& visit);

// The same with the numbers of the trial's steps; `on_incomplete` gets the trials with steps but no closing line.
void for_each_with_steps(const std::filesystem::path& folder,
                         const std::function<void(const TrialRecord& closing, const StoredTrial& where,
                                                  const std::vector<StepNumbers>& steps)>& visit,
                         const std::function<void(const std::string& trial)>& on_incomplete = {});

// Reads the step numbers of one trial after another; fastest in the order of the files.
class StoredSteps {
 public:
  explicit StoredSteps(std::filesystem::path folder) : folder_(std::move(folder)) {}
  // Valid until the next call. Throws Error as read_stored does.
  const std::vector<StepNumbers>& read(const StoredTrial& where);
  // Of the trial read last, without its steps.
  const TrialRecord& closing() const { return closing_; }
  // Of the trial read last, under its specification; empty where it is unknown.
  const std::vector<double>& own_optimum_pose() const {
    return closing_.criterion_optimum_pose.empty() ? closing_.own_optimum_pose : closing_.criterion_optimum_pose;
  }

 private:
  std::filesystem::path folder_;
  std::ifstream stream_;
  std::size_t file_ = static_cast<std::size_t>(-1);  // that `stream_` reads
  std::string lines_;
  TrialRecord closing_;
  StepNumbersReader reader_;
  std::vector<StepNumbers> steps_;
};

// Reads the record with its steps; `text`, unless null, gets the lines as they are in the file. Throws Error.
TrialRecord read_stored(const std::filesystem::path& folder, const StoredTrial& where, std::string* text = nullptr);

// Calls `visit` for every line of times/, in file order. The last line of a trial is the valid one.
void for_each_times(const std::filesystem::path& folder, const std::function<void(const TrialTimes&)>& visit);

}  // namespace relign::records
