// What a scene is to an algorithm, as the JSON texts of a relign_task.
#pragma once

#include <string>

#include "base/json_source.h"
#include "trials/scene_facts.h"

namespace relign::trials {

inline std::string axes_text(const SceneFacts& scene) {
  Json axes = Json::array();
  for (const Axis& axis : scene.axes)
    axes.push_back({{"name", axis.name}, {"unit", axis.unit}, {"travel", axis.travel()}});
  return axes.dump();
}

inline std::string readings_text(const SceneFacts& scene) {
  Json readings = Json::array();
  for (const Reading& reading : scene.readings) readings.push_back({{"name", reading.name}, {"unit", reading.unit}});
  return readings.dump();
}

}  // namespace relign::trials
