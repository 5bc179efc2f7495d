// Where the lens of a scene stands as designed, by what the scene says of itself.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <relign/basics.hpp>
#include <stdexcept>
#include <string>

#include "poses.hpp"

namespace pictures {

// True pose, in shares of the travel; the middle of each axis of which the scene says nothing. Throws
// std::runtime_error when it speaks of another number of axes.
inline Eigen::VectorXd nominal_pose(const std::string& scene_json, std::size_t axes) {
  const auto scene = nlohmann::json::parse(scene_json, nullptr, false);
  relign::Pose pose(axes, 0.5);
  if (scene.is_object() && scene.contains("nominal_pose") && scene["nominal_pose"].is_array()) {
    const auto& told = scene["nominal_pose"];
    if (told.size() != axes)
      throw std::runtime_error("the scene's nominal_pose has " + std::to_string(told.size()) + " numbers for " +
                               std::to_string(axes) + " axes");
    for (std::size_t axis = 0; axis < axes; ++axis)
      if (told[axis].is_number()) pose[axis] = told[axis].get<double>();
  }
  return to_vector(pose);
}

}  // namespace pictures
