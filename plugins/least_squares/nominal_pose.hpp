// The nominal pose of a scene's lens, from the scene's description.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <relign/basics.hpp>
#include <stdexcept>
#include <string>

#include "poses.hpp"

namespace least_squares {

// Returns the nominal true pose, in shares of the travel: key "nominal_pose", 0.5 for axes without a number there.
// Throws std::runtime_error if the key has another number of axes.
inline Eigen::VectorXd nominal_pose(const std::string& scene_json, std::size_t axes) {
  const auto scene = nlohmann::json::parse(scene_json, nullptr, false);
  relign::Pose pose(axes, 0.5);
  if (scene.is_object() && scene.contains("nominal_pose") && scene["nominal_pose"].is_array()) {
    const auto& given = scene["nominal_pose"];
    if (given.size() != axes)
      throw std::runtime_error("'nominal_pose' of the scene has " + std::to_string(given.size()) +
                               " numbers; must have " + std::to_string(axes) + ", one per axis");
    for (std::size_t axis = 0; axis < axes; ++axis)
      if (given[axis].is_number()) pose[axis] = given[axis].get<double>();
  }
  return to_vector(pose);
}

}  // namespace least_squares
