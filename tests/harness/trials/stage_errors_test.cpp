// Errors of the simulated stage: each against its law, and properties of any sequence of moves with all of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <relign/random.hpp>

#include "base/error.h"
#include "trials/stage_motion.h"

namespace relign::trials::stage_errors_tests {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

SceneFacts axes_of(std::size_t count) {
  SceneFacts scene;
  for (std::size_t i = 0; i < count; ++i) scene.axes.push_back({"a" + std::to_string(i), "mm", -1, 1});
  scene.nominal_pose.assign(count, 0.5);
  return scene;
}

StageErrors no_errors(std::size_t count) {
  const std::vector<double> zeros(count, 0.0);
  return {zeros, zeros, zeros, zeros, 1};
}

// One axis that starts at 0.5, without distortion; coordinates from the start.
struct OneAxis {
  StageErrors errors = no_errors(1);
  std::uint64_t seed = 4;
  StageMotion stage(Limits limits = Limits::soft) const {
    return {axes_of(1), Instance{0, seed, {{0.5}, {1}, "{}", {}, errors}}, {0}, limits};
  }
};

// A stage with every error, at random.
struct AnyStage {
  explicit AnyStage(std::uint64_t seed) : random(seed) {
    const std::size_t axes = 1 + random.below(6);
    scene = axes_of(axes);
    instance.seed = seed;
    Perturbations& drawn = instance.perturbations;
    drawn.start = pose(0.5);
    for (double& value : drawn.start) value += 0.5;
    for (std::size_t i = 0; i < axes * axes; ++i)
      drawn.distortion.push_back((i % (axes + 1) == 0 ? 1 : 0) + 0.03 * random.normal());
    drawn.stage = no_errors(axes);
    for (std::size_t i = 0; i < axes; ++i) {
      drawn.stage->backlash[i] = random.uniform(0, 0.05);
      drawn.stage->repeatability[i] = random.uniform(0, 0.01);
      drawn.stage->encoder_step[i] = random.below(2) ? 0.002 : 0;
      drawn.stage->drift[i] = random.uniform(-0.02, 0.02);
    }
    drawn.stage->drift_seconds = random.uniform(1, 20);
  }
  std::vector<double> pose(double spread) {
    std::vector<double> values(scene.axes.size());
    for (double& value : values) value = random.uniform(-spread, spread);
    return values;
  }
  StageMotion stage(Limits limits) const {
    return {scene, instance, std::vector<double>(scene.axes.size(), 0.0), limits};
  }
  Random random;
  SceneFacts scene;
  Instance instance;
};

TEST(StageErrors, OfSizeZeroLeaveThePaperStageBitForBit) {
  for (const Limits limits : {Limits::soft, Limits::hard})
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      AnyStage any(seed);
      any.instance.perturbations.stage = no_errors(any.scene.axes.size());
      StageMotion with = any.stage(limits);
      any.instance.perturbations.stage.reset();
      StageMotion without = any.stage(limits);
      for (int i = 0; i < 20; ++i) {
        const std::vector<double> pose = i % 5 == 4 ? with.commanded_pose() : any.pose(i % 2 ? 1.5 : 0.5);
        const StageMotion::Arrival a = with.step_to(pose), b = without.step_to(pose);
        ASSERT_EQ(a.true_pose, b.true_pose) << "seed " << seed << " move " << i;
        ASSERT_EQ(a.reached_pose, b.reached_pose) << "seed " << seed << " move " << i;
        ASSERT_EQ(a.travel_seconds, b.travel_seconds);
        ASSERT_EQ(a.limits_low, b.limits_low);
        ASSERT_EQ(a.limits_high, b.limits_high);
      }
    }
}

TEST(StageErrors, BacklashMakesALoopOfItsWidth) {
  OneAxis one;
  one.errors.backlash = {0.02};
  StageMotion stage = one.stage();
  // From the middle of the play the first move loses half of it.
  EXPECT_NEAR(stage.step_to({0.005}).true_pose[0], 0.5, 1e-15);
  EXPECT_NEAR(stage.step_to({0.2}).true_pose[0], 0.69, 1e-15);
  for (int loop = 0; loop < 2; ++loop) {
    std::vector<double> down, up;
    for (int i = 19; i > -20; --i) down.push_back(stage.step_to({i * 0.01}).true_pose[0]);
    stage.step_to({-0.2});
    for (int i = -19; i < 20; ++i) up.push_back(stage.step_to({i * 0.01}).true_pose[0]);
    stage.step_to({0.2});
    for (int i = -17; i <= 17; ++i)  // more than the play away from both ends
      EXPECT_NEAR(down[static_cast<std::size_t>(19 - i)] - up[static_cast<std::size_t>(19 + i)], 0.02, 1e-15) << i;
  }
}

TEST(StageErrors, MovesWithinThePlayMoveNothing) {
  OneAxis one;
  one.errors.backlash = {0.02};
  one.errors.repeatability = {0.001};
  StageMotion stage = one.stage();
  const double arrived = stage.step_to({0.1}).true_pose[0];  // the carriage is 0.01 behind
  EXPECT_NE(arrived, 0.59);
  for (const double within : {0.095, 0.081, 0.09, 0.0999})
    EXPECT_EQ(stage.step_to({within}).true_pose[0], arrived) << within;
  EXPECT_NE(stage.step_to({0.079}).true_pose[0], arrived);
}

TEST(StageErrors, BacklashDependsOnTheLastExtremesOnly) {
  // Excursions inside the range swept before are forgotten once the drive returns to its end (return-point memory).
  OneAxis one;
  one.errors.backlash = {0.03};
  StageMotion direct = one.stage(), wandering = one.stage();
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const double end = i % 2 ? 0.2 : -0.2;
    for (int k = 0; k < 5; ++k) wandering.step_to({random.uniform(-0.2, 0.2)});
    EXPECT_EQ(wandering.step_to({end}).true_pose, direct.step_to({end}).true_pose);
  }
}

TEST(StageErrors, RepeatabilityHasItsStandardDeviation) {
  constexpr int kMoves = 20000;
  Instance instance{0, 9, {{0.5, 0.5}, {1, 0, 0, 1}, "{}", {}, no_errors(2)}};
  instance.perturbations.stage->repeatability = {0.002, 0.0005};
  StageMotion stage(axes_of(2), instance, {0, 0}, Limits::soft);
  double sum = 0, squares[2] = {0, 0}, product = 0, lagged = 0, last = 0, large = 0;
  for (int i = 1; i <= kMoves; ++i) {
    const double to = i % 2 ? 0.125 : -0.125;
    const std::vector<double> pose = stage.step_to({to, to}).true_pose;
    const double a = (pose[0] - 0.5 - to) / 0.002, b = (pose[1] - 0.5 - to) / 0.0005;
    sum += a, squares[0] += a * a, squares[1] += b * b, product += a * b, lagged += a * last;
    large += std::fabs(a) > 1.959964;
    last = a;
  }
  // Chi-square with n degrees of freedom has the variance 2 n; five standard deviations.
  for (const double chi_square : squares) EXPECT_NEAR(chi_square, kMoves, 5 * std::sqrt(2.0 * kMoves));
  EXPECT_NEAR(sum, 0, 5 * std::sqrt(kMoves));
  EXPECT_NEAR(product, 0, 5 * std::sqrt(kMoves)) << "axes are independent";
  EXPECT_NEAR(lagged, 0, 5 * std::sqrt(kMoves)) << "moves are independent";
  EXPECT_NEAR(large, 0.05 * kMoves, 5 * std::sqrt(0.0475 * kMoves)) << "normal";
}

TEST(StageErrors, AxesAtRestKeepTheirError) {
  Instance instance{0, 9, {{0.5, 0.5}, {1, 0, 0, 1}, "{}", {}, no_errors(2)}};
  instance.perturbations.stage->repeatability = {0.01, 0.01};
  StageMotion stage(axes_of(2), instance, {0, 0}, Limits::soft);
  EXPECT_EQ(stage.step_to({0.1, 0}).true_pose[1], 0.5) << "the start is exact";
  const std::vector<double> before = stage.step_to({0.1, 0.1}).true_pose;
  const std::vector<double> after = stage.step_to({0.1, 0.2}).true_pose;
  EXPECT_EQ(after[0], before[0]);
  EXPECT_NE(after[1] - before[1], 0.1);
  // The same move with another number, or of another instance, has another error.
  StageMotion later(axes_of(2), instance, {0, 0}, Limits::soft);
  later.step_to({0, 0.1});
  EXPECT_NE(later.step_to({0.1, 0.1}).true_pose[0], before[0]);
  instance.seed = 10;
  StageMotion other(axes_of(2), instance, {0, 0}, Limits::soft);
  other.step_to({0.1, 0});
  EXPECT_NE(other.true_pose()[0], before[0]);
}

TEST(StageErrors, EncoderRoundsMovesFromTheStart) {
  OneAxis one;
  one.errors.encoder_step = {0.01};
  StageMotion stage = one.stage();
  EXPECT_NEAR(stage.step_to({0.1234}).true_pose[0], 0.62, 1e-15);
  EXPECT_THAT(stage.reached_pose(), ElementsAre(0.1234)) << "the controller keeps its target";
  EXPECT_NEAR(stage.step_to({0.1251}).true_pose[0], 0.63, 1e-15);
  EXPECT_NEAR(stage.step_to({-0.1251}).true_pose[0], 0.37, 1e-15);
  EXPECT_EQ(stage.step_to({0.0049}).true_pose[0], 0.5);
  // Moves far below the step add up.
  StageMotion creeping = one.stage();
  for (int i = 0; i < 12; ++i) creeping.move_by({0.001});
  EXPECT_NEAR(creeping.true_pose()[0], 0.51, 1e-15);
  // A step far below the resolution of a number rounds nothing, and nothing overflows.
  one.errors.encoder_step = {1e-320};
  EXPECT_EQ(one.stage().step_to({0.123}).true_pose[0], 0.623);
}

TEST(StageErrors, DriftApproachesItsEndExponentially) {
  OneAxis one;
  one.errors.drift = {-0.04};
  one.errors.drift_seconds = 600;
  const MachineTime times;
  const double settle = times.settle_ms / 1000;
  StageMotion stage = one.stage();
  EXPECT_EQ(stage.true_pose()[0], 0.5);
  stage.wait(600 - settle);
  EXPECT_NEAR(stage.step_to({0}).true_pose[0], 0.5 - 0.04 * (1 - std::exp(-1)), 1e-15);
  stage.wait(600 - settle);
  EXPECT_NEAR(stage.move_by({0}).true_pose[0], 0.5 - 0.04 * (1 - std::exp(-2)), 1e-15);
  // The travel counts: 0.1 of 2 mm at 5 mm/s.
  EXPECT_NEAR(stage.move_by({0.1}).true_pose[0], 0.6 - 0.04 * (1 - std::exp(-2 - (settle + 0.04) / 600)), 1e-15);
  stage.wait(1e6);
  EXPECT_NEAR(stage.move_by({0}).true_pose[0], 0.56, 1e-15);
}

TEST(StageErrors, AddDistortionToTheCarriageOnly) {
  // (0.5, 0.5) + [[1, 0.1], [0, 1]] (p + noise-free rest): the carriage of y is half a play behind, x gets 0.1 of it.
  Instance instance{0, 9, {{0.5, 0.5}, {1, 0.1, 0, 1}, "{}", {}, no_errors(2)}};
  instance.perturbations.stage->backlash = {0, 0.02};
  StageMotion stage(axes_of(2), instance, {0, 0}, Limits::soft);
  EXPECT_THAT(stage.step_to({0.1, 0.2}).true_pose, Pointwise(DoubleNear(1e-15), {0.6 + 0.1 * 0.19, 0.69}));
}

TEST(StageErrors, RelativeMovesAwayFromALimitCrossThePlay) {
  for (const Limits limits : {Limits::soft, Limits::hard}) {
    OneAxis one;
    one.errors.backlash = {0.02};
    StageMotion stage = one.stage(limits);
    const StageMotion::Arrival arrival = stage.step_to({0.8});
    EXPECT_EQ(arrival.true_pose[0], 1);
    EXPECT_EQ(arrival.limits_high, 1u);
    EXPECT_NEAR(arrival.reached_pose[0], 0.51, 1e-2) << "the drive is ahead of the carriage";
    EXPECT_EQ(stage.step_to({0.8}).true_pose[0], 1) << "the same command moves nothing";
    const double reached = stage.reached_pose()[0], ahead = reached - 0.5;
    EXPECT_GE(ahead, 0);
    EXPECT_LE(ahead, 0.01 + 1e-15);
    EXPECT_EQ(stage.move_by({-0.005}).true_pose[0], 1) << "within the play";
    EXPECT_NEAR(stage.step_to({reached - 0.1}).true_pose[0], 1 - 0.1 + ahead + 0.01, 1e-12);
  }
}

TEST(StageErrors, NoiseNeitherBlocksAStageAtALimitNorSetsItsFlag) {
  for (const Limits limits : {Limits::soft, Limits::hard}) {
    Instance instance{0, 3, {{0.5, 0.5}, {1, 0, 0, 1}, "{}", {}, no_errors(2)}};
    instance.perturbations.stage->repeatability = {0.01, 0.01};
    instance.perturbations.stage->drift = {0.1, 0};
    StageMotion stage(axes_of(2), instance, {0, 0}, limits);
    stage.step_to({0.5, 0});
    for (int i = 0; i < 20; ++i) {
      stage.wait(1);
      const double to = i % 2 ? 0.25 : -0.25;
      const StageMotion::Arrival arrival = stage.step_to({0.5, to});
      EXPECT_EQ(arrival.limits_low | arrival.limits_high, 0u);
      EXPECT_NEAR(arrival.true_pose[1], 0.5 + to, 0.06);
      EXPECT_LE(arrival.true_pose[0], 1) << "scenes accept only poses within the travel";
    }
  }
}

TEST(StageErrorsProperty, WouldReachIsTheNextMove) {
  for (const Limits limits : {Limits::soft, Limits::hard})
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      AnyStage any(seed);
      StageMotion stage = any.stage(limits);
      for (int i = 0; i < 20; ++i) {
        stage.wait(0.5);
        const std::vector<double> goal = any.pose(i % 3 ? 0.3 : 1.2), elsewhere = any.pose(0.5);
        stage.would_reach(elsewhere);
        const StageMotion::Arrival virtually = stage.would_reach(goal);
        const std::vector<double> before = stage.true_pose();
        EXPECT_EQ(stage.would_reach(stage.commanded_pose()).true_pose, before) << "no move";
        const StageMotion::Arrival really = stage.step_to(goal);
        ASSERT_EQ(virtually.true_pose, really.true_pose) << "seed " << seed << " move " << i;
        ASSERT_EQ(virtually.reached_pose, really.reached_pose);
        ASSERT_EQ(virtually.travel_seconds, really.travel_seconds);
      }
    }
}

TEST(StageErrorsProperty, ReplaysBitForBitAndStaysInside) {
  for (const Limits limits : {Limits::soft, Limits::hard})
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      AnyStage any(seed);
      const StageErrors& errors = *any.instance.perturbations.stage;
      StageMotion stage = any.stage(limits), again = any.stage(limits);
      for (int i = 0; i < 20; ++i) {
        const std::vector<double> delta = any.pose(0.6);
        const StageMotion::Arrival arrival = stage.move_by(delta);
        ASSERT_EQ(arrival.true_pose, again.move_by(delta).true_pose);
        for (std::size_t axis = 0; axis < delta.size(); ++axis) {
          ASSERT_GE(arrival.true_pose[axis], 0);
          ASSERT_LE(arrival.true_pose[axis], 1);
          // The drive is within the play, and never more than half an encoder step off.
          EXPECT_LE(std::fabs(arrival.reached_pose[axis] - arrival.carriage[axis]),
                    (errors.backlash[axis] + errors.encoder_step[axis]) / 2 + 1e-12);
        }
      }
    }
}

TEST(StageErrorsProperty, DoNotDependOnTheCoordinates) {
  // Protocols differ in the coordinates of the start; the stage is the same.
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    AnyStage any(seed);
    const std::vector<double> start = any.instance.perturbations.start;
    any.instance.perturbations.stage->encoder_step.assign(start.size(), 0.0);  // amplifies rounding errors
    StageMotion blind = any.stage(Limits::soft), paper(any.scene, any.instance, start, Limits::soft);
    for (int i = 0; i < 10; ++i) {
      const std::vector<double> delta = any.pose(0.1);
      EXPECT_THAT(blind.move_by(delta).true_pose, Pointwise(DoubleNear(1e-12), paper.move_by(delta).true_pose));
    }
  }
}

TEST(StageErrors, RejectsWrongNumberOfAxes) {
  Instance instance{0, 3, {{0.5, 0.5}, {1, 0, 0, 1}, "{}", {}, no_errors(2)}};
  instance.perturbations.stage->drift = {0.1};
  EXPECT_THROW(StageMotion(axes_of(2), instance, {0, 0}, Limits::soft), Error);
}

}  // namespace
}  // namespace relign::trials::stage_errors_tests
