// The stage's motion law: values computed by hand, and properties of any sequence of moves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <relign/random.hpp>

#include "base/error.h"
#include "trials/stage_motion.h"

namespace relign::trials {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

SceneFacts scene_with(std::size_t axes) {
  SceneFacts scene;
  for (std::size_t i = 0; i < axes; ++i)
    scene.axes.push_back(i < 3 ? Axis{"a" + std::to_string(i), "mm", -1, 1}
                               : Axis{"r" + std::to_string(i), "deg", -7, 7});
  scene.nominal_pose.assign(axes, 0.5);
  return scene;
}

Instance perturbations(std::vector<double> start, std::vector<double> distortion) {
  return {0, 0, {std::move(start), std::move(distortion), "{}"}};
}

auto near(const std::vector<double>& expected) { return Pointwise(DoubleNear(1e-14), expected); }

const std::vector<double> kIdentity = {1, 0, 0, 1};

TEST(StageMotion, DistortsMovesAsComputedByHand) {
  // true = start + D (c - c_start): (0.3, 0.6) + [[1.1, 0.2], [-0.1, 0.9]] (0.2, -0.1) = (0.5, 0.49)
  StageMotion stage(scene_with(2), perturbations({0.3, 0.6}, {1.1, 0.2, -0.1, 0.9}), {0, 0}, Limits::soft);
  EXPECT_THAT(stage.true_pose(), ElementsAre(0.3, 0.6));
  EXPECT_THAT(stage.commanded_pose(), ElementsAre(0, 0));
  const StageMotion::Arrival arrival = stage.step_to({0.2, -0.1});
  EXPECT_THAT(arrival.true_pose, near({0.5, 0.49}));
  EXPECT_THAT(arrival.commanded_pose, ElementsAre(0.2, -0.1));
  EXPECT_THAT(arrival.reached_pose, ElementsAre(0.2, -0.1));
  EXPECT_EQ(arrival.limits_low, 0u);
  EXPECT_EQ(arrival.limits_high, 0u);
  // A relative move adds D a: (0.5, 0.49) + D (0.1, 0.1) = (0.63, 0.57)
  const StageMotion::Arrival moved = stage.move_by({0.1, 0.1});
  EXPECT_THAT(moved.true_pose, near({0.63, 0.57}));
  EXPECT_THAT(moved.commanded_pose, near({0.3, 0.0}));
}

TEST(StageMotion, AcceptsCoordinatesOfTheStage) {
  // The same distortion with coordinates of the stage: a move to the nominal pose 0.5 misses it by the distortion only.
  StageMotion stage(scene_with(2), perturbations({0.3, 0.6}, {1.1, 0.2, -0.1, 0.9}), {0.3, 0.6}, Limits::soft);
  EXPECT_THAT(stage.step_to({0.5, 0.5}).true_pose, near({0.5, 0.49}));
}

TEST(StageMotion, SoftLimitsStopEachAxisSeparately) {
  StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, kIdentity), {0, 0}, Limits::soft);
  const StageMotion::Arrival arrival = stage.step_to({0.8, -0.2});
  EXPECT_THAT(arrival.true_pose, near({1.0, 0.3}));
  EXPECT_EQ(arrival.limits_high, 1u);
  EXPECT_EQ(arrival.limits_low, 0u);
  EXPECT_THAT(arrival.commanded_pose, ElementsAre(0.8, -0.2));
  EXPECT_THAT(arrival.reached_pose, near({0.5, -0.2}));
  // A relative move continues from the reached pose, not from the commanded one.
  EXPECT_THAT(stage.move_by({-0.1, -0.9}).true_pose, near({0.9, 0.0}));
  EXPECT_THAT(stage.reached_pose(), near({0.4, -0.5}));
}

TEST(StageMotion, SoftLimitsUnderDistortionKeepTheLinearMap) {
  // Target (0.5, 0.5) + [[1, 0.5], [0, 1]] (0.4, 0.4) = (1.1, 0.9), clipped to (1, 0.9): the reached
  // commanded pose solves D c = (0.5, 0.4): c = (0.3, 0.4).
  StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, {1, 0.5, 0, 1}), {0, 0}, Limits::soft);
  EXPECT_THAT(stage.step_to({0.4, 0.4}).true_pose, near({1.0, 0.9}));
  EXPECT_THAT(stage.reached_pose(), near({0.3, 0.4}));
  EXPECT_THAT(stage.move_by({-0.1, 0.0}).true_pose, near({0.9, 0.9}));
}

TEST(StageMotion, HardLimitsStopTheWholeMoveAtTheFirstLimit) {
  StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, kIdentity), {0, 0}, Limits::hard);
  // From (0.5, 0.5) by (1.0, 0.4): x meets its limit after half of the move.
  const StageMotion::Arrival arrival = stage.step_to({1.0, 0.4});
  EXPECT_THAT(arrival.true_pose, near({1.0, 0.7}));
  EXPECT_EQ(arrival.limits_high, 1u);
  EXPECT_THAT(arrival.reached_pose, near({0.5, 0.2}));
}

TEST(StageMotion, HardLimitsAllowMovesAlongAndAway) {
  StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, kIdentity), {0, 0}, Limits::hard);
  stage.step_to({0.7, 0.0});
  ASSERT_EQ(stage.true_pose()[0], 1.0);
  // Along the limit.
  StageMotion::Arrival arrival = stage.move_by({0.0, 0.3});
  EXPECT_THAT(arrival.true_pose, near({1.0, 0.8}));
  EXPECT_EQ(arrival.limits_high, 0u);
  // Into the limit: nothing moves, and the flag is set.
  arrival = stage.move_by({0.1, -0.3});
  EXPECT_THAT(arrival.true_pose, near({1.0, 0.8}));
  EXPECT_EQ(arrival.limits_high, 1u);
  EXPECT_EQ(arrival.travel_seconds, 0);
  // Away from it.
  arrival = stage.move_by({-0.4, -0.3});
  EXPECT_THAT(arrival.true_pose, near({0.6, 0.5}));
  EXPECT_EQ(arrival.limits_high | arrival.limits_low, 0u);
}

TEST(StageMotion, HardLimitsReportBothLimitsInACorner) {
  StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, kIdentity), {0, 0}, Limits::hard);
  const StageMotion::Arrival arrival = stage.step_to({-1.0, 1.0});
  EXPECT_THAT(arrival.true_pose, ElementsAre(0.0, 1.0));
  EXPECT_EQ(arrival.limits_low, 1u);
  EXPECT_EQ(arrival.limits_high, 2u);
}

TEST(StageMotion, TravelTakesAsLongAsTheSlowestAxis) {
  SceneFacts scene = scene_with(4);  // 2 mm at 5 mm/s: 0.4 s per travel; 14 deg at 10 deg/s: 1.4 s
  scene.machine_time.speed_deg_per_s = 10;
  const std::vector<double> identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  StageMotion stage(scene, perturbations({0.5, 0.5, 0.5, 0.5}, identity), {0, 0, 0, 0}, Limits::soft);
  EXPECT_DOUBLE_EQ(stage.step_to({0.3, -0.1, 0, 0.05}).travel_seconds, 0.12);
  EXPECT_DOUBLE_EQ(stage.step_to({0.3, -0.1, 0, 0.25}).travel_seconds, 0.28);
  EXPECT_EQ(stage.step_to({0.3, -0.1, 0, 0.25}).travel_seconds, 0);
  // A cut move takes the time of the completed part: x from 0.3 to 0.5.
  EXPECT_DOUBLE_EQ(stage.step_to({100, -0.1, 0, 0.25}).travel_seconds, 0.08);

  MachineTime slow;
  slow.speed_mm_per_s = 0.5;
  StageMotion slow_stage(scene, perturbations({0.5, 0.5, 0.5, 0.5}, identity), {0, 0, 0, 0}, Limits::soft, slow);
  EXPECT_DOUBLE_EQ(slow_stage.step_to({0.3, 0, 0, 0}).travel_seconds, 1.2);
}

TEST(StageMotion, AnAxisMayHaveASpeedOfItsOwn) {
  SceneFacts scene = scene_with(2);
  scene.axes[1].unit = "A";
  scene.axes[1].speed_per_s = 0.5;
  StageMotion stage(scene, perturbations({0.5, 0.5}, kIdentity), {0.5, 0.5}, Limits::soft);
  EXPECT_DOUBLE_EQ(stage.step_to({0.5, 0.75}).travel_seconds, 0.25 * 2 / 0.5);
  EXPECT_DOUBLE_EQ(stage.step_to({0.75, 0.75}).travel_seconds, 0.25 * 2 / MachineTime().speed_mm_per_s);
}

TEST(StageMotion, WouldReachDoesNotMove) {
  StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, kIdentity), {0, 0}, Limits::soft);
  stage.step_to({0.1, 0.1});
  const StageMotion::Arrival arrival = stage.would_reach({2, 2});
  EXPECT_THAT(arrival.true_pose, ElementsAre(1, 1));
  EXPECT_THAT(stage.commanded_pose(), ElementsAre(0.1, 0.1));
  EXPECT_THAT(stage.true_pose(), near({0.6, 0.6}));
}

TEST(StageMotion, ExtremePosesStayFinite) {
  for (const Limits limits : {Limits::soft, Limits::hard}) {
    StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, {1, -0.9, -0.9, 1}), {0, 0}, limits);
    stage.step_to({1.7e308, 1.7e308});
    stage.move_by({-1.7e308, 1.7e308});
    for (const double value : stage.true_pose()) {
      EXPECT_GE(value, 0);
      EXPECT_LE(value, 1);
    }
    for (const double value : stage.reached_pose()) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST(StageMotion, RejectsWrongNumberOfAxes) {
  EXPECT_THROW(StageMotion(scene_with(3), perturbations({0.5, 0.5}, kIdentity), {0, 0}, Limits::soft), Error);
  StageMotion stage(scene_with(2), perturbations({0.5, 0.5}, kIdentity), {0, 0}, Limits::soft);
  EXPECT_THROW(stage.step_to({0.1}), Error);
  EXPECT_THROW(stage.move_by({0.1, 0, 0}), Error);
}

// ---- properties over random stages and moves ----------------------------------------------------

struct RandomStage {
  explicit RandomStage(std::uint64_t seed, Limits limits) : random(seed) {
    const std::size_t axes = 1 + random.below(6);
    scene = scene_with(axes);
    std::vector<double> start(axes), distortion(axes * axes), commanded_start(axes);
    for (std::size_t i = 0; i < axes; ++i) {
      start[i] = random.uniform();
      commanded_start[i] = random.uniform() < 0.5 ? 0 : start[i];
      for (std::size_t j = 0; j < axes; ++j) distortion[i * axes + j] = (i == j) + 0.03 * random.normal();
    }
    drawn = perturbations(start, distortion);
    stage.emplace(scene, drawn, commanded_start, limits);
  }
  std::vector<double> pose(double spread) {
    std::vector<double> values(scene.axes.size());
    for (double& value : values) value = random.uniform(-spread, spread);
    return values;
  }
  Random random;
  SceneFacts scene;
  Instance drawn;
  std::optional<StageMotion> stage;
};

TEST(StageProperty, SoftPosesDoNotDependOnThePath) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    RandomStage one(seed, Limits::soft);
    StageMotion fresh = *one.stage;
    const std::vector<double> goal = one.pose(1.5);
    for (int i = 0; i < 10; ++i) {
      if (one.random.uniform() < 0.5)
        one.stage->step_to(one.pose(1.5));
      else
        one.stage->move_by(one.pose(0.5));
    }
    EXPECT_EQ(one.stage->step_to(goal).true_pose, fresh.step_to(goal).true_pose) << "seed " << seed;
    const std::vector<double> again = one.stage->true_pose();
    EXPECT_EQ(one.stage->step_to(goal).true_pose, again) << "seed " << seed;
  }
}

TEST(StageProperty, StaysInsideAndReportsLimits) {
  for (const Limits limits : {Limits::soft, Limits::hard}) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      RandomStage one(seed, limits);
      for (int i = 0; i < 20; ++i) {
        const StageMotion::Arrival arrival = one.stage->move_by(one.pose(0.6));
        ASSERT_EQ(arrival.limits_low & arrival.limits_high, 0u);
        for (std::size_t axis = 0; axis < arrival.true_pose.size(); ++axis) {
          ASSERT_GE(arrival.true_pose[axis], 0);
          ASSERT_LE(arrival.true_pose[axis], 1);
          if (arrival.limits_low >> axis & 1) {
            EXPECT_EQ(arrival.true_pose[axis], 0);
          }
          if (arrival.limits_high >> axis & 1) {
            EXPECT_EQ(arrival.true_pose[axis], 1);
          }
        }
        // The linear map relates the reached pose to the true pose.
        const std::vector<double> reached = one.stage->reached_pose();
        EXPECT_THAT(one.stage->would_reach(reached).true_pose, Pointwise(DoubleNear(1e-11), arrival.true_pose));
        if (!(arrival.limits_low | arrival.limits_high)) {
          EXPECT_EQ(reached, arrival.commanded_pose);
        }
      }
    }
  }
}

TEST(StageProperty, MovesAlongALimitFreely) {
  // Rounding may put the commanded pose slightly beyond the limit, which must not block the move.
  for (const Limits limits : {Limits::soft, Limits::hard}) {
    for (std::uint64_t seed = 0; seed < 500; ++seed) {
      Random random(seed);
      const std::vector<double> start = {random.uniform(), random.uniform()};
      const double stretch = random.uniform(0.9, 1.1);
      StageMotion stage(scene_with(2), perturbations(start, {stretch, 0, 0, 1}), {0, 0}, limits);
      stage.step_to({-2 * random.uniform(1, 2), 0});  // x meets its lower limit
      ASSERT_EQ(stage.true_pose()[0], 0.0);
      for (int i = 0; i < 5; ++i) {
        const double goal = random.uniform();
        const StageMotion::Arrival arrival = stage.move_by({0.0, goal - stage.true_pose()[1]});
        EXPECT_EQ(arrival.limits_high | arrival.limits_low, 0u) << "seed " << seed;
        EXPECT_NEAR(arrival.true_pose[1], goal, 1e-12) << "seed " << seed;
      }
    }
  }
}

TEST(StageProperty, HardMovesWithoutALimitEqualSoftMoves) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    RandomStage soft(seed, Limits::soft), hard(seed, Limits::hard);
    for (int i = 0; i < 10; ++i) {
      const std::vector<double> delta = soft.pose(0.2);
      const StageMotion::Arrival softly = soft.stage->move_by(delta);
      const StageMotion::Arrival hardly = hard.stage->move_by(delta);
      if (softly.limits_low | softly.limits_high) {
        EXPECT_NE(hardly.limits_low | hardly.limits_high, 0u) << "seed " << seed;
        break;
      }
      EXPECT_EQ(softly.true_pose, hardly.true_pose) << "seed " << seed;
    }
  }
}

TEST(StageProperty, RecommendingTheCurrentPoseReachesItExactly) {
  // Bit for bit, also where a limit cut the move: ground truth is reused for equal poses.
  for (const Limits limits : {Limits::soft, Limits::hard}) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      RandomStage one(seed, limits);
      for (int i = 0; i < 20; ++i) {
        const StageMotion::Arrival arrival = one.stage->move_by(one.pose(0.6));
        const StageMotion::Arrival stay = one.stage->would_reach(one.stage->commanded_pose());
        EXPECT_EQ(stay.true_pose, arrival.true_pose) << "seed " << seed << " move " << i;
        EXPECT_EQ(stay.travel_seconds, 0);
      }
    }
  }
}

}  // namespace
}  // namespace relign::trials
