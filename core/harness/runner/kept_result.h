// Cache of small results that are functions of plugins and data and take seconds to compute: the error around a scene's
// nominal pose, the bound of one more image.
#pragma once

#include <filesystem>
#include <string>

#include "base/json_source.h"
#include "runner/run.h"

namespace relign::runner {

class KeptResult {
 public:
  // `kind` is the folder below `cache`; `key` contains everything that determines the result, and its hash is the name
  // of the file. With an empty `cache` nothing is stored.
  KeptResult(const std::filesystem::path& cache, const std::string& kind, Json key);

  Json read() const;  // null when it is missing, damaged or of another key
  // Ignores failures: then the result is computed again the next time.
  void write(const Json& value) const noexcept;

 private:
  Json key_;
  std::filesystem::path file_;
};

// What determines a result of a scene of the plan: its plugin, parameters and data, and the processor if results may
// depend on it.
Json key_of_scene(const PreparedPlan& prepared, std::size_t scene);

}  // namespace relign::runner
