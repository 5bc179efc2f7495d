#include "report/scene_axes.h"

#include "base/files.h"
#include "base/inside.h"
#include "base/json_members.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxAxesBytes = 1'000'000;
constexpr std::size_t kMaxAxes = 16;

std::vector<SceneAxis> axes_of(const fs::path& file) {
  std::vector<SceneAxis> axes;
  std::error_code failed;
  if (fs::file_size(file, failed) > kMaxAxesBytes || failed) return axes;
  const Json description = parsed_json(read_file(file));
  for (const Json& axis : list_of(description, "axes")) {
    if (!axis.is_object() || axes.size() >= kMaxAxes) continue;
    const auto number = [&](const char* key) {
      return axis.contains(key) && axis[key].is_number() ? axis[key].get<double>() : 0.0;
    };
    axes.push_back({text_of(axis, "name"), text_of(axis, "unit"), number("lower"), number("upper"),
                    !axis.contains("observable") || flag_of(axis, "observable")});
  }
  return axes;
}

}  // namespace

fs::path scene_file(const fs::path& results, const Json& scene, const std::string& name) {
  const std::string folder = text_of(scene, "folder");
  const fs::path file = results / folder / name;
  std::error_code failed;
  const bool found = !folder.empty() && is_inside(file, results / "scenes") && fs::is_regular_file(file, failed);
  return found ? file : fs::path();
}

std::map<std::string, std::vector<SceneAxis>> scene_axes(const fs::path& results, const Json& manifest) {
  std::map<std::string, std::vector<SceneAxis>> all;
  for (const Json& scene : list_of(manifest, "scenes")) {
    const fs::path file = scene_file(results, scene, "description.json");
    if (file.empty()) continue;
    try {
      std::vector<SceneAxis> axes = axes_of(file);
      if (!axes.empty()) all[text_of(scene, "name")] = std::move(axes);
    } catch (const std::exception&) {  // optional: poses are then shown as shares
    }
  }
  return all;
}

}  // namespace relign::report
