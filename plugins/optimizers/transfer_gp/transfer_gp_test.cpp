// Identities of the hierarchy against independent computations, fits, and the format of the pretraining data.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <relign/random.hpp>

#include "search.hpp"
#include "source_fit.hpp"
#include "surrogates/candidates.hpp"
#include "surrogates/gaussian_process.hpp"

namespace transfer_gp {
namespace {

constexpr Eigen::Index kAxes = 3;
constexpr std::size_t kLevels = 4;
constexpr Eigen::Index kEach = 9;

Vector theta_of(std::size_t level) {
  Vector theta(kAxes + 2);
  theta << std::log(level == 0 ? 1.3 : 0.2 + 0.1 * static_cast<double>(level)), std::log(0.4), std::log(0.7),
      std::log(0.3 + 0.1 * static_cast<double>(level)), std::log(0.02 + 0.01 * static_cast<double>(level));
  return theta;
}

// A synthetic family with values of mean 0 and deviation 1, approximately.
SourceData family() {
  SourceData data;
  data.dimensions = kAxes;
  relign::Random random(3);
  for (std::size_t level = 0; level < kLevels; ++level) {
    Source source;
    source.points = surrogates::uniform_points(random, kAxes, kEach);
    source.merits.resize(kEach);
    for (Eigen::Index i = 0; i < kEach; ++i)
      source.merits[i] = std::sin(5 * source.points(0, i) + 0.2 * static_cast<double>(level)) +
                         source.points(1, i) * source.points(2, i) + 0.1 * random.normal();
    source.theta = theta_of(level);
    data.sources.push_back(std::move(source));
  }
  return data;
}

// A model of the values without scaling.
SourceModel raw_model(const SourceData& data, Stacking stacking, std::size_t levels = kLevels) {
  SourceModel model(Shape::rbf, stacking);
  for (std::size_t level = 0; level < levels; ++level)
    EXPECT_TRUE(model.append(data.sources[level].points, data.sources[level].merits, data.sources[level].theta));
  return model;
}

Matrix places(std::uint64_t seed, std::size_t count) {
  relign::Random random(seed);
  return surrogates::uniform_points(random, kAxes, count);
}

struct Posterior {
  Vector mean;
  Matrix covariance;
};

Matrix kernel(std::size_t level, const Matrix& a, const Matrix& b) {
  return surrogates::Kernel(Shape::rbf, theta_of(level)).between(a, b);
}
double noise(std::size_t level) { return std::exp(theta_of(level)[kAxes + 1]) + surrogates::kJitter; }

// The joint HGP by definition: one matrix of all samples.
Posterior joint(const SourceData& data, std::size_t levels, const Matrix& at) {
  const auto all = static_cast<Eigen::Index>(levels) * kEach;
  Matrix matrix(all, all), beside(all, at.cols()), prior = Matrix::Zero(at.cols(), at.cols());
  Vector values(all);
  for (std::size_t i = 0; i < levels; ++i) {
    const auto row = static_cast<Eigen::Index>(i) * kEach;
    values.segment(row, kEach) = data.sources[i].merits;
    Matrix to_target = Matrix::Zero(kEach, at.cols());
    for (std::size_t j = 0; j < levels; ++j) {
      Matrix block = Matrix::Zero(kEach, kEach);
      for (std::size_t l = 0; l <= std::min(i, j); ++l)
        block += kernel(l, data.sources[i].points, data.sources[j].points);
      if (i == j) block.diagonal().array() += noise(i);
      matrix.block(row, static_cast<Eigen::Index>(j) * kEach, kEach, kEach) = block;
    }
    for (std::size_t l = 0; l <= i; ++l) to_target += kernel(l, data.sources[i].points, at);
    beside.middleRows(row, kEach) = to_target;
    prior += kernel(i, at, at);
  }
  const Eigen::LDLT<Matrix> root(matrix);
  return {beside.transpose() * root.solve(values), prior - beside.transpose() * root.solve(beside)};
}

// The stack by definition: the posterior of one level plus the next kernel is the prior of the next level.
Posterior stack(const SourceData& data, std::size_t levels, const Matrix& at) {
  Matrix points(kAxes, static_cast<Eigen::Index>(levels) * kEach + at.cols());
  for (std::size_t i = 0; i < levels; ++i)
    points.middleCols(static_cast<Eigen::Index>(i) * kEach, kEach) = data.sources[i].points;
  points.rightCols(at.cols()) = at;
  Posterior now{Vector::Zero(points.cols()), Matrix::Zero(points.cols(), points.cols())};
  for (std::size_t i = 0; i < levels; ++i) {
    const auto row = static_cast<Eigen::Index>(i) * kEach;
    now.covariance += kernel(i, points, points);
    Matrix seen = now.covariance.block(row, row, kEach, kEach);
    seen.diagonal().array() += noise(i);
    const Eigen::LDLT<Matrix> root(seen);
    const Matrix beside = now.covariance.middleCols(row, kEach);
    now.mean += beside * root.solve(data.sources[i].merits - now.mean.segment(row, kEach));
    now.covariance -= beside * root.solve(beside.transpose());
  }
  return {now.mean.tail(at.cols()), now.covariance.bottomRightCorner(at.cols(), at.cols())};
}

TEST(TransferGpHierarchy, SequentialConditioningEqualsJointModel) {
  const SourceData data = family();
  const Matrix at = places(8, 12);
  const SourceModel model = raw_model(data, Stacking::exact);
  const Known known = model.know(at);
  const Matrix covariance = model.covariance(known, known);
  for (const Posterior& other : {joint(data, kLevels, at), stack(data, kLevels, at)}) {
    EXPECT_LT((known.mean - other.mean).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT((covariance - other.covariance).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT((model.variance(known) - other.covariance.diagonal()).cwiseAbs().maxCoeff(), 1e-8);
  }
  EXPECT_LT((model.mean(at) - known.mean).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(known.mean.cwiseAbs().maxCoeff(), 0.1) << "otherwise the comparison is meaningless";
}

// The last source as target, added value by value, gives the joint model of all sources.
TEST(TransferGpHierarchy, TargetAddedValueByValueEqualsJointModel) {
  const SourceData data = family();
  const Source& last = data.sources.back();
  const Matrix at = places(9, 40);
  const SourceModel sources = raw_model(data, Stacking::exact, kLevels - 1);
  Candidates candidates = make_candidates(sources, at);
  TargetModel target(sources);
  for (Eigen::Index i = 0; i < kEach; ++i) target.add(last.points.col(i), last.merits[i], candidates);
  target.set_theta(last.theta);
  const Posterior whole = joint(data, kLevels, at);
  const Predictions predicted = target.predict(at);
  EXPECT_LT((predicted.mean - whole.mean).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((predicted.deviation.array().square() - whole.covariance.diagonal().array()).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((target.mean(at) - whole.mean).cwiseAbs().maxCoeff(), 1e-8);
  // Candidates are stored in single precision.
  const Predictions kept = target.predict(candidates);
  EXPECT_LT((kept.mean - whole.mean).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((kept.deviation - predicted.deviation).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(TransferGpHierarchy, AppendEqualsRefactorisation) {
  const SourceData data = family();
  const Matrix at = places(10, 15);
  SourceModel grown = raw_model(data, Stacking::exact, kLevels - 1);
  ASSERT_TRUE(grown.append(data.sources.back().points, data.sources.back().merits, data.sources.back().theta));
  const Known known = grown.know(at);
  const Posterior anew = joint(data, kLevels, at);
  EXPECT_LT((known.mean - anew.mean).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((grown.covariance(known, known) - anew.covariance).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(TransferGpHierarchy, WithoutTargetValuesPosteriorIsThatOfTheSources) {
  const SourceData data = family();
  const Matrix at = places(11, 15);
  for (const Stacking stacking : {Stacking::exact, Stacking::means, Stacking::boosted}) {
    const SourceModel sources = raw_model(data, stacking);
    const Known known = sources.know(at);
    // A value with huge noise has no effect.
    Candidates candidates = make_candidates(sources, at);
    TargetModel target(sources);
    target.add(Vector::Constant(kAxes, 0.5), 3.0, candidates);
    Vector theta = theta_of(1);
    theta[0] = std::log(1e-12);
    theta[kAxes + 1] = std::log(1e12);
    target.set_theta(theta);
    const Predictions predicted = target.predict(at);
    EXPECT_LT((predicted.mean - known.mean).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT((predicted.deviation - sources.variance(known).cwiseSqrt()).cwiseAbs().maxCoeff(), 1e-5);
    EXPECT_EQ(make_candidates(sources, at).covariance.rows(), 0);
  }
}

// mhgp: each level is fitted to the residuals of the previous means, and the sources have no variance.
TEST(TransferGpHierarchy, MeansStackFitsResiduals) {
  const SourceData data = family();
  const Matrix at = places(12, 10);
  Vector mean = Vector::Zero(at.cols());
  std::vector<Vector> weights;
  for (std::size_t level = 0; level < kLevels; ++level) {
    Vector left = data.sources[level].merits;
    for (std::size_t before = 0; before < level; ++before)
      left -= kernel(before, data.sources[level].points, data.sources[before].points) * weights[before];
    Matrix own = kernel(level, data.sources[level].points, data.sources[level].points);
    own.diagonal().array() += noise(level);
    weights.emplace_back(own.ldlt().solve(left));
    mean += kernel(level, at, data.sources[level].points) * weights.back();
  }
  const SourceModel means = raw_model(data, Stacking::means), boosted = raw_model(data, Stacking::boosted);
  EXPECT_LT((means.know(at).mean - mean).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((boosted.know(at).mean - mean).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(means.variance(means.know(at)).maxCoeff(), 0);
}

// bhgp: the error covariance follows level by level from B S B^T plus the posterior covariance of the level's own
// kernel.
TEST(TransferGpHierarchy, BoostedCovarianceIsThatOfTheErrorOfTheMeans) {
  const SourceData data = family();
  const Matrix at = places(13, 8);
  Matrix points(kAxes, static_cast<Eigen::Index>(kLevels) * kEach + at.cols());
  for (std::size_t i = 0; i < kLevels; ++i)
    points.middleCols(static_cast<Eigen::Index>(i) * kEach, kEach) = data.sources[i].points;
  points.rightCols(at.cols()) = at;
  Matrix error = Matrix::Zero(points.cols(), points.cols());
  for (std::size_t i = 0; i < kLevels; ++i) {
    const auto row = static_cast<Eigen::Index>(i) * kEach;
    Matrix seen = kernel(i, data.sources[i].points, data.sources[i].points);
    seen.diagonal().array() += noise(i);
    const Matrix gain = seen.ldlt().solve(kernel(i, data.sources[i].points, points)).transpose();
    Matrix passed = Matrix::Identity(points.cols(), points.cols());
    passed.middleCols(row, kEach) -= gain;
    error = passed * error * passed.transpose() + kernel(i, points, points) -
            gain * kernel(i, data.sources[i].points, points);
  }
  const SourceModel boosted = raw_model(data, Stacking::boosted), exact = raw_model(data, Stacking::exact);
  const Known known = boosted.know(at);
  EXPECT_LT((boosted.covariance(known, known) - error.bottomRightCorner(at.cols(), at.cols())).cwiseAbs().maxCoeff(),
            1e-9);
  // The exact estimator has the smallest variance.
  EXPECT_GE((boosted.variance(known) - exact.variance(exact.know(at))).minCoeff(), -1e-12);

  // The target is one more level of the same kind.
  const SourceModel fewer = raw_model(data, Stacking::boosted, kLevels - 1);
  Candidates candidates = make_candidates(fewer, at);
  TargetModel target(fewer);
  const Source& last = data.sources.back();
  for (Eigen::Index i = 0; i < kEach; ++i) target.add(last.points.col(i), last.merits[i], candidates);
  target.set_theta(last.theta);
  EXPECT_LT((target.predict(at).mean - known.mean).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((target.predict(at).deviation - boosted.variance(known).cwiseSqrt()).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(TransferGpFit, JointLikelihoodGradientMatchesFiniteDifferences) {
  const SourceData data = family();
  Vector thetas(static_cast<Eigen::Index>(kLevels) * (kAxes + 2));
  for (std::size_t level = 0; level < kLevels; ++level)
    thetas.segment(static_cast<Eigen::Index>(level) * (kAxes + 2), kAxes + 2) = theta_of(level);
  for (const Shape shape : {Shape::rbf, Shape::matern52}) {
    Vector gradient;
    joint_log_likelihood(data, shape, thetas, &gradient);
    for (Eigen::Index i = 0; i < thetas.size(); ++i) {
      const double step = 1e-5;
      Vector up = thetas, down = thetas;
      up[i] += step;
      down[i] -= step;
      const double slope =
          (joint_log_likelihood(data, shape, up, nullptr) - joint_log_likelihood(data, shape, down, nullptr)) /
          (2 * step);
      EXPECT_NEAR(gradient[i], slope, 1e-6 * std::max(1.0, std::fabs(slope))) << i;
    }
  }
}

TEST(TransferGpFit, JointFitIncreasesLikelihood) {
  SourceData data = family();
  fit_in_turn(data, Shape::rbf, Stacking::exact);
  const auto likelihood = [&] {
    Vector thetas(static_cast<Eigen::Index>(kLevels) * (kAxes + 2));
    for (std::size_t level = 0; level < kLevels; ++level)
      thetas.segment(static_cast<Eigen::Index>(level) * (kAxes + 2), kAxes + 2) = data.sources[level].theta;
    return joint_log_likelihood(data, Shape::rbf, thetas, nullptr);
  };
  const double in_turn = likelihood();
  fit_together(data, Shape::rbf, 20);
  EXPECT_GT(likelihood(), in_turn);
}

TEST(TransferGpData, RoundTripsAndRejectsDamagedBytes) {
  SourceData data = family();
  data.candidates = make_candidates(fit_in_turn(data, Shape::rbf, Stacking::exact), places(14, 20));
  data.finished = true;
  const std::string bytes = data.to_bytes();
  const SourceData read = SourceData::from_bytes(bytes);
  EXPECT_EQ(read.to_bytes(), bytes);
  EXPECT_EQ(read.sources.size(), kLevels);
  EXPECT_EQ(read.sources[2].theta, data.sources[2].theta);
  EXPECT_THROW(SourceData::from_bytes(""), std::runtime_error);
  EXPECT_THROW(SourceData::from_bytes(bytes.substr(0, bytes.size() - 8)), std::runtime_error);
  EXPECT_THROW(SourceData::from_bytes(bytes + "12345678"), std::runtime_error);
  for (std::size_t place = 0; place < bytes.size(); place += bytes.size() / 50) {
    std::string damaged = bytes;
    damaged[place] ^= '\x10';
    EXPECT_THROW(SourceData::from_bytes(damaged), std::runtime_error) << place;
  }
  data.sources[1].theta.resize(2);
  EXPECT_THROW(SourceData::from_bytes(data.to_bytes()), std::runtime_error) << "valid checksum, inconsistent content";
}

}  // namespace
}  // namespace transfer_gp
