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

// Name and unit. taken: names of the scene's other scores.
FurtherScore read_named(ObjectReader& reader, const std::vector<std::string>& taken) {
  FurtherScore found;
  found.name = reader.required_string("name");
  const bool known = std::find(taken.begin(), taken.end(), found.name) != taken.end();
  if (reader.has("name") && (found.name.empty() || known || !line_mistake(found.name).empty()))
    reader.complain(
        "name", "expected a name in one line, other than 'RMSE' and that of another score, found '" + found.name + "'");
  found.unit = reader.string("unit", "");
  if (!line_mistake(found.unit).empty()) reader.complain("unit", "expected a unit in one line");
  return found;
}

std::vector<FurtherScore> read_further(const JsonSource& source, ObjectReader& reader, const std::string& score,
                                       std::vector<Problem>& problems) {
  std::vector<FurtherScore> further;
  const Json* list = reader.get("further");
  if (!list) return further;
  if (!list->is_array() || list->size() > kMostFurtherScores) {
    reader.complain("further", "expected a list of at most " + std::to_string(kMostFurtherScores) +
                                   R"( {"name": ..., "unit": ...})");
    return further;
  }
  std::vector<std::string> taken = {SceneScore().name, score};
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader one(source, reader.pointer_to("further") + "/" + std::to_string(i), problems);
    further.push_back(read_named(one, taken));
    taken.push_back(further.back().name);
    one.reject_unknown();
  }
  return further;
}

}  // namespace

SceneScore read_scene_score(const JsonSource& source, const Measurements& measured, std::optional<std::size_t>& measure,
                            std::vector<Problem>& problems) {
  const std::vector<Reading>& readings = measured.readings;
  ObjectReader reader(source, "/score", problems);
  SceneScore score;
  score.squared = false;
  const FurtherScore named = read_named(reader, {SceneScore().name});
  score.name = named.name;
  score.unit = named.unit;
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
  score.further = read_further(source, reader, score.name, problems);
  reader.reject_unknown();
  return score;
}

const FurtherScore* SceneScore::further_of(Criterion criterion) const {
  for (std::size_t i = 0; i < further.size() && i < kMostFurtherScores; ++i)
    if (further_score(i) == criterion) return &further[i];
  return nullptr;
}

Json JsonForm<SceneScore>::write(const SceneScore& score) {
  return json_of(
      StatedScore{score.name, score.unit, score.logarithmic ? kLogarithmic : kLinear, score.resolution, score.further});
}

void JsonForm<SceneScore>::read(const Member& member, const Json& json, SceneScore& score, JsonFlaws& flaws) {
  StatedScore stated;
  JsonForm<StatedScore>::read(member, json, stated, flaws);
  if (stated.further.size() > kMostFurtherScores)
    flaws.add("has more than " + std::to_string(kMostFurtherScores) + " further scores");
  score = {stated.name, stated.unit, stated.scale == kLogarithmic, stated.resolution, false, stated.further};
}

}  // namespace relign
