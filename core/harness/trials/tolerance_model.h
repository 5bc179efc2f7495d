// What offsets of elements do to the image of a designed lens, to first order: from derivatives at the nominal pose.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <string>

#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// Five numbers for each element, in the order of the scene's description: shift_mm x, y, z and tilt_deg x, y.
inline constexpr Eigen::Index kOffsetsAnElement = 5;
inline constexpr const char* kOffsetNames[] = {"shift x", "shift y", "shift z", "tilt x", "tilt y"};
Eigen::VectorXd offsets_of(const std::string& elements_json, const SceneFacts& scene);

// Quadratic forms of offsets: the MSE of the image that they make against the design's own image.
struct ToleranceModel {
  Eigen::MatrixXd at_nominal;  // at the nominal pose
  Eigen::MatrixXd aligned;     // at the pose at which it is lowest
  Eigen::MatrixXd error;       // of `aligned`: half the difference of two independent estimates
  Eigen::MatrixXd moves;       // axes x offsets: from the nominal pose to that pose
};

// From four independent renders of `samples` rays per pixel; products of different ones have no bias. Nothing where the
// scene offers no derivatives.
std::optional<ToleranceModel> tolerance_model(plugin_host::MountedAssembly& design, const SceneFacts& scene,
                                              std::uint32_t samples);

}  // namespace relign::trials
