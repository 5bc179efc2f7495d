#include "report/scene_data.h"

#include <cmath>

#include "base/displayed_rmse.h"
#include "base/error.h"
#include "base/files.h"
#include "base/json_members.h"
#include "markup/escape.h"
#include "records/record.h"
#include "report/page_data.h"
#include "report/scene_axes.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSceneBytes = 300'000;
constexpr std::size_t kMaxDrawingBytes = 300'000;  // of a page
constexpr std::size_t kMaxPoints = 200;            // of a line
constexpr std::size_t kMaxPlanePoints = 50;        // on an axis
constexpr int kDataDigits = 4;

// "" if absent or not inside scenes/.
std::string content(const fs::path& results, const Json& scene, const char* name) {
  const fs::path file = scene_file(results, scene, name);
  if (file.empty()) return "";
  try {
    return read_file(file, kMaxSceneBytes);
  } catch (const Error&) {
    return "";
  }
}

const SceneAxis* named(const std::vector<SceneAxis>& axes, const std::string& name) {
  for (const SceneAxis& axis : axes)
    if (axis.name == name) return &axis;
  return nullptr;
}

Json rmse(const Json& mse) {
  if (!mse.is_number()) return nullptr;
  return rounded(displayed_rmse(mse.get<double>()), kDataDigits);
}

// Shares of the travel in the unit of the axis; empty if one is outside 0 to 1, or if they do not ascend.
Json in_units(const Json& shares, const SceneAxis& axis) {
  Json values = Json::array();
  for (const Json& share : shares) {
    if (!share.is_number() || share.get<double>() < 0 || share.get<double>() > 1) return Json::array();
    const double value = rounded(axis.lower + share.get<double>() * (axis.upper - axis.lower), kDataDigits);
    if (!values.empty() && !(value > values.back().get<double>())) return Json::array();
    values.push_back(value);
  }
  return values;
}

Json plane_of(const Json& plane, const std::vector<SceneAxis>& axes) {
  const SceneAxis *across = named(axes, text_of(plane, "across")), *up = named(axes, text_of(plane, "up"));
  if (!across || !up) return nullptr;
  const Json columns = in_units(list_of(plane, "across_shares"), *across),
             rows = in_units(list_of(plane, "up_shares"), *up);
  const Json& mse = list_of(plane, "mse");
  if (columns.size() < 2 || rows.size() < 2 || columns.size() > kMaxPlanePoints || rows.size() > kMaxPlanePoints ||
      mse.size() != columns.size() * rows.size())
    return nullptr;
  Json values = Json::array();
  for (const Json& value : mse) {
    if (!value.is_number()) return nullptr;
    values.push_back(rmse(value));
  }
  return {{"across", {{"name", across->name}, {"unit", across->unit}, {"values", columns}}},
          {"up", {{"name", up->name}, {"unit", up->unit}, {"values", rows}}},
          {"rmse", std::move(values)}};
}

Json landscape_of(const std::string& text, const std::vector<SceneAxis>& axes) {
  const Json file = Json::parse(text, nullptr, false);
  if (!file.is_object() || count_of(file, "format") != static_cast<std::uint64_t>(records::kFormat)) return nullptr;
  const Json& pose = list_of(file, "pose");
  Json lines = Json::array();
  for (const Json& line : list_of(file, "lines")) {
    const SceneAxis* axis = named(axes, text_of(line, "axis"));
    const Json &shares = list_of(line, "shares"), &mse = list_of(line, "mse");
    if (!axis || shares.empty() || shares.size() > kMaxPoints || shares.size() != mse.size()) continue;
    const auto place = static_cast<std::size_t>(axis - axes.data());
    if (place >= pose.size() || !pose[place].is_number()) continue;
    Json away = Json::array(), values = Json::array();
    for (std::size_t k = 0; k < shares.size(); ++k) {
      if (!shares[k].is_number()) continue;
      away.push_back(rounded(100 * (shares[k].get<double>() - pose[place].get<double>()), kDataDigits));
      values.push_back(rmse(mse[k]));
    }
    lines.push_back({{"axis", axis->name}, {"unit", axis->unit}, {"away", away}, {"rmse", values}});
  }
  if (lines.empty()) return nullptr;
  Json landscape = {{"lines", std::move(lines)}};
  if (Json plane = plane_of(object_of(file, "plane"), axes); !plane.is_null()) landscape["plane"] = std::move(plane);
  return landscape;
}

// The parameters of simulated machine time: the scene's, with the suite's overrides. Null if unknown.
Json clock_data(const Json& scene, const Json& manifest) {
  if (flag_of(scene, "owns_stage")) return nullptr;
  const Json &own = object_of(scene, "machine_time"), &suites = object_of(manifest, "machine_time");
  Json clock;
  for (const char* key : {"speed_mm_per_s", "speed_deg_per_s", "settle_ms", "exposure_ms", "readout_ms"}) {
    const Json value = suites.contains(key) ? suites[key] : own.value(key, Json());
    if (value.is_number()) clock[key] = shown_number(value.get<double>());
  }
  return clock;
}

}  // namespace

Json scene_facts(const fs::path& results, const Json& manifest) {
  const auto all_axes = scene_axes(results, manifest);
  Json list = Json::array();
  for (const Json& scene : list_of(manifest, "scenes")) {
    const std::string name = text_of(scene, "name");
    if (name.empty()) continue;
    Json facts = {{"scene", name}, {"id", text_of(scene, "id")}};
    const Json description = Json::parse(content(results, scene, "description.json"), nullptr, false);
    const std::string summary = text_of(description, "summary");
    facts["summary"] = summary.empty() ? text_of(scene, "summary") : summary;
    const Json& image = object_of(description, "image");
    facts["width"] = count_of(image, "width");
    facts["height"] = count_of(image, "height");
    if (Json clock = clock_data(scene, manifest); !clock.is_null()) facts["machine_time"] = std::move(clock);
    const auto axes = all_axes.find(name);
    facts["axes"] = Json::array();
    if (axes != all_axes.end()) {
      for (const SceneAxis& axis : axes->second)
        facts["axes"].push_back({{"name", axis.name},
                                 {"unit", axis.unit},
                                 {"lower", shown_number(axis.lower)},
                                 {"upper", shown_number(axis.upper)}});
      if (Json landscape = landscape_of(content(results, scene, "landscape.json"), axes->second); !landscape.is_null())
        facts["landscape"] = std::move(landscape);
    }
    list.push_back(std::move(facts));
  }
  return list;
}

std::map<std::string, std::string> scene_drawings(const fs::path& results, const Json& manifest) {
  std::map<std::string, std::string> drawings;
  std::size_t used = 0;
  for (const Json& scene : list_of(manifest, "scenes")) {
    const std::string svg = content(results, scene, "lens.svg");
    if (svg.compare(0, 4, "<svg") != 0 && svg.compare(0, 5, "<?xml") != 0) continue;
    std::string uri = "data:image/svg+xml;base64," + base64(svg);
    if ((used += uri.size()) > kMaxDrawingBytes) break;
    drawings[text_of(scene, "name")] = std::move(uri);
  }
  return drawings;
}

}  // namespace relign::report
