// Complete trials of tolerance-fit on a toy lens. Its parts: parts_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "contract/run_plugin.h"
#include "toy_lens_test.h"

namespace relign {
namespace {

using test::ToyTrial;

void run(ToyTrial& toy, const Json& parameters = {}) {
  test::run_plugin("tolerance_fit", "tolerance-fit", parameters, *toy.trial);
}

double last_miss(const ToyTrial& toy) { return toy.miss(toy.trial->recommendations.back().pose); }

TEST(ToleranceFit, FindsBestPoseOfLensWithOffsets) {
  double own_way = 0, worst = 0;
  for (std::uint64_t instance = 1; instance <= 8; ++instance) {
    ToyTrial::Setup setup;
    setup.instance = instance;
    ToyTrial toy(setup);
    run(toy);
    own_way += toy.own_way() / 8;
    worst = std::max(worst, last_miss(toy));
  }
  EXPECT_GT(own_way, 0.03);  // otherwise the nominal pose would be good enough
  EXPECT_LT(worst, 0.003);
}

TEST(ToleranceFit, FindsItByDifferencesWhereTheModelHasNoDerivatives) {
  double worst = 0;
  for (std::uint64_t instance = 1; instance <= 4; ++instance) {
    ToyTrial::Setup setup;
    setup.instance = instance;
    setup.slopes = false;
    ToyTrial toy(setup);
    run(toy);
    worst = std::max(worst, last_miss(toy));
  }
  EXPECT_LT(worst, 0.003);
}

TEST(ToleranceFit, IgnoresGainOffsetAndStrayLight) {
  double worst = 0;
  for (std::uint64_t instance = 1; instance <= 4; ++instance) {
    ToyTrial::Setup setup;
    setup.instance = instance;
    setup.gain = 0.9F;
    setup.offset = 0.03F;
    setup.stray = 0.05F;
    ToyTrial toy(setup);
    run(toy, {{"stray_light", true}});
    worst = std::max(worst, last_miss(toy));
  }
  EXPECT_LT(worst, 0.004);
}

TEST(ToleranceFit, RecommendsAtEveryStepWithinLargestMove) {
  ToyTrial::Setup setup;
  setup.largest_move = 0.05;
  ToyTrial toy(setup);
  run(toy);
  const auto& trial = *toy.trial;
  ASSERT_EQ(trial.steps.size(), setup.budget);
  for (std::size_t made = 0; made <= setup.budget; ++made)
    EXPECT_TRUE(std::any_of(trial.recommendations.begin(), trial.recommendations.end(), [&](const auto& one) {
      return one.steps_made == made;
    })) << made;
  std::vector<double> before(setup.axes, 0.0);
  for (const auto& visit : trial.steps) {
    for (std::size_t axis = 0; axis < before.size(); ++axis)
      EXPECT_LE(std::fabs(visit.pose[axis] - before[axis]), 0.05 + 1e-12);
    before = visit.pose;
  }
}

TEST(ToleranceFit, ImprovesWithCapturesUnderHeavyNoise) {
  double early = 0, late = 0;
  for (std::uint64_t instance = 1; instance <= 6; ++instance) {
    ToyTrial::Setup setup;
    setup.instance = instance;
    setup.noise = 0.4;
    setup.budget = 12;
    ToyTrial toy(setup);
    run(toy);
    for (const auto& one : toy.trial->recommendations)
      if (one.steps_made == 1) early += toy.miss(one.pose);
    late += last_miss(toy);
  }
  EXPECT_LT(late, 0.6 * early);
}

TEST(ToleranceFit, AcceptsAnyNumberOfAxesAndModelsWithoutDerivativesOrNoiseFreeImages) {
  for (const std::uint32_t axes : {1u, 2u, 3u, 5u}) {
    SCOPED_TRACE(axes);
    ToyTrial::Setup setup;
    setup.axes = axes;
    setup.noise_free = axes != 3;
    setup.slopes = axes == 1 || axes == 5;
    ToyTrial toy(setup);
    run(toy);
    EXPECT_LT(last_miss(toy), axes == 3 ? 0.03 : 0.01);
    EXPECT_LE(toy.most_mounted, 16u);
  }
}

TEST(ToleranceFit, AlignsLensWithoutOffsets) {
  ToyTrial::Setup setup;
  setup.offset_std = 0;
  ToyTrial toy(setup);
  run(toy);
  EXPECT_LT(last_miss(toy), 0.003);
}

TEST(ToleranceFit, CachedKnowledgeGivesTheSameSteps) {
  ToyTrial::Setup setup, other;
  other.offset_std = 2;
  ToyTrial one(setup), between(other), two(setup);
  run(one);
  run(between);
  run(two);
  ASSERT_EQ(one.trial->steps.size(), two.trial->steps.size());
  for (std::size_t step = 0; step < one.trial->steps.size(); ++step)
    EXPECT_EQ(one.trial->steps[step].pose, two.trial->steps[step].pose);
}

TEST(ToleranceFit, ReturnsWhenStoppedAtAnyStep) {
  for (unsigned budget = 0; budget <= 6; ++budget) {
    ToyTrial::Setup setup;
    setup.budget = budget;
    ToyTrial toy(setup);
    run(toy);
    EXPECT_EQ(toy.trial->steps.size(), budget);
    EXPECT_EQ(toy.trial->requests_after_stop, 0u);
  }
}

}  // namespace
}  // namespace relign
