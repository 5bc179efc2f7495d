// A results folder that is built beside its destination and replaces it only when complete. Internal to this module.
#pragma once

#include <filesystem>
#include <optional>

#include "records/results_lock.h"

namespace relign::records {

class FreshFolder {
 public:
  // Creates OUT.merging. Throws Error(bad_input) when `out` exists and merge did not make it, Error(io) for a folder
  // that cannot be written or that another merge is writing.
  explicit FreshFolder(const std::filesystem::path& out);
  ~FreshFolder();  // removes the folder unless put_in_place succeeded
  FreshFolder(const FreshFolder&) = delete;
  FreshFolder& operator=(const FreshFolder&) = delete;

  const std::filesystem::path& path() const { return fresh_; }

  // Replaces `out`. Keeps files beside the old results that are not part of a results folder.
  void put_in_place();

 private:
  void refuse_foreign() const;
  void keep_foreign_files() const;
  std::filesystem::path out_, fresh_, old_;
  std::optional<ResultsLock> lock_;
  bool in_place_ = false;
};

}  // namespace relign::records
