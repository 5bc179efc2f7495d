#include "report/scene_data.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/files.h"
#include "base/inside.h"
#include "base/json_members.h"
#include "base/limits.h"
#include "markup/escape.h"
#include "records/record.h"
#include "report/scene_axes.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSceneBytes = 300'000;
constexpr std::size_t kMaxDrawingBytes = 300'000;  // of a page
constexpr std::size_t kMaxPoints = 200;            // of a line
constexpr std::size_t kMaxPlanePoints = 50;        // on an axis
constexpr int kLandscapeDigits = 4;

// "" if absent or not inside scenes/.
std::string content(const fs::path& results, const records::ManifestScene& scene, const char* name) {
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

double shown_score(const Json& value, const SceneScore& score) {
  return value.is_number() ? rounded(score.shown(value.get<double>()), kLandscapeDigits) : kMissing;
}

// Shares of the travel in the unit of the axis; empty if one is outside 0 to 1, or if they do not ascend.
std::vector<double> in_units(const Json& shares, const SceneAxis& axis) {
  std::vector<double> values;
  for (const Json& share : shares) {
    if (!share.is_number() || share.get<double>() < 0 || share.get<double>() > 1) return {};
    const double value = rounded(axis.lower + share.get<double>() * (axis.upper - axis.lower), kLandscapeDigits);
    if (!values.empty() && !(value > values.back())) return {};
    values.push_back(value);
  }
  return values;
}

std::optional<LandscapePlane> plane_of(const Json& plane, const std::vector<SceneAxis>& axes, const SceneScore& score) {
  const SceneAxis *across = named(axes, text_of(plane, "across")), *up = named(axes, text_of(plane, "up"));
  if (!across || !up) return {};
  LandscapePlane made = {{across->name, across->unit, in_units(list_of(plane, "across_shares"), *across)},
                         {up->name, up->unit, in_units(list_of(plane, "up_shares"), *up)},
                         {}};
  const std::size_t columns = made.across.values.size(), rows = made.up.values.size();
  const Json& mse = list_of(plane, "mse");
  if (columns < 2 || rows < 2 || columns > kMaxPlanePoints || rows > kMaxPlanePoints || mse.size() != columns * rows)
    return {};
  for (const Json& value : mse) {
    if (!value.is_number()) return {};
    made.score.push_back(shown_score(value, score));
  }
  return made;
}

void add_landscape(SceneFacts& facts, const std::string& text, const std::vector<SceneAxis>& axes) {
  const Json file = parsed_json(text);
  if (!file.is_object() || count_of(file, "format") != static_cast<std::uint64_t>(records::kFormat)) return;
  const Json& pose = list_of(file, "pose");
  for (const Json& line : list_of(file, "lines")) {
    const SceneAxis* axis = named(axes, text_of(line, "axis"));
    const Json &shares = list_of(line, "shares"), &mse = list_of(line, "mse");
    if (!axis || shares.empty() || shares.size() > kMaxPoints || shares.size() != mse.size()) continue;
    const auto place = static_cast<std::size_t>(axis - axes.data());
    if (place >= pose.size() || !pose[place].is_number()) continue;
    LandscapeLine made = {axis->name, axis->unit, {}, {}};
    for (std::size_t k = 0; k < shares.size(); ++k) {
      if (!shares[k].is_number()) continue;
      made.away.push_back(rounded(100 * (shares[k].get<double>() - pose[place].get<double>()), kLandscapeDigits));
      made.score.push_back(shown_score(mse[k], facts.scored_by));
    }
    facts.landscape.push_back(std::move(made));
  }
  if (!facts.landscape.empty()) facts.plane = plane_of(object_of(file, "plane"), axes, facts.scored_by);
}

// The parameters of simulated machine time: the scene's, with the suite's overrides. Stations have their own clock.
// After the axes.
void add_clock(SceneFacts& facts, const records::ManifestScene& scene, const records::Manifest& manifest) {
  if (scene.owns_stage) return;
  const auto unused = [&facts](const std::string& name) {
    return name.rfind("speed_", 0) == 0 && !facts.axes.empty() &&
           std::none_of(facts.axes.begin(), facts.axes.end(), [&](const SceneAxis& axis) {
             return axis.speed_per_s == 0 && name == (axis.unit == "deg" ? "speed_deg_per_s" : "speed_mm_per_s");
           });
  };
  MachineTimeKeys::members(
      [&](const Member& member, const std::optional<double>& own, const std::optional<double>& suites) {
        const auto at = std::find_if(kClockParameters.begin(), kClockParameters.end(),
                                     [&member](const ClockParameter& one) { return one.name == member.key; });
        const auto k = static_cast<std::size_t>(at - kClockParameters.begin());
        if (const std::optional<double>& value = suites ? suites : own; value && !unused(std::string(member.key)))
          facts.clock[k] = shown(*value);
      },
      scene.machine_time, manifest.machine_time);
}

}  // namespace

std::vector<SceneFacts> scene_facts(const fs::path& results, const records::Manifest& manifest) {
  const auto all_axes = scene_axes(results, manifest);
  std::vector<SceneFacts> list;
  for (const records::ManifestScene& scene : manifest.scenes) {
    SceneFacts facts;
    facts.scene = scene.name;
    facts.id = scene.id;
    const Json description = parsed_json(content(results, scene, "description.json"));
    facts.summary = text_of(description, "summary");
    if (facts.summary.empty()) facts.summary = scene.summary;
    const Json& image = object_of(description, "image");
    facts.width = count_of(image, "width");
    facts.height = count_of(image, "height");
    facts.scored_by = scene.score;
    facts.words = words_of(description, facts.scored_by);
    for (const Json& reading : list_of(description, "readings"))
      facts.readings.push_back(with_unit(text_of(reading, "name"), text_of(reading, "unit")));
    if (const auto axes = all_axes.find(facts.scene); axes != all_axes.end()) {
      for (const SceneAxis& axis : axes->second)
        facts.axes.push_back(
            {axis.name, axis.unit, shown(axis.lower), shown(axis.upper), axis.observable, shown(axis.speed_per_s)});
      add_landscape(facts, content(results, scene, "landscape.json"), axes->second);
    }
    add_clock(facts, scene, manifest);
    list.push_back(std::move(facts));
  }
  return list;
}

std::map<std::string, std::string> scene_drawings(const fs::path& results, const records::Manifest& manifest) {
  std::map<std::string, std::string> drawings;
  std::size_t used = 0;
  for (const records::ManifestScene& scene : manifest.scenes) {
    const std::string svg = content(results, scene, "lens.svg");
    if (svg.compare(0, 4, "<svg") != 0 && svg.compare(0, 5, "<?xml") != 0) continue;
    std::string uri = "data:image/svg+xml;base64," + base64(svg);
    if ((used += uri.size()) > kMaxDrawingBytes) break;
    drawings[scene.name] = std::move(uri);
  }
  return drawings;
}

namespace {

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

double next_image_excess(const fs::path& results, const records::Manifest& manifest, const std::string& scene,
                         const std::string& noise_level) {
  const records::ManifestScene* entry = manifest.scene(scene);
  const fs::path file = entry ? scene_file(results, *entry, "next_image/" + noise_level + ".json") : fs::path();
  try {
    return file.empty() ? kUnknown : mean_excess(file);
  } catch (const std::exception&) {  // optional: the line is then left out
    return kUnknown;
  }
}

namespace {

constexpr std::uintmax_t kMaxAxesBytes = 1'000'000;

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
                    !axis.contains("observable") || flag_of(axis, "observable"), number("speed_per_s")});
  }
  return axes;
}

}  // namespace

fs::path scene_file(const fs::path& results, const records::ManifestScene& scene, const std::string& name) {
  const fs::path file = results / scene.folder / name;
  std::error_code failed;
  const bool found = !scene.folder.empty() && is_inside(file, results / "scenes") && fs::is_regular_file(file, failed);
  return found ? file : fs::path();
}

std::map<std::string, std::vector<SceneAxis>> scene_axes(const fs::path& results, const records::Manifest& manifest) {
  std::map<std::string, std::vector<SceneAxis>> all;
  for (const records::ManifestScene& scene : manifest.scenes) {
    const fs::path file = scene_file(results, scene, "description.json");
    if (file.empty()) continue;
    try {
      std::vector<SceneAxis> axes = axes_of(file);
      if (!axes.empty()) all[scene.name] = std::move(axes);
    } catch (const std::exception&) {  // optional: poses are then shown as shares
    }
  }
  return all;
}

}  // namespace relign::report
