// Design study, beliefs, memory and registration on an analytic toy lens.
#include "registration.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "memory.hpp"
#include "toy_lens.h"

namespace {

using namespace sensitivity;

Picture toy_picture(const Vector& pose, double noise = 0, std::uint64_t seed = 0) {
  std::vector<float> pixels = toy::paint({pose.begin(), pose.end()});
  toy::add_noise(noise, seed, pixels);
  return Eigen::Map<const Picture>(pixels.data(), static_cast<Eigen::Index>(pixels.size()));
}

constexpr double kNoise = 0.05;

Design toy_design(Eigen::Index axes, bool stray_light = false) {
  const Simulator simulator{[](const Vector& pose) { return toy_picture(pose); },
                            [](const Vector& pose, std::uint64_t seed) { return toy_picture(pose, kNoise, seed); }};
  const Vector nominal = Vector::Constant(axes, 0.5);
  return study(simulator, nominal, toy_picture(nominal), toy::kSide, toy::kSide, 0.1, stray_light);
}

Registration toy_registration(const Design& design) {
  std::uint64_t seed = 1000;
  return {design,
          [seed](Vector& away, int captures) mutable {
            Picture sum = Picture::Zero(toy::kSide * toy::kSide);
            for (int k = 0; k < captures; ++k)
              sum += toy_picture(Vector::Constant(away.size(), 0.5) + away, kNoise, ++seed);
            return Rendering{sum / static_cast<float>(captures), kNoise * kNoise};
          },
          16};
}

TEST(Pictures, ShiftMovesPixelsAndDropsThoseBeyondTheEdge) {
  Picture picture = Picture::Zero(5 * 4);
  picture[2 * 5 + 3] = 1;  // column 3, row 2
  EXPECT_EQ(shifted(picture, 5, 4, 2, 1)[1 * 5 + 1], 1);
  EXPECT_EQ(shifted(picture, 5, 4, 2, 1).sum(), 1);
  const Picture half = shifted(picture, 5, 4, -0.5, 0);
  EXPECT_FLOAT_EQ(half[2 * 5 + 3], 0.5F);
  EXPECT_FLOAT_EQ(half[2 * 5 + 4], 0.5F);
  EXPECT_EQ(shifted(picture, 5, 4, 4, 0).sum(), 0);  // beyond the edge
  EXPECT_EQ(shifted(picture, 5, 4, 1e30, 0).sum(), 0);
}

TEST(Beliefs, InflationAddsCovariances) {
  const Matrix covariance{{2, 0.5}, {0.5, 1}}, more{{0.5, 0.1}, {0.1, 3}};
  const Vector mean = Eigen::Vector2d(1, -2);
  const Matrix information = covariance.inverse();
  const Belief inflated = Belief{information, information * mean}.inflated(more);
  EXPECT_LT((inflated.covariance() - covariance - more).norm(), 1e-12);
  EXPECT_LT((inflated.mean() - mean).norm(), 1e-12);
}

TEST(Beliefs, InflatesSingularInformation) {
  Belief half = Belief::nothing(2);
  half.information(0, 0) = 4;
  half.weighed[0] = 8;
  const Belief both = Belief::around(Vector::Zero(2), 1).with(half.inflated(Matrix::Identity(2, 2)));
  EXPECT_NEAR(both.mean()[0], 2 * 0.8 / 1.8, 1e-12);  // 1 / (1 / 4 + 1) = 0.8
  EXPECT_EQ(both.mean()[1], 0);
}

TEST(Beliefs, ConvertsDisplacementToBestPose) {
  const Belief seen = Belief::around(Eigen::Vector2d(0.1, -0.2), 1).best_pose_from(Eigen::Vector2d(0.5, 0.5));
  EXPECT_LT((seen.mean() - Eigen::Vector2d(0.4, 0.7)).norm(), 1e-12);
}

Memory::Errors small_errors() {
  Memory::Errors errors;
  errors.foreign = Matrix::Zero(2, 2);
  return errors;
}

TEST(Memory, FollowsSingleEstimateInFull) {
  Memory memory(Vector::Zero(2), small_errors());
  memory.add(Vector::Zero(2), Belief::around(Eigen::Vector2d(0.2, -0.1), 1e-3));
  EXPECT_LT((memory.best().mean() - Eigen::Vector2d(-0.2, 0.1)).norm(), 0.01);
}

TEST(Memory, PrefersEstimatesMadeNearTheBestPose) {
  // Every estimate is four fifths of the displacement: the lens is less sensitive than its design.
  const Vector best = Eigen::Vector2d(0.4, 0.1);
  Memory memory(Vector::Zero(2), small_errors());
  for (int step = 0; step < 6; ++step) {
    const Vector here = memory.best().mean();
    memory.add(here, Belief::around(0.8 * (here - best), 1e-3));
  }
  EXPECT_LT((memory.best().mean() - best).norm(), 0.002);
}

TEST(Memory, AveragesEstimatesMadeNearTheBestPose) {
  relign::Random random(5);
  double first = 0, last = 0;
  for (int trial = 0; trial < 50; ++trial) {
    Memory memory(Vector::Zero(2), small_errors());
    for (int step = 0; step < 16; ++step) {
      const Vector here = memory.best().mean();
      Vector seen = here;
      for (double& coordinate : seen) coordinate += 0.01 * random.normal();
      memory.add(here, Belief::around(seen, 0.01));
      if (step == 0) first += memory.best().mean().squaredNorm();
    }
    last += memory.best().mean().squaredNorm();
  }
  EXPECT_LT(std::sqrt(last), 0.4 * std::sqrt(first));  // 0.25 without the error terms
}

TEST(Memory, ResetDiscardsEarlierEstimates) {
  Memory memory(Vector::Zero(2), small_errors());
  memory.add(Vector::Zero(2), Belief::around(Vector::Ones(2), 1e-3));
  memory.reset(Vector::Ones(2));
  EXPECT_LT((memory.best().mean() - Vector::Ones(2)).norm(), 1e-12);
}

TEST(DesignStudy, MeasuresImageMotionAndNoise) {
  const Design design = toy_design(5);
  Matrix motion = Matrix::Zero(2, 5);
  motion(0, 0) = motion(1, 1) = toy::kReach;
  EXPECT_LT((design.motion.leftCols(2) - motion.leftCols(2)).cwiseAbs().maxCoeff(), 0.05 * toy::kReach);
  EXPECT_LT(design.motion.col(2).norm(), 0.1 * toy::kReach);
  EXPECT_NEAR(design.noise, kNoise * kNoise, 0.05 * kNoise * kNoise);
  EXPECT_LT(design.changed(0.1 * Vector::Unit(5, 0)), 0.2 * design.changed(0.1 * Vector::Unit(5, 2)));
}

TEST(DesignStudy, JacobianMatchesFiniteDifferences) {
  const Design design = toy_design(5);
  for (Eigen::Index axis = 0; axis < 5; ++axis) {
    const Vector nominal = Vector::Constant(5, 0.5), way = 1e-3 * Vector::Unit(5, axis);
    const Picture slope = (toy_picture(nominal + way) - toy_picture(nominal - way)) / 2e-3F;
    EXPECT_LT((design.jacobian.col(axis) - slope).norm(), 0.02F * slope.norm()) << axis;
  }
}

TEST(DesignStudy, AxisWithoutEffectHasNoInformation) {
  const Design design = toy_design(6);
  for (const Level& level : design.levels) {
    EXPECT_LT(std::fabs(level.information(5, 5)), 1e-3 * level.information(2, 2));
    EXPECT_TRUE(level.information.allFinite() && level.weigh.allFinite());
  }
}

TEST(DesignStudy, SubtractsNoiseOfJacobian) {
  const Design design = toy_design(2);
  const double entries = static_cast<double>(design.jacobian.size());
  const double deviation = 0.3 * static_cast<double>(design.jacobian.norm()) / std::sqrt(entries);
  const int draws = 40;
  for (const double blur : {0.0, 1.25}) {
    const auto squares = [&](const Eigen::MatrixXf& jacobian, double noise) {
      return make_level(jacobian, toy::kSide, toy::kSide, blur, Vector::Constant(2, noise), {}).squares;
    };
    Matrix corrected = Matrix::Zero(2, 2), plain = Matrix::Zero(2, 2);
    relign::Random random(3);
    for (int draw = 0; draw < draws; ++draw) {
      Eigen::MatrixXf noisy = design.jacobian;
      for (float& entry : noisy.reshaped()) entry += static_cast<float>(deviation * random.normal());
      corrected += squares(noisy, deviation * deviation) / draws;
      plain += squares(noisy, 0) / draws;
    }
    const Matrix clean = squares(design.jacobian, 0);
    EXPECT_LT((corrected - clean).norm(), 0.3 * (plain - clean).norm()) << blur;
  }
}

TEST(DesignStudy, ExpectedExcessMatchesImages) {
  const Design design = toy_design(6);  // the last axis has no effect, and no doubt about it counts
  const Vector nominal = Vector::Constant(6, 0.5), pose = nominal + 0.002 * Vector::Unit(6, 0);
  const Matrix covariance = Vector{{4e-6, 4e-6, 1e-4, 1e-4, 1e-3, 0.09}}.asDiagonal();
  relign::Random random(11);
  constexpr int kDraws = 400;
  double squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Vector seen = pose;
    for (Eigen::Index axis = 0; axis < 6; ++axis) seen[axis] += std::sqrt(covariance(axis, axis)) * random.normal();
    squares += static_cast<double>((toy_picture(seen) - toy_picture(nominal)).squaredNorm()) / kDraws;
  }
  const Belief best{covariance.inverse(), covariance.inverse() * nominal};
  const double pixels = toy::kSide * toy::kSide;
  EXPECT_NEAR(expected_excess(design, best, pose) / std::sqrt(squares / pixels), 1, 0.1);
}

TEST(Registration, FindsDistantPose) {
  const Design design = toy_design(5);
  const Registration registration = toy_registration(design);
  relign::Random random(7);
  for (std::uint64_t trial = 0; trial < 10; ++trial) {
    const Vector away = Vector::NullaryExpr(5, [&] { return random.uniform(-0.35, 0.35); });
    const Picture capture = toy_picture(Vector::Constant(5, 0.5) + away, kNoise, trial);
    const Estimate estimate = registration(capture, Belief::around(Vector::Zero(5), 0.3), 12);
    const Vector found = Belief::around(Vector::Zero(5), 0.3).with(estimate.away).mean();
    EXPECT_LT((found - away).lpNorm<Eigen::Infinity>(), 0.08) << trial;
    EXPECT_LT(estimate.misfit, 1.1) << trial;
  }
}

TEST(Registration, ComparesWithTheReferenceNearTheNominalPoseOnly) {
  const Design design = toy_design(5);
  Registration registration = toy_registration(design);
  registration.use_reference = true;
  int rendered = 0;
  registration.render = [&, render = registration.render](Vector& away, int captures) {
    ++rendered;
    return render(away, captures);
  };
  for (const double distance : {0.005, 0.2}) {
    rendered = 0;
    const Vector away = distance * Vector::Ones(5);
    const Picture capture = toy_picture(Vector::Constant(5, 0.5) + away, kNoise, 1);
    const Belief before = Belief::around(distance < 0.1 ? away : Vector::Zero(5), distance < 0.1 ? 0.002 : 0.3);
    const Estimate estimate = registration(capture, before, 12);
    EXPECT_EQ(rendered > 0, distance > 0.1) << distance;
    EXPECT_LT((before.with(estimate.away).mean() - away).lpNorm<Eigen::Infinity>(), distance < 0.1 ? 0.005 : 0.08);
  }
}

TEST(Registration, CovarianceMatchesErrors) {
  const Design design = toy_design(5);
  const Registration registration = toy_registration(design);
  double squares = 0;
  for (std::uint64_t trial = 0; trial < 40; ++trial) {
    const Vector away = 0.02 * Vector::Ones(5);
    const Picture capture = toy_picture(Vector::Constant(5, 0.5) + away, kNoise, trial);
    const Estimate estimate = registration(capture, Belief::around(Vector::Zero(5), 0.05), 5);
    const Vector error = estimate.away.mean() - away;
    squares += error.dot(estimate.away.information * error) / 5 / 40;
  }
  EXPECT_GT(squares, 0.6);  // 1 for an exact covariance
  EXPECT_LT(squares, 1.6);
}

TEST(Registration, IgnoresGainOffsetAndSmoothStrayLight) {
  const Design design = toy_design(5, true);
  const Eigen::MatrixXf fields = least_squares::smooth_fields(toy::kSide, toy::kSide, 3);
  const Vector away = 0.02 * Vector::Ones(5);
  const Belief before = Belief::around(Vector::Zero(5), 0.05);
  const float level = design.reference.norm() / std::sqrt(static_cast<float>(design.reference.size()));
  for (const bool render : {true, false}) {
    const Picture capture = toy_picture(Vector::Constant(5, 0.5) + away, kNoise, 1);
    const Picture disturbed =
        0.9F * capture + 0.05F * level * (Picture::Ones(capture.size()) + fields.col(1) - fields.col(4));
    const auto estimate = [&](const Picture& picture) {
      const Registration rendering = toy_registration(design), linear{design, {}, 16};
      return (render ? rendering : linear)(picture, before, 5).away;
    };
    const Belief plain = estimate(capture);
    const Vector change = estimate(disturbed).mean() - plain.mean();
    EXPECT_LT(change.dot(plain.information * change) / 5, 0.5) << "below a standard deviation";
  }
}

TEST(Registration, SingleJacobianCorrectsShift) {
  const Design design = toy_design(5);
  const Registration registration{design, {}, 16};
  const Vector away = 0.1 * (Vector::Unit(5, 0) + Vector::Unit(5, 1));
  const Picture capture = toy_picture(Vector::Constant(5, 0.5) + away, kNoise, 1);
  const Belief before = Belief::around(Vector::Zero(5), 0.3);
  const Vector off = before.with(registration(capture, before, 12).away).mean() - away;
  EXPECT_LT(off.head(2).norm(), 0.3 * away.norm());
  EXPECT_GT(off.norm(), 0.01);  // the other axes need a comparison at the pose itself
}

TEST(Registration, DarkCaptureKeepsPoseFinite) {
  const Design design = toy_design(5);
  const Belief before = Belief::around(Vector::Zero(5), 0.3);
  const Estimate estimate = toy_registration(design)(Picture::Zero(toy::kSide * toy::kSide), before, 12);
  EXPECT_LT(before.with(estimate.away).mean().norm(), 1.5);  // false for NaN
}

}  // namespace
