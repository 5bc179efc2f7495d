// Candidates in the unit cube: sampling, selection, local refinement, and conversion to poses.
#pragma once

#include <relign/basics.hpp>
#include <relign/random.hpp>
#include <vector>

#include "bounded_lbfgs.hpp"
#include "kernel.hpp"

namespace surrogates {

Vector uniform_point(relign::Random& random, std::size_t dimensions);
// dimensions x count, one point per column.
Matrix uniform_points(relign::Random& random, std::size_t dimensions, std::size_t count);

// The same with one point in each of `count` slices of each axis: a Latin hypercube.
Matrix latin_hypercube(relign::Random& random, std::size_t dimensions, std::size_t count);

// Indices of the lowest costs, lowest first; equal costs by index, NaN last.
std::vector<Eigen::Index> lowest(const Vector& costs, std::size_t few);

// Minimises from each of the `few` candidates of lowest cost, for at most `iterations`, and returns the best result.
Minimum polish(const Objective& objective, const Matrix& candidates, const Vector& costs, std::size_t few,
               int iterations);

// Maps between a box and the unit cube. An axis of width 0 maps to 0.
class UnitBox {
 public:
  UnitBox() = default;
  explicit UnitBox(relign::Box box) : box_(std::move(box)) {}
  relign::Pose to_pose(const Vector& unit) const;
  Vector to_unit(const relign::Pose& pose) const;  // a pose outside the box maps outside the cube

 private:
  relign::Box box_;
};

}  // namespace surrogates
