// Small results that follow from plugins and data alone and take seconds to make, kept in the cache from one run to the
// next: the error around a scene's nominal pose, the bound of one more image.
#pragma once

#include <filesystem>
#include <string>

#include "base/json_source.h"
#include "runner/run.h"

namespace relign::runner {

class KeptResult {
 public:
  // `kind` names its folder below `cache`; `key` holds all that the result follows from, and its hash names the file.
  // An empty cache keeps nothing.
  KeptResult(const std::filesystem::path& cache, const std::string& kind, Json key);

  Json read() const;  // null where it was not kept, is damaged or belongs to another key
  // A result that cannot be kept is made again the next time: throws nothing.
  void write(const Json& value) const noexcept;

 private:
  Json key_;
  std::filesystem::path file_;
};

// What a result of a scene of the plan follows from: its plugin, parameters and data, and where it may differ by the
// processor, that.
Json key_of_scene(const PreparedPlan& prepared, std::size_t scene);

}  // namespace relign::runner
