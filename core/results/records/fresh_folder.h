// A results folder that takes its place only when it is whole: until then what was there stays as it is.
// Used inside this room.
#pragma once

#include <filesystem>
#include <optional>

#include "records/results_lock.h"

namespace relign::records {

class FreshFolder {
 public:
  // Made as OUT.merging. Throws Error(bad_input) when there is something at `out` that merge did not make, Error(io)
  // for a folder that cannot be written or in which another merge works.
  explicit FreshFolder(const std::filesystem::path& out);
  ~FreshFolder();  // without put_in_place nothing is left
  FreshFolder(const FreshFolder&) = delete;
  FreshFolder& operator=(const FreshFolder&) = delete;

  const std::filesystem::path& path() const { return fresh_; }

  // Files beside the old results that are nobody's results are kept.
  void put_in_place();

 private:
  void refuse_foreign() const;
  void keep_strangers() const;
  std::filesystem::path out_, fresh_, old_;
  std::optional<ResultsLock> lock_;
  bool in_place_ = false;
};

}  // namespace relign::records
