#include "gaussian_process.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <relign/random.hpp>

#include "acquisition.hpp"
#include "base/json_source.h"
#include "likelihood.hpp"

namespace surrogates {
namespace {

using relign::Json;

constexpr Shape kShapes[] = {Shape::matern52, Shape::rbf};

Vector to_vector(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Matrix to_columns(const Json& json) {
  Matrix made(static_cast<Eigen::Index>(json.at(0).size()), static_cast<Eigen::Index>(json.size()));
  for (std::size_t i = 0; i < json.size(); ++i) made.col(static_cast<Eigen::Index>(i)) = to_vector(json[i]);
  return made;
}

struct Case {
  Matrix points;
  Vector values;
  Vector theta;
};

Case random_case(std::uint64_t seed) {
  relign::Random random(seed);
  const auto dimensions = static_cast<Eigen::Index>(1 + random.below(10));
  const auto count = static_cast<Eigen::Index>(3 + random.below(20));
  Case made{Matrix(dimensions, count), Vector(count), Vector(dimensions + 2)};
  for (double& value : made.points.reshaped()) value = random.uniform();
  for (double& value : made.values) value = random.normal();
  for (double& value : made.theta) value = random.uniform(-1.5, 1.5);
  made.theta[dimensions + 1] = random.uniform(-7, 0);
  return made;
}

Vector standardised(const Vector& values) { return Standard(values).apply(values); }

// Central differences.
template <class Function>
Vector differences(const Function& function, const Vector& at, double stride) {
  Vector slopes(at.size());
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    Vector up = at;
    Vector down = at;
    up[i] += stride;
    down[i] -= stride;
    slopes[i] = (function(up) - function(down)) / (2 * stride);
  }
  return slopes;
}

void expect_near(const Vector& a, const Vector& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (Eigen::Index i = 0; i < a.size(); ++i)
    EXPECT_NEAR(a[i], b[i], tolerance * std::max(1.0, std::fabs(b[i]))) << "entry " << i;
}

TEST(GaussianProcess, MatchesScikitLearn) {
  const Json golden = relign::JsonSource::from_file(RELIGN_TEST_DATA "/gp_likelihood.json").root();
  ASSERT_EQ(golden.at("cases").size(), 20u);
  for (const Json& one : golden.at("cases")) {
    const Shape shape = one.at("kernel") == "rbf" ? Shape::rbf : Shape::matern52;
    const Matrix points = to_columns(one.at("points"));
    const Vector values = to_vector(one.at("values"));
    const Vector theta = to_vector(one.at("theta"));
    Vector gradient;
    const double value = Likelihood(shape, points, standardised(values)).log(theta, &gradient);
    EXPECT_NEAR(value, one.at("log_likelihood").get<double>(), 1e-8);
    expect_near(gradient, to_vector(one.at("gradient")), 1e-8);

    const GaussianProcess process(shape, points, values, theta, Standard(values));
    const Matrix queries = to_columns(one.at("queries"));
    Vector mean;
    Vector deviation;
    process.predict(queries, mean, deviation);
    expect_near(mean, to_vector(one.at("mean")), 1e-8);
    expect_near(deviation, to_vector(one.at("deviation")), 1e-8);
    for (Eigen::Index i = 0; i < queries.cols(); ++i) {
      const Prediction predicted = process.predict(Vector(queries.col(i)));
      EXPECT_NEAR(predicted.mean, mean[i], 1e-9);
      EXPECT_NEAR(predicted.deviation, deviation[i], 1e-9);
    }
  }
}

TEST(Likelihood, GradientMatchesFiniteDifferences) {
  for (const Shape shape : kShapes)
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      SCOPED_TRACE(seed);
      Case one = random_case(seed);
      // Without noise rounding dominates the differences of a smooth kernel.
      if (shape == Shape::rbf) one.theta.tail(1) = one.theta.tail(1).cwiseMax(-3);
      // Half of the cases have a fixed covariance.
      Matrix fixed;
      if (seed % 2) fixed = 0.3 * Kernel(Shape::rbf, Vector::Zero(one.theta.size())).between(one.points, one.points);
      const Likelihood likelihood(shape, one.points, one.values, fixed);
      Vector gradient;
      likelihood.log(one.theta, &gradient);
      expect_near(gradient,
                  differences([&](const Vector& theta) { return likelihood.log(theta, nullptr); }, one.theta, 1e-5),
                  1e-6);
    }
}

TEST(GaussianProcess, AcquisitionGradientMatchesFiniteDifferences) {
  for (const Shape shape : kShapes)
    for (std::uint64_t seed = 0; seed < 20; ++seed)
      for (const auto kind : {Acquisition::expected_improvement, Acquisition::lower_bound, Acquisition::probability,
                              Acquisition::log_expected_improvement}) {
        SCOPED_TRACE(std::to_string(seed) + ", acquisition " + std::to_string(static_cast<int>(kind)));
        const Case one = random_case(seed);
        const GaussianProcess process(shape, one.points, one.values, one.theta, Standard(one.values));
        const AcquisitionSetup setup{one.values.minCoeff(), 0.01, 1.96};
        const Vector at = Vector::Constant(one.points.rows(), 0.4);
        Vector gradient;
        Vector unused;
        acquisition_cost(kind, setup, process.predict(at), gradient);
        expect_near(
            gradient,
            differences([&](const Vector& x) { return acquisition_cost(kind, setup, process.predict(x), unused); }, at,
                        1e-5),
            1e-6);
      }
}

// Conditioning on one half of the data and then on the other equals conditioning on all: the posterior of the first
// process is the prior of the second one, whose own kernel has negligible amplitude.
TEST(GaussianProcess, PriorReplacesTheDataOfItsPosterior) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    Case one = random_case(seed);
    one.theta[one.theta.size() - 1] = std::log(0.01);
    const Eigen::Index n = one.points.cols();
    const Eigen::Index half = n / 2;
    const Matrix first = one.points.leftCols(half);
    const Matrix second = one.points.rightCols(n - half);
    const Kernel kernel(Shape::matern52, one.theta);
    GrowingCholesky root;
    Matrix covariance = kernel.between(first, first);
    covariance.diagonal().array() += 0.01 + kJitter;
    ASSERT_TRUE(root.compute(covariance));
    const Vector weights = root.solve(one.values.head(half));
    const auto left = [&](const Matrix& a, const Matrix& b) -> Matrix {
      Matrix to_a = kernel.between(first, a);
      Matrix to_b = kernel.between(first, b);
      root.whiten(to_a);
      root.whiten(to_b);
      return kernel.between(a, b) - to_a.transpose() * to_b;
    };
    const PriorAtPoints known{kernel.between(second, first) * weights, left(second, second)};
    Vector theta = one.theta;
    theta[0] = std::log(1e-14);
    const GaussianProcess process(Shape::matern52, second, one.values.tail(n - half), theta, Standard(), &known);
    const GaussianProcess all(Shape::matern52, one.points, one.values, one.theta, Standard());
    const Matrix at = Matrix::Constant(one.points.rows(), 1, 0.37);
    const PriorAtMany there{kernel.between(at, first) * weights, left(at, at).diagonal(), left(second, at)};
    Vector mean;
    Vector deviation;
    process.predict(at, mean, deviation, &there);
    const Prediction expected = all.predict(Vector(at.col(0)));
    EXPECT_NEAR(mean[0], expected.mean, 1e-8);
    EXPECT_NEAR(deviation[0], expected.deviation, 1e-8);
    PriorAt here;
    here.mean = there.mean[0];
    here.variance = there.variance[0];
    here.covariance = there.covariance.col(0);
    here.mean_gradient = here.variance_gradient = Vector::Zero(at.rows());
    here.covariance_gradient = Matrix::Zero(at.rows(), n - half);
    EXPECT_NEAR(process.predict(Vector(at.col(0)), &here).mean, expected.mean, 1e-8);
    EXPECT_NEAR(process.predict(Vector(at.col(0)), &here).deviation, expected.deviation, 1e-8);
  }
}

TEST(Likelihood, DerivativeByMeanMatchesFiniteDifferences) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Case one = random_case(seed);
    const Likelihood likelihood(Shape::matern52, one.points, one.values);
    const Likelihood shifted(Shape::matern52, one.points, one.values.array() - 0.3);
    Vector gradient, same;
    double by_mean = 0;
    EXPECT_NEAR(likelihood.log(one.theta, &gradient, 0.3, &by_mean), shifted.log(one.theta, &same), 1e-9);
    expect_near(gradient, same, 1e-9);
    const double slope =
        (likelihood.log(one.theta, nullptr, 0.301) - likelihood.log(one.theta, nullptr, 0.299)) / 0.002;
    EXPECT_NEAR(by_mean, slope, 1e-5 * std::max(1.0, std::fabs(slope)));
  }
}

// A draw is mean + L z with L L^T the posterior covariance, here by its definition: unit vectors z give L's columns.
// 150 points are more than one block.
TEST(GaussianProcess, DrawHasPosteriorMeanAndCovarianceOfNoisyValues) {
  const Case one = random_case(2);
  const Vector values = 3 + 0.5 * one.values.array();
  const Standard standard(values);
  const GaussianProcess process(Shape::matern52, one.points, values, one.theta, standard);
  relign::Random random(7);
  const Eigen::Index count = 150;
  Matrix at(one.points.rows(), count);
  for (double& x : at.reshaped()) x = random.uniform();
  Vector mean, deviation;
  process.predict(at, mean, deviation);
  expect_near(process.draw(at, Vector::Zero(count)), mean, 1e-9);
  Matrix root(count, count);
  for (Eigen::Index i = 0; i < count; ++i) root.col(i) = process.draw(at, Vector::Unit(count, i)) - mean;

  const Kernel kernel(Shape::matern52, one.theta);
  const double noise = std::exp(one.theta[one.theta.size() - 1]);
  Matrix own = kernel.between(one.points, one.points);
  own.diagonal().array() += noise;
  const Matrix beside = kernel.between(one.points, at);
  Matrix covariance = kernel.between(at, at) - beside.transpose() * own.ldlt().solve(beside);
  covariance.diagonal().array() += noise;
  covariance *= standard.scale * standard.scale;
  EXPECT_LT((root * root.transpose() - covariance).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_NEAR((root * root.transpose())(3, 3), deviation[3] * deviation[3] + noise * standard.scale * standard.scale,
              1e-7);
}

TEST(GaussianProcess, AppendEqualsRefactorisation) {
  for (const Shape shape : kShapes)
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const Case one = random_case(seed);
      const Standard standard(one.values);
      GaussianProcess grown(shape, one.points.leftCols(1), one.values.head(1), one.theta, standard);
      for (Eigen::Index i = 1; i < one.values.size(); ++i) ASSERT_TRUE(grown.append(one.points.col(i), one.values[i]));
      const GaussianProcess whole(shape, one.points, one.values, one.theta, standard);
      const Vector at = Vector::Constant(one.points.rows(), 0.6);
      EXPECT_NEAR(grown.predict(at).mean, whole.predict(at).mean, 1e-10);
      EXPECT_NEAR(grown.predict(at).deviation, whole.predict(at).deviation, 1e-10);
    }
}

TEST(GaussianProcess, AcceptsRepeatedPosesWithoutNoise) {
  const Vector values = Vector::LinSpaced(5, 0, 1);
  const GaussianProcess process(Shape::matern52, Matrix::Constant(2, 5, 0.5), values,
                                Vector{{0, 0, 0, std::log(1e-300)}}, Standard(values));
  EXPECT_NEAR(process.predict(Vector::Constant(2, 0.5)).mean, 0.5, 1e-3);
}

TEST(FitTheta, FindsMaximumWithinBounds) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    const Case one = random_case(seed);
    const Likelihood likelihood(Shape::matern52, one.points, one.values);
    const ThetaBounds bounds = skopt_bounds(one.points.rows());
    const Vector theta = fit_theta(likelihood, bounds, {Vector::Zero(one.theta.size()), one.theta});
    Vector gradient;
    const double value = likelihood.log(theta, &gradient);
    EXPECT_GE(value, likelihood.log(one.theta.cwiseMax(bounds.lower).cwiseMin(bounds.upper), nullptr));
    for (Eigen::Index i = 0; i < theta.size(); ++i) {
      EXPECT_GE(theta[i], bounds.lower[i]);
      EXPECT_LE(theta[i], bounds.upper[i]);
      if (theta[i] < bounds.upper[i]) {
        EXPECT_LT(gradient[i], 1e-3);
      }
      if (theta[i] > bounds.lower[i]) {
        EXPECT_GT(gradient[i], -1e-3);
      }
    }
  }
}

TEST(FitTheta, FollowsStrongPrior) {
  const Case one = random_case(3);
  const Likelihood likelihood(Shape::rbf, one.points, one.values);
  const ThetaPrior prior = [](const Vector& theta, Vector& gradient) {
    gradient.array() -= 2e6 * (theta.array() - 0.25);
    return -1e6 * (theta.array() - 0.25).square().sum();
  };
  const Vector theta = fit_theta(likelihood, skopt_bounds(one.points.rows()), {one.theta}, prior);
  for (const double value : theta) EXPECT_NEAR(value, 0.25, 1e-3);
}

}  // namespace
}  // namespace surrogates
