// Pretrained data (relign.prepared/1) in the user's cache:
//   prepared/<plugin>/<hash of the key>.data   the algorithm's bytes
//   prepared/<plugin>/<hash of the key>.json   {"format", "key", "sha256", "bytes", "made": {...}}
// The key contains everything that the bytes depend on. The side file repeats it, so that users can identify a file,
// and damaged or foreign files are detected.
#pragma once

#include <filesystem>
#include <string>

#include "base/json_source.h"
#include "trials/pretraining.h"

namespace relign::runner {

class PretrainingStore {
 public:
  // With an empty `cache` nothing is stored. `plugin`: its id, which is the folder's name.
  PretrainingStore(const std::filesystem::path& cache, const std::string& plugin, Json key);

  // Null bytes when there are none. `problem`: what is wrong with existing files; else empty.
  trials::PretrainingData read(std::string& problem) const;

  // Atomic: another process reads the old pair or the new one, or detects a mix. Throws Error(io). `made` is
  // provenance: date, duration, program.
  void write(const trials::PretrainingData& data, const Json& made) const;

  bool keeps() const { return !data_file_.empty(); }
  const std::filesystem::path& data_file() const { return data_file_; }
  const std::filesystem::path& sidecar() const { return sidecar_; }

 private:
  Json key_;
  std::filesystem::path data_file_, sidecar_;
};

}  // namespace relign::runner
