#include "base/scene_score.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/characters.h"
#include "base/json_members.h"

namespace relign {
namespace {

constexpr const char* kLogarithmic = "log";
constexpr const char* kLinear = "linear";

}  // namespace

SceneScore read_scene_score(const JsonSource& source, const Measurements& measured, std::optional<std::size_t>& measure,
                            std::vector<Problem>& problems) {
  const std::vector<Reading>& readings = measured.readings;
  ObjectReader reader(source, "/score", problems);
  SceneScore score;
  score.squared = false;
  score.name = reader.required_string("name");
  if (reader.has("name") &&
      (score.name.empty() || score.name == SceneScore().name || !line_mistake(score.name).empty()))
    reader.complain("name", "expected a name in one line other than 'RMSE', found '" + score.name + "'");
  score.unit = reader.string("unit", "");
  if (!line_mistake(score.unit).empty()) reader.complain("unit", "expected a unit in one line");
  const std::string scale = reader.string("scale", kLinear);
  if (scale != kLinear && scale != kLogarithmic)
    reader.complain("scale", "expected 'linear' or 'log', found '" + scale + "'");
  score.logarithmic = scale == kLogarithmic;
  score.resolution =
      reader.required_number("resolution", std::numeric_limits<double>::min(), std::numeric_limits<double>::max());
  const std::string measured_by = reader.string("reading", "");
  const auto found =
      std::find_if(readings.begin(), readings.end(), [&](const Reading& r) { return r.name == measured_by; });
  if (found != readings.end())
    measure = measured.pixels + static_cast<std::size_t>(found - readings.begin());
  else if (reader.has("reading"))
    reader.complain("reading", "expected the name of one of the 'readings', found '" + measured_by + "'");
  else if (!readings.empty())
    reader.complain_missing("reading", "the name of the reading that measures the score");
  if (found != readings.end() && found->unit != score.unit)
    reader.complain("unit",
                    "is '" + score.unit + "', but that of the reading '" + measured_by + "' is '" + found->unit + "'");
  reader.reject_unknown();
  return score;
}

Json scene_score_json(const SceneScore& score) {
  return {{"name", score.name},
          {"unit", score.unit},
          {"scale", score.logarithmic ? kLogarithmic : kLinear},
          {"resolution", score.resolution}};
}

SceneScore scene_score_of(const Json& scene) {
  const Json& json = member(scene, "score");
  SceneScore score;
  if (!json.is_object()) return score;
  score.squared = false;
  score.name = text_of(json, "name");
  score.unit = text_of(json, "unit");
  score.logarithmic = text_of(json, "scale") == kLogarithmic;
  if (const Json& resolution = member(json, "resolution"); resolution.is_number() && resolution.get<double>() > 0)
    score.resolution = resolution.get<double>();
  return score;
}

}  // namespace relign
