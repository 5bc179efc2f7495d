// One writer at a time in a results folder.
#pragma once

#include <filesystem>

namespace relign::records {

// Holds the folder's lock file (.lock) until destroyed; the file is gone afterwards.
class ResultsLock {
 public:
  // Throws Error(io) when another process writes the folder now, or the file cannot be made.
  explicit ResultsLock(const std::filesystem::path& folder);
  ~ResultsLock();
  ResultsLock(const ResultsLock&) = delete;
  ResultsLock& operator=(const ResultsLock&) = delete;

  static constexpr const char* kFileName = ".lock";

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

}  // namespace relign::records
