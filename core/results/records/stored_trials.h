// Reads trials from their place in the files: a few out of many, or all of them one by one, without loading a folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "records/damage.h"
#include "records/record.h"
#include "records/step_numbers.h"

namespace relign::records {

struct StoredTrial {
  std::size_t file = 0;              // number of the file below trials/
  std::size_t offset = 0, size = 0;  // bytes
  std::size_t line = 0;              // number of the first
};

// Calls `visit` for every complete, undamaged trial of a results folder, with the numbers of its steps; the record has
// no steps. `on_incomplete` gets the trials with steps but no closing line. Memory grows with the longest trial. Throws
// Error for a folder that is not a results folder, for unreadable or newer files and, at the end, for damage, unless
// `damaged` takes it.
void for_each_with_steps(const std::filesystem::path& folder,
                         const std::function<void(const TrialRecord& closing, const StoredTrial& where,
                                                  const std::vector<StepNumbers>& steps)>& visit,
                         const std::function<void(const std::string& trial)>& on_incomplete = {},
                         std::vector<Damage>* damaged = nullptr);

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
    return closing_.criterion_optimum_pose.empty() ? closing_.own_optimum.pose : closing_.criterion_optimum_pose;
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

// Calls `visit` for every undamaged line of times/, in file order. The last line of a trial is the valid one. Throws
// Error for damage as for_each_with_steps.
void for_each_times(const std::filesystem::path& folder, const std::function<void(const TrialTimes&)>& visit,
                    std::vector<Damage>* damaged = nullptr);

}  // namespace relign::records
