// What was prepared (relign.prepared/1), kept in the user's cache from one run to the next:
//   prepared/<plugin>/<hash of the key>.data   the algorithm's bytes
//   prepared/<plugin>/<hash of the key>.json   {"format", "key", "sha256", "bytes", "made": {...}}
// The key is everything that the bytes depend on; the sidecar repeats it, so that whoever looks into the folder can
// tell what a file is, and a file that is damaged or belongs to something else is noticed.
#pragma once

#include <filesystem>
#include <string>

#include "base/json_source.h"
#include "trials/prepared_service.h"

namespace relign::runner {

class PreparedStore {
 public:
  // `cache` empty: nothing is kept. `plugin`: its id, a folder's name.
  PreparedStore(const std::filesystem::path& cache, const std::string& plugin, Json key);

  // Null bytes when there are none. `problem` says what is wrong with files that are there; else it is empty.
  trials::PreparedData read(std::string& problem) const;

  // Atomic: another process sees the old pair, the new one, or notices. Throws Error(io). `made` is provenance: when,
  // how long, by which program.
  void write(const trials::PreparedData& data, const Json& made) const;

  bool keeps() const { return !data_file_.empty(); }
  const std::filesystem::path& data_file() const { return data_file_; }
  const std::filesystem::path& sidecar() const { return sidecar_; }

 private:
  Json key_;
  std::filesystem::path data_file_, sidecar_;
};

}  // namespace relign::runner
