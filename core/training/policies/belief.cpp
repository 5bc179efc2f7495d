#include "belief.hpp"

#include <algorithm>
#include <cmath>
#include <relign/portable_math.hpp>

namespace relign::policies {
namespace {

// Standard deviations in shares of the travel; limits that keep the weights finite, whatever a network answers.
constexpr double kLeastLogStd = -14, kLargestLogStd = 3;

}  // namespace

void Belief::add(const Pose& pose, const std::vector<double>& answer) {
  const std::size_t axes = pose.size();
  Answer added{pose, std::vector<double>(axes, 0.0), {}};
  for (std::size_t k = 0; k < axes; ++k) {
    for (std::size_t axis = 0; axis < axes; ++axis)
      added.goal[k] += doubt_->directions[k][axis] * (pose[axis] + answer[axis]);
    added.variance.push_back(portable_exp(2 * std::clamp(answer[axes + k], kLeastLogStd, kLargestLogStd)));
  }
  answers_.push_back(std::move(added));
}

Belief::Optimum Belief::optimum(const Pose& pose) const {
  const std::size_t axes = pose.size();
  Optimum found{Pose(axes, 0.0)};
  double mse = 0, mse_after = 0;
  for (std::size_t k = 0; k < axes; ++k) {
    double total = 0, weighted = 0, newest = 0;
    for (const Answer& answer : answers_) {
      double moved = 0;
      for (std::size_t axis = 0; axis < axes; ++axis)
        moved += (pose[axis] - answer.pose[axis]) * (pose[axis] - answer.pose[axis]);
      newest = 1 / (answer.variance[k] + doubt_->drift * doubt_->drift * moved);
      total += newest;
      weighted += newest * answer.goal[k];
    }
    for (std::size_t axis = 0; axis < axes; ++axis)
      found.pose[axis] += doubt_->directions[k][axis] * (weighted / total);
    const double shared = doubt_->floor[k] * doubt_->floor[k];
    mse += doubt_->effects[k] * (1 / total + shared);
    mse_after += doubt_->effects[k] * (1 / (total + newest) + shared);
  }
  found.rmse = std::sqrt(mse);
  found.rmse_after = std::sqrt(mse_after);
  return found;
}

}  // namespace relign::policies
