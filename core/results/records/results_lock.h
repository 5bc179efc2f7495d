// One writer at a time in a results folder.
#pragma once

#include <filesystem>
#include <string>

#include "base/error.h"

namespace relign::records {

// Error(io): another process holds the lock now.
class FolderInUse : public Error {
 public:
  explicit FolderInUse(const std::string& message) : Error(ErrorKind::io, message) {}
};

// Holds the folder's lock file until destroyed; the file is gone afterwards.
class ResultsLock {
 public:
  // Throws FolderInUse when another process writes the folder now, Error(io) when the file cannot be made.
  explicit ResultsLock(const std::filesystem::path& folder, const std::string& file_name = kFileName);
  ~ResultsLock();
  ResultsLock(const ResultsLock&) = delete;
  ResultsLock& operator=(const ResultsLock&) = delete;

  // False on a file system without locks: then nobody is kept out.
  bool held() const { return held_; }

  static constexpr const char* kFileName = ".lock";

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  bool held_ = false;
};

}  // namespace relign::records
