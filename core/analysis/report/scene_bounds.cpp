#include "report/scene_bounds.h"

#include <limits>

#include "base/files.h"
#include "base/json_members.h"
#include "report/scene_axes.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMaxBoundsBytes = 1'000'000;

double mean_excess(const fs::path& file) {
  double sum = 0;
  std::size_t count = 0;
  const Json bounds = parsed_json(read_file(file, kMaxBoundsBytes));
  for (const Json& lens : list_of(bounds, "lenses")) {
    const Json excess = lens.is_object() ? lens.value("excess_mse", Json()) : Json();
    if (!excess.is_number() || !(excess.get<double>() >= 0)) return kUnknown;
    sum += excess.get<double>();
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : kUnknown;
}

}  // namespace

double next_image_excess(const fs::path& results, const Json& manifest, const std::string& scene,
                         const std::string& noise_level) {
  for (const Json& entry : list_of(manifest, "scenes")) {
    if (text_of(entry, "name") != scene) continue;
    const fs::path file = scene_file(results, entry, "next_image/" + noise_level + ".json");
    if (file.empty()) return kUnknown;
    try {
      return mean_excess(file);
    } catch (const std::exception&) {  // optional: the line is then left out
      return kUnknown;
    }
  }
  return kUnknown;
}

}  // namespace relign::report
