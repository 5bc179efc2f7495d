#include "candidates.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace surrogates {

Vector uniform_point(relign::Random& random, std::size_t dimensions) {
  Vector point(static_cast<Eigen::Index>(dimensions));
  for (double& coordinate : point) coordinate = random.uniform();
  return point;
}

Matrix uniform_points(relign::Random& random, std::size_t dimensions, std::size_t count) {
  Matrix drawn(static_cast<Eigen::Index>(dimensions), static_cast<Eigen::Index>(count));
  for (double& coordinate : drawn.reshaped()) coordinate = random.uniform();
  return drawn;
}

Matrix latin_hypercube(relign::Random& random, std::size_t dimensions, std::size_t count) {
  Matrix points(static_cast<Eigen::Index>(dimensions), static_cast<Eigen::Index>(count));
  std::vector<std::size_t> slices(count);
  for (Eigen::Index axis = 0; axis < points.rows(); ++axis) {
    std::iota(slices.begin(), slices.end(), std::size_t{0});
    for (std::size_t i = count; i > 1; --i) std::swap(slices[i - 1], slices[random.below(i)]);
    for (std::size_t i = 0; i < count; ++i)
      points(axis, static_cast<Eigen::Index>(i)) =
          (static_cast<double>(slices[i]) + random.uniform()) / static_cast<double>(count);
  }
  return points;
}

std::vector<Eigen::Index> lowest(const Vector& costs, std::size_t few) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(costs.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  few = std::min(few, order.size());
  const auto before = [&](Eigen::Index a, Eigen::Index b) {
    const bool a_counts = !std::isnan(costs[a]);
    const bool b_counts = !std::isnan(costs[b]);
    if (a_counts != b_counts) return a_counts;
    return a_counts && costs[a] != costs[b] ? costs[a] < costs[b] : a < b;
  };
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(few), order.end(), before);
  order.resize(few);
  return order;
}

Minimum polish(const Objective& objective, const Matrix& candidates, const Vector& costs, std::size_t few,
               int iterations) {
  SearchLimits limits;
  limits.iterations = iterations;
  const Eigen::Index size = candidates.rows();
  Minimum best;
  for (const Eigen::Index index : lowest(costs, few)) {
    Minimum found = minimize(objective, candidates.col(index), Vector::Zero(size), Vector::Ones(size), limits);
    if (best.at.size() == 0 || found.value < best.value) best = std::move(found);
  }
  return best;
}

relign::Pose UnitBox::to_pose(const Vector& unit) const {
  relign::Pose pose(box_.lower.size());
  for (std::size_t axis = 0; axis < pose.size(); ++axis)
    pose[axis] = box_.lower[axis] + unit[static_cast<Eigen::Index>(axis)] * (box_.upper[axis] - box_.lower[axis]);
  return box_.clamp(pose);  // rounding
}

Vector UnitBox::to_unit(const relign::Pose& pose) const {
  Vector unit(static_cast<Eigen::Index>(pose.size()));
  for (std::size_t axis = 0; axis < pose.size(); ++axis) {
    const double width = box_.upper[axis] - box_.lower[axis];
    unit[static_cast<Eigen::Index>(axis)] = width > 0 ? (pose[axis] - box_.lower[axis]) / width : 0;
  }
  return unit;
}

}  // namespace surrogates
