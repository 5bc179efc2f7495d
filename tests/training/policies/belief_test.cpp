#include "policies/belief.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace relign::policies {
namespace {

Doubt two_directions() { return {{{0.6, 0.8}, {-0.8, 0.6}}, {1.5, 0.01}, {0.001, 0.02}, 0.015}; }

// Values of relign_bench.training.doubt.Belief, recomputed in NumPy from its definition.
TEST(Belief, MatchesPython) {
  const Doubt doubt = two_directions();
  Belief belief(doubt);
  belief.add({0.2, 0.3}, {0.25, 0.1, -4, -3});
  belief.add({0.4, 0.35}, {0.02, 0.06, -5, -2.5});
  const Belief::Optimum found = belief.optimum({0.4, 0.35});
  EXPECT_NEAR(found.pose[0], 0.4382249211038001, 1e-13);
  EXPECT_NEAR(found.pose[1], 0.39778485092335075, 1e-13);
  EXPECT_NEAR(found.rmse, 0.009157139037732394, 1e-14);
  EXPECT_NEAR(found.rmse_after, 0.007194457153176799, 1e-14);
}

TEST(Belief, ForgetsAnswersAfterLongMoves) {
  const Doubt doubt = two_directions();
  Belief belief(doubt);
  belief.add({0, 0}, {0.5, 0.5, -9, -9});
  belief.add({0.5, 0.5}, {0.01, 0.01, -9, -9});
  const Pose found = belief.optimum({0.5, 0.5}).pose;
  EXPECT_NEAR(found[0], 0.51, 1e-3);
  EXPECT_NEAR(found[1], 0.51, 1e-3);
}

TEST(Belief, StaysFiniteForExtremeDoubt) {
  const Doubt doubt = two_directions();
  Belief belief(doubt);
  belief.add({0.5, 0.5}, {0.1, 0.1, 1e30, -1e30});
  const Belief::Optimum found = belief.optimum({0.5, 0.5});
  EXPECT_TRUE(std::isfinite(found.pose[0]) && std::isfinite(found.rmse) && std::isfinite(found.rmse_after));
}

}  // namespace
}  // namespace relign::policies
