#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "captures.h"
#include "contract/run_plugin.h"
#include "local_model.h"
#include "secant_solver.h"

namespace relign::ceres_tests {
namespace {

using ceres_plugin::Captures;
using ceres_plugin::Matrix;
using ceres_plugin::SecantSolver;
using ceres_plugin::Vector;
using plugin_host::Algorithm;
using plugin_host::Kind;
using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

// ---- the solver on published least-squares problems ----------------------------------------------

struct Problem {
  const char* name;
  Vector start, certified;
  std::function<Vector(const Vector&)> residuals;
};

Vector vector(std::initializer_list<double> values) {
  Vector v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

// NIST StRD, Misra1a: 14 observations, certified to 11 digits; both starts.
Vector misra1a(const Vector& b) {
  const Vector y =
      vector({10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78});
  const Vector x =
      vector({77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0});
  return (b[0] * (1 - (-b[1] * x.array()).exp()) - y.array()).matrix();
}

// NIST StRD, DanWood: 6 observations.
Vector dan_wood(const Vector& b) {
  const Vector y = vector({2.138, 3.421, 3.597, 4.340, 4.882, 5.660});
  const Vector x = vector({1.309, 1.471, 1.490, 1.565, 1.611, 1.680});
  return (b[0] * x.array().pow(b[1]) - y.array()).matrix();
}

// More, Garbow and Hillstrom 1981: numbers 1, 7 and 13.
Vector rosenbrock(const Vector& x) { return vector({10 * (x[1] - x[0] * x[0]), 1 - x[0]}); }
Vector helical_valley(const Vector& x) {
  const double theta = std::atan2(x[1], x[0]) / (2 * std::acos(-1.0));
  return vector({10 * (x[2] - 10 * theta), 10 * (std::hypot(x[0], x[1]) - 1), x[2]});
}
Vector powell_singular(const Vector& x) {
  return vector({x[0] + 10 * x[1], std::sqrt(5.0) * (x[2] - x[3]), std::pow(x[1] - 2 * x[2], 2),
                 std::sqrt(10.0) * std::pow(x[0] - x[3], 2)});
}

// Minimises with the solver, in units of the start's magnitude: differences of 1e-3 first, then finer ones.
Vector minimise(const Problem& problem, double box) {
  const Vector unit = problem.start.cwiseAbs().cwiseMax(1e-5);
  std::vector<Vector> evaluated;
  const double scale = 1 / std::max(1.0, problem.residuals(problem.start).norm());
  const auto evaluate = [&](const Vector& u) {
    evaluated.push_back(problem.residuals(u.cwiseProduct(unit)) * scale);
    return evaluated.size() < 5000;
  };
  const auto all = [&]() -> Matrix {
    Matrix columns(evaluated[0].size(), static_cast<Eigen::Index>(evaluated.size()));
    for (std::size_t i = 0; i < evaluated.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = evaluated[i];
    return columns;
  };
  const Vector start = problem.start.cwiseQuotient(unit);
  evaluate(start);
  SecantSolver solver({Vector::Constant(start.size(), -box), Vector::Constant(start.size(), box), evaluate, all},
                      start);
  solver.search(Vector::Constant(start.size(), 1e-3), 1e-6);
  EXPECT_LT(evaluated.size(), 3000u) << problem.name;
  return solver.best().cwiseProduct(unit);
}

TEST(SecantSolver, FindsThePublishedParametersToFourDigits) {
  const std::vector<Problem> problems = {
      {"Misra1a, start 1", vector({500, 0.0001}), vector({2.3894212918e2, 5.5015643181e-4}), misra1a},
      {"Misra1a, start 2", vector({250, 0.0005}), vector({2.3894212918e2, 5.5015643181e-4}), misra1a},
      {"DanWood, start 1", vector({1, 5}), vector({7.6886226176e-1, 3.8604055871}), dan_wood},
      {"DanWood, start 2", vector({0.7, 4}), vector({7.6886226176e-1, 3.8604055871}), dan_wood},
      {"Rosenbrock", vector({-1.2, 1}), vector({1, 1}), rosenbrock},
      {"helical valley", vector({-1, 0.1, 0.1}), vector({1, 0, 0}), helical_valley},
  };
  for (const Problem& problem : problems) {
    SCOPED_TRACE(problem.name);
    const Vector found = minimise(problem, 100);
    for (Eigen::Index i = 0; i < found.size(); ++i)
      EXPECT_NEAR(found[i], problem.certified[i],
                  1e-4 * std::max(std::fabs(problem.certified[i]), problem.certified[i] == 0 ? 1.0 : 0.0));
  }
}

TEST(SecantSolver, ConvergesWithSingularJacobianAtTheOptimum) {
  const Vector found = minimise({"Powell singular", vector({3, -1, 0.1, 1}), {}, powell_singular}, 100);
  EXPECT_LT(powell_singular(found).squaredNorm(), 1e-6);
}

TEST(SecantSolver, StopsAtABound) {
  const Vector found = minimise({"Rosenbrock in a box", vector({-1.2, 1}), {}, rosenbrock}, 0.5 / 1.2);
  EXPECT_NEAR(found[0], 0.5, 1e-4);  // x1 <= 0.5, x2 <= 0.4167: on the parabola
  EXPECT_NEAR(found[1], 0.25, 1e-3);
}

// ---- images --------------------------------------------------------------------------------------

constexpr std::uint32_t kSide = 48;

// Three blobs whose position, width and balance depend on the pose: a simplified lens.
struct Picture {
  static std::vector<float> paint(const Pose& pose, const Pose& optimum) {
    std::vector<float> pixels(kSide * kSide);
    double away[6] = {};
    for (std::size_t axis = 0; axis < pose.size() && axis < 6; ++axis) away[axis] = pose[axis] - optimum[axis];
    const double width = 4 * (1 + away[2]), turn = 0.5 * away[3], balance = 1 + away[4];
    for (int blob = 0; blob < 3; ++blob) {
      const double angle = 2.1 * blob + turn;
      const double x = kSide / 2.0 + 12 * std::cos(angle) + 20 * away[0],
                   y = kSide / 2.0 + 12 * std::sin(angle) + 20 * away[1];
      const double light = blob == 0 ? balance : 1;
      for (std::uint32_t row = 0; row < kSide; ++row)
        for (std::uint32_t column = 0; column < kSide; ++column) {
          const double r2 = std::pow(column - x, 2) + std::pow(row - y, 2);
          pixels[row * kSide + column] += static_cast<float>(light * std::exp(-0.5 * r2 / (width * width)));
        }
    }
    return pixels;
  }
};

struct CeresTrial {
  explicit CeresTrial(std::uint32_t axes, double noise, std::uint64_t seed, unsigned budget) {
    for (std::uint32_t axis = 0; axis < axes; ++axis) optimum.push_back(axis % 2 ? -0.09 : 0.08);
    wanted = Picture::paint(optimum, optimum);
    reference = {sizeof(relign_image), RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0, wanted.data(), kSide * sizeof(float)};
    service.struct_size = sizeof service;
    service.image = &reference;
    FakeSetup setup;
    setup.axes = axes;
    setup.budget = budget;
    setup.observes = RELIGN_OBSERVES_MERIT | RELIGN_OBSERVES_BOX | RELIGN_OBSERVES_IMAGES;
    setup.image_side = kSide;
    setup.merit = [this, noise, seed](const Pose& pose, std::uint32_t step) {
      shown = Picture::paint(pose, optimum);
      Random random(seed, step + 1);
      double sum = 0;
      for (std::size_t i = 0; i < shown.size(); ++i) {
        shown[i] += static_cast<float>(noise * random.normal());
        sum += std::pow(shown[i] - wanted[i], 2);
      }
      return std::sqrt(sum / static_cast<double>(shown.size()));
    };
    setup.paint = [this](double, float* pixels) { std::copy(shown.begin(), shown.end(), pixels); };
    setup.service = [this](std::string_view id) -> const void* {
      return id == RELIGN_SERVICE_REFERENCE ? &service : nullptr;
    };
    trial = std::make_unique<FakeTrial>(setup);
  }

  void run(const std::string& id, const Json& parameters = {}) { test::run_plugin("ceres", id, parameters, *trial); }

  // Largest distance of a pose from the optimum over the axes.
  double miss(const Pose& pose) const {
    double worst = 0;
    for (std::size_t axis = 0; axis < pose.size(); ++axis)
      worst = std::max(worst, std::fabs(pose[axis] - optimum[axis]));
    return worst;
  }
  double last_miss() const { return miss(trial->recommendations.back().pose); }

  Pose optimum;
  std::vector<float> wanted, shown;
  relign_image reference{};
  relign_reference_service service{};
  std::unique_ptr<FakeTrial> trial;
};

TEST(CeresImage, FindsOptimumInAnyDimension) {
  for (const std::uint32_t axes : {1u, 2u, 3u, 5u}) {
    SCOPED_TRACE(axes);
    CeresTrial trial(axes, 0, 1, 40);
    trial.run("ceres-image");
    ASSERT_FALSE(trial.trial->recommendations.empty());
    EXPECT_LT(trial.last_miss(), 0.015);
  }
}

TEST(CeresImage, ProbesAverageOutNoise) {
  double recommended = 0, measured_best = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CeresTrial trial(5, 0.2, seed, 40);
    trial.run("ceres-image");
    recommended += trial.last_miss() / 10;
    measured_best += trial.miss(trial.trial->best_pose()) / 10;
  }
  EXPECT_LT(recommended, 0.06);
  EXPECT_LT(recommended, 0.7 * measured_best);
}

TEST(CeresImage, RecommendsAtEveryStepAfterFirstModel) {
  CeresTrial trial(5, 0.05, 1, 40);
  trial.run("ceres-image");
  for (std::size_t made = 14; made < 40; ++made)
    EXPECT_TRUE(std::any_of(trial.trial->recommendations.begin(), trial.trial->recommendations.end(),
                            [&](const auto& one) { return one.steps_made == made; }))
        << made;
}

TEST(CeresImage, FinishesBeforeTheBudgetIsSpent) {
  CeresTrial trial(2, 0.01, 1, 100000);
  trial.run("ceres-image");
  EXPECT_FALSE(trial.trial->stopped);
  EXPECT_LT(trial.trial->steps.size(), 60u);
}

TEST(CeresScalar, MinimisesQuadratic) {
  for (const std::uint32_t axes : {1u, 2u, 5u}) {
    SCOPED_TRACE(axes);
    FakeSetup setup;
    setup.axes = axes;
    setup.budget = 200;
    const Pose optimum(axes, 0.17);
    setup.merit = [&](const Pose& pose, std::uint32_t) { return test::bowl(pose, optimum); };
    setup.observes = RELIGN_OBSERVES_MERIT | RELIGN_OBSERVES_BOX | RELIGN_OBSERVES_IMAGES;
    CeresTrial trial(axes, 0, 1, 200);
    trial.trial = std::make_unique<FakeTrial>(setup);
    trial.run("ceres-scalar");
    EXPECT_LT(setup.merit(trial.trial->best_pose(), 0), 0.01 + 5e-3);
  }
}

TEST(Ceres, RejectsLastBlurAboveFirstBlur) {
  CeresTrial trial(2, 0, 1, 10);
  try {
    trial.run("ceres", {{"first_blur", 0.01}, {"last_blur", 0.02}});
    FAIL() << "no exception";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("parameter 'last_blur': found '0.020000', must be at most"));
  }
}

// ---- parts ---------------------------------------------------------------------------------------

TEST(Captures, CoordinatesHaveGivenInnerProducts) {
  Matrix any(3, 5);
  Random random(4);
  for (double& entry : any.reshaped()) entry = random.normal();
  const Matrix products = any.transpose() * any;  // 5 captures that span 3 dimensions
  const Matrix columns = ceres_plugin::coordinates(products);
  EXPECT_LT((columns.transpose() * columns - products).norm(), 1e-9 * products.norm());
}

TEST(Captures, EstimatesNoiseFromTwoCapturesAtOnePose) {
  const Pose pose(5, 0.0);
  std::vector<float> clean = Picture::paint(pose, pose), noisy = clean;
  const auto view = [](const std::vector<float>& pixels) {
    return relign_image{sizeof(relign_image), RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0,
                        pixels.data(),        kSide * sizeof(float)};
  };
  Captures captures{ImageView(view(clean))};
  captures.set_blur(0);
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    Random random(seed);
    for (std::size_t i = 0; i < noisy.size(); ++i)
      noisy[i] = 0.5F * clean[i] + 0.1F * static_cast<float>(random.normal());
    captures.add(ImageView(view(noisy)));
  }
  double power = 0;
  for (const float pixel : clean) power += pixel * pixel / static_cast<double>(clean.size());
  EXPECT_NEAR(captures.noise(0, 1), 0.01 / power, 0.001 / power);
  EXPECT_NEAR(captures.products()(0, 1), 0.25, 0.02);
  captures.set_blur(0.04);
  EXPECT_LT(captures.noise(0, 1), 0.1 * 0.01 / power);
}

}  // namespace
}  // namespace relign::ceres_tests
