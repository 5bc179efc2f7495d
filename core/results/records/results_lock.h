// A lock file that admits one writer at a time to a results folder.
#pragma once

#include <filesystem>
#include <string>

#include "base/error.h"

namespace relign::records {

// Error(io): another process holds the lock.
class FolderInUse : public Error {
 public:
  explicit FolderInUse(const std::string& message) : Error(ErrorKind::io, message) {}
};

// Holds the lock until destroyed, and then removes its file.
class ResultsLock {
 public:
  // Throws FolderInUse when another process is writing the folder, Error(io) when the file cannot be created.
  explicit ResultsLock(const std::filesystem::path& folder, const std::string& file_name = kFileName);
  ~ResultsLock();
  ResultsLock(const ResultsLock&) = delete;
  ResultsLock& operator=(const ResultsLock&) = delete;

  // False on a file system without locks, where other writers are not excluded.
  bool held() const { return held_; }

  static constexpr const char* kFileName = ".lock";

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  bool held_ = false;
};

}  // namespace relign::records
