// Conversion between poses and Eigen vectors.
#pragma once

#include <Eigen/Dense>
#include <relign/basics.hpp>

namespace least_squares {

inline Eigen::VectorXd to_vector(const relign::Pose& pose) {
  return Eigen::Map<const Eigen::VectorXd>(pose.data(), static_cast<Eigen::Index>(pose.size()));
}
inline relign::Pose to_pose(const Eigen::VectorXd& point) {
  return relign::Pose(point.data(), point.data() + point.size());
}

}  // namespace least_squares
