// Trials where they lie: for who needs a few of many, or all one after the other.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "records/record.h"

namespace relign::records {

struct StoredTrial {
  std::size_t file = 0;              // number of the file below trials/
  std::size_t offset = 0, size = 0;  // bytes
};

// Calls `visit` for every complete trial of a results folder; the record has no steps. Memory goes with the longest
// line. Throws Error for folders that are none, unreadable, damaged or newer files.
void for_each_stored(const std::filesystem::path& folder,
                     const std::function<void(const TrialRecord& closing, const StoredTrial& where)>& visit);

// The record with its steps; `text` gets the lines as they stand, when it is not null. Throws Error.
TrialRecord read_stored(const std::filesystem::path& folder, const StoredTrial& where, std::string* text = nullptr);

// Calls `visit` for every line of times/, in file order: of a trial with several lines the last one counts.
void for_each_times(const std::filesystem::path& folder, const std::function<void(const TrialTimes&)>& visit);

}  // namespace relign::records
