#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "cma.h"
#include "contract/fake_trial.h"
#include "plugin_host/objects.h"

namespace relign::cma_es_tests {
namespace {

using cma_es::Constants;
using cma_es::Evolution;
using cma_es::Matrix;
using cma_es::Vector;
using plugin_host::Algorithm;
using plugin_host::Kind;
using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

// Values of pycma 4.5.0 without negative weights, where it uses the tutorial's formulas.
TEST(CmaEs, ConstantsMatchTutorial) {
  const Constants k(10, Constants::usual_population(10));
  EXPECT_EQ(k.lambda, 10);
  EXPECT_EQ(k.mu, 5);
  const double weights[] = {0.45627264690340597, 0.2707530970017852, 0.16223111715866978, 0.08523354710016448,
                            0.025509591835974777};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(k.weights[i], weights[i], 1e-14);
  EXPECT_NEAR(k.mu_eff, 3.1672992814107017, 1e-13);
  EXPECT_NEAR(k.c_1, 0.015283824524751714, 1e-16);
  EXPECT_NEAR(k.c_c, 0.29499038303562225, 1e-15);
  EXPECT_NEAR(k.c_s, 5.1672992814107017 / 18.1672992814107017, 1e-15);
  EXPECT_NEAR(k.damping, 1 + k.c_s, 1e-15);
  EXPECT_NEAR(Constants(5, 8).mu_eff, 2.60017882611318, 1e-13);
}

double sphere(const Vector& x) { return x.squaredNorm(); }

double ellipsoid(const Vector& x) {
  double sum = 0;
  for (int i = 0; i < x.size(); ++i) sum += std::pow(10.0, 6.0 * i / (double(x.size()) - 1)) * x[i] * x[i];
  return sum;
}

// The ellipsoid with rotated axes.
double turned(const Vector& x) {
  Random random(3);
  Matrix any(x.size(), x.size());
  for (double& entry : any.reshaped()) entry = random.normal();
  const Matrix rotation = Eigen::HouseholderQR<Matrix>(any).householderQ();
  return ellipsoid(rotation * x);
}

// Number of evaluations until a merit is below 1e-10.
int merits_needed(double (*merit)(const Vector&), int axes, std::uint64_t seed) {
  Random random(seed);
  Evolution evolution(Vector::Constant(axes, 0.3), Vector::Constant(axes, 0.1), Constants::usual_population(axes));
  for (int needed = 0; needed < 20000;) {
    std::vector<std::pair<double, Vector>> drawn;
    for (int i = 0; i < evolution.constants().lambda; ++i) {
      const Vector point = evolution.draw(random);
      drawn.emplace_back(merit(point), point);
    }
    needed += evolution.constants().lambda;
    std::sort(drawn.begin(), drawn.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    if (drawn[0].first < 1e-10) return needed;
    std::vector<Vector> ranked;
    for (const auto& one : drawn) ranked.push_back(one.second);
    evolution.learn(ranked);
  }
  return 1 << 30;
}

int median_needed(double (*merit)(const Vector&), int axes) {
  std::vector<int> needed;
  for (std::uint64_t seed = 1; seed <= 21; ++seed) needed.push_back(merits_needed(merit, axes, seed));
  std::nth_element(needed.begin(), needed.begin() + 10, needed.end());
  return needed[10];
}

// Medians of pycma 4.5.0 without negative weights, 21 seeds; see README.md. Its c_sigma and c_mu differ slightly.
TEST(CmaEs, ConvergesAsFastAsPycma) {
  const struct {
    const char* name;
    double (*merit)(const Vector&);
    int axes, pycma;
  } cases[] = {{"sphere", sphere, 5, 728},      {"ellipsoid", ellipsoid, 5, 2072},     {"turned", turned, 5, 1976},
               {"sphere 10", sphere, 10, 1430}, {"ellipsoid 10", ellipsoid, 10, 5790}, {"turned 10", turned, 10, 5780}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.name);
    const int needed = median_needed(one.merit, one.axes);
    RecordProperty(one.name, needed);
    EXPECT_NEAR(needed, one.pycma, 0.15 * one.pycma);
  }
}

plugin_host::Catalog& catalog() {
  static auto* catalog = [] {
    auto* fresh = new plugin_host::Catalog;
    fresh->add(std::string(RELIGN_PLUGIN_DIR) + "/cma_es");
    return fresh;
  }();
  return *catalog;
}

void run(const FakeTrial& trial, const Json& parameters = {}) {
  Algorithm algorithm(catalog().resolve_or_throw(Kind::optimizer, "cma-es", parameters), {});
  algorithm.run(trial.handle());
}

FakeSetup bowl_setup(std::uint32_t axes) {
  FakeSetup setup;
  setup.axes = axes;
  Pose optimum(axes);
  for (std::uint32_t axis = 0; axis < axes; ++axis) optimum[axis] = axis % 2 ? -0.21 : 0.17;
  setup.merit = [optimum](const Pose& pose, std::uint32_t) { return test::bowl(pose, optimum); };
  return setup;
}

TEST(CmaEs, MinimisesQuadraticInAnyDimension) {
  for (const std::uint32_t axes : {1u, 2u, 5u, 6u, 10u}) {
    SCOPED_TRACE(axes);
    FakeSetup setup = bowl_setup(axes);
    setup.budget = 1000;
    FakeTrial trial(setup);
    run(trial);
    ASSERT_FALSE(trial.recommendations.empty());
    EXPECT_LT(setup.merit(trial.recommendations.back().pose, 0), 0.01 + 5e-5);
  }
}

TEST(CmaEs, RecommendsMeanAfterEveryGeneration) {
  FakeTrial trial(bowl_setup(5));
  run(trial);
  ASSERT_EQ(trial.recommendations.size(), 6u);  // 50 steps, 8 per generation
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(trial.recommendations[i].steps_made, 8 * (i + 1));
  // The first one: the weighted mean of the four best of eight, all inside the box.
  std::vector<FakeTrial::Visit> best(trial.steps.begin(), trial.steps.begin() + 8);
  std::sort(best.begin(), best.end(), [](const auto& a, const auto& b) { return a.merit < b.merit; });
  const Constants k(5, 8);
  for (std::size_t axis = 0; axis < 5; ++axis) {
    double mean = 0;
    for (int i = 0; i < k.mu; ++i) mean += k.weights[i] * best[std::size_t(i)].pose[axis];
    EXPECT_NEAR(trial.recommendations[0].pose[axis], mean, 1e-14);
  }
}

// Excess over the minimum of a noisy quadratic, mean of 20 seeds: of the recommendation and of the best measured pose.
struct Excess {
  double recommended = 0, measured_best = 0;
};

Excess noisy_excess(int population) {
  Excess excess;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    FakeSetup setup = bowl_setup(5);
    const auto clean = setup.merit;
    setup.merit = [clean, seed](const Pose& pose, std::uint32_t step) {
      Random noise(seed, step + 1);
      return clean(pose, step) + 0.02 * noise.normal();
    };
    setup.seed = seed;
    setup.budget = 400;
    FakeTrial trial(setup);
    run(trial, {{"population", population}});
    excess.recommended += (clean(trial.recommendations.back().pose, 0) - 0.01) / 20;
    excess.measured_best += (clean(trial.best_pose(), 0) - 0.01) / 20;
  }
  return excess;
}

TEST(CmaEs, LargerPopulationsReduceNoise) {
  const Excess usual = noisy_excess(0), twice = noisy_excess(16);
  EXPECT_LT(twice.recommended, 0.7 * usual.recommended);
  EXPECT_LT(twice.recommended, 0.7 * twice.measured_best);
}

TEST(CmaEs, FindsOptimumInCornerOfTheBox) {
  FakeSetup setup;
  setup.axes = 3;
  setup.lower = {0.2, -0.5, 2};
  setup.upper = {0.8, 0.5, 6};
  setup.start = {0.9, 0, 3};  // outside
  setup.budget = 600;
  setup.merit = [](const Pose& pose, std::uint32_t) { return pose[0] - pose[1] + pose[2]; };
  FakeTrial trial(setup);
  run(trial);
  for (const auto& visit : trial.steps)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_GE(visit.pose[axis], setup.lower[axis]);
      EXPECT_LE(visit.pose[axis], setup.upper[axis]);
    }
  EXPECT_NEAR(setup.merit(trial.recommendations.back().pose, 0), 0.2 - 0.5 + 2, 0.005);
}

TEST(CmaEs, RestartsLeaveLocalMinimum) {
  FakeSetup setup;
  setup.axes = 2;
  setup.budget = 3000;
  setup.merit = [](const Pose& pose, std::uint32_t) {  // the start is in the higher of two minima
    const double here = pose[0] * pose[0] + pose[1] * pose[1];
    const double there = std::pow(pose[0] - 0.4, 2) + std::pow(pose[1] + 0.4, 2);
    return std::min(0.2 + 10 * here, 0.1 + 5 * there);
  };
  FakeTrial trial(setup);
  run(trial, {{"first_stride", 0.01}});
  ASSERT_FALSE(trial.recommendations.empty());
  EXPECT_NEAR(setup.merit(trial.recommendations.front().pose, 0), 0.2, 0.02);
  EXPECT_NEAR(setup.merit(trial.recommendations.back().pose, 0), 0.1, 1e-4);
}

TEST(CmaEs, ConstantMeritsEndTheTrialWithoutRecommendation) {
  FakeSetup setup = bowl_setup(5);
  for (const double level : {0.03, std::numeric_limits<double>::quiet_NaN()}) {
    setup.merit = [level](const Pose&, std::uint32_t) { return level; };
    setup.budget = 1000000;
    FakeTrial trial(setup);
    run(trial);
    EXPECT_FALSE(trial.stopped);
    EXPECT_LT(trial.steps.size(), 60000u);
    for (const auto& recommendation : trial.recommendations) EXPECT_EQ(recommendation.pose, Pose(5, 0.0));
  }
}

TEST(CmaEs, RejectsTooSmallPopulation) {
  try {
    Algorithm algorithm(catalog().resolve_or_throw(Kind::optimizer, "cma-es", {{"population", 3}}), {});
    FAIL() << "no exception";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("found '3', must be 0 (the default population) or at least 4"));
  }
}

}  // namespace
}  // namespace relign::cma_es_tests
