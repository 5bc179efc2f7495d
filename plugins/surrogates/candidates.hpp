// The unit cube that surrogates search: its points, the best of many, and the way back to poses.
#pragma once

#include <relign/basics.hpp>
#include <relign/random.hpp>
#include <vector>

#include "bounded_lbfgs.hpp"
#include "kernel.hpp"

namespace surrogates {

Vector uniform_point(relign::Random& random, std::size_t dimensions);
// One point per column.
Matrix uniform_points(relign::Random& random, std::size_t dimensions, std::size_t count);

// Indices of the lowest costs, lowest first; the earlier one where they are equal, NaN last.
std::vector<Eigen::Index> lowest(const Vector& costs, std::size_t few);

// The few candidates of lowest cost, each followed downhill in the unit cube for so many iterations: the best end.
Minimum polish(const Objective& objective, const Matrix& candidates, const Vector& costs, std::size_t few,
               int iterations);

// Along an axis without width every pose is 0 in the cube.
class UnitBox {
 public:
  UnitBox() = default;
  explicit UnitBox(relign::Box box) : box_(std::move(box)) {}
  relign::Pose to_pose(const Vector& unit) const;
  Vector to_unit(const relign::Pose& pose) const;  // outside the cube for a pose outside the box

 private:
  relign::Box box_;
};

}  // namespace surrogates
