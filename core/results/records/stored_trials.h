// Trials where they lie: for who needs a few of many, or all one after the other.
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

// Calls `visit` for every complete trial of a results folder; the record has no steps. Memory goes with the longest
// line. Throws Error for folders that are none, unreadable, damaged or newer files.
void for_each_stored(const std::filesystem::path& folder,
                     const std::function<void(const TrialRecord& closing, const StoredTrial& where)>& visit);

// The same with the numbers of its steps; `on_incomplete` gets the trials that have steps but no closing line.
void for_each_with_steps(const std::filesystem::path& folder,
                         const std::function<void(const TrialRecord& closing, const StoredTrial& where,
                                                  const std::vector<StepNumbers>& steps)>& visit,
                         const std::function<void(const std::string& trial)>& on_incomplete = {});

// The numbers of the steps of one trial after the other, best in the order in which they lie.
class StoredSteps {
 public:
  explicit StoredSteps(std::filesystem::path folder) : folder_(std::move(folder)) {}
  // Until the next call. Throws Error as read_stored does.
  const std::vector<StepNumbers>& read(const StoredTrial& where);
  // Of the trial that was read last; empty where nobody knows it.
  const std::vector<double>& own_optimum_pose() const { return closing_.own_optimum_pose; }

 private:
  std::filesystem::path folder_;
  std::ifstream stream_;
  std::size_t file_ = static_cast<std::size_t>(-1);  // that `stream_` reads
  std::string lines_;
  TrialRecord closing_;
  StepNumbersReader reader_;
  std::vector<StepNumbers> steps_;
};

// The record with its steps; `text` gets the lines as they stand, when it is not null. Throws Error.
TrialRecord read_stored(const std::filesystem::path& folder, const StoredTrial& where, std::string* text = nullptr);

// Calls `visit` for every line of times/, in file order: of a trial with several lines the last one counts.
void for_each_times(const std::filesystem::path& folder, const std::function<void(const TrialTimes&)>& visit);

}  // namespace relign::records
