// Where an instance's optimum is, from a network's answers and its doubt about each. relign_bench.training.doubt has
// the same rule.
#pragma once

#include <relign/plugin.hpp>
#include <vector>

#include "side_file.hpp"

namespace relign::policies {

// Each answer is a normal distribution of the optimum along the directions of Doubt. Its weight falls with the distance
// that the stage has moved since, because the answer is in coordinates of the stage.
class Belief {
 public:
  explicit Belief(const Doubt& doubt) : doubt_(&doubt) {}  // `doubt` must outlive this object

  // pose: the commanded pose of the capture. answer: the residual to the optimum per axis, then the logarithms of the
  // standard deviations of its errors along the directions (2 x axes values).
  void add(const Pose& pose, const std::vector<double>& answer);

  struct Optimum {
    Pose pose;              // expected, as a commanded pose
    double rmse = 0;        // expected excess RMSE there, in the scene's units
    double rmse_after = 0;  // the same after another answer as certain as the newest
  };
  // pose: the stage's commanded pose now. Requires an answer.
  Optimum optimum(const Pose& pose) const;

 private:
  struct Answer {
    Pose pose;
    std::vector<double> goal, variance;  // along the directions
  };

  const Doubt* doubt_;
  std::vector<Answer> answers_;
};

}  // namespace relign::policies
