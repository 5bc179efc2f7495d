#include "source_fit.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "surrogates/gaussian_process.hpp"

namespace transfer_gp {
namespace {

const double kLogTwoPi = std::log(2 * std::acos(-1.0));

struct Samples {
  Matrix points;
  Vector values;  // standardised
  std::vector<Eigen::Index> firsts;
};

Samples all_samples(const SourceData& data) {
  const Scale scale = data.scale();
  Eigen::Index all = 0;
  Samples samples;
  for (const Source& source : data.sources) {
    samples.firsts.push_back(all);
    all += source.merits.size();
  }
  samples.points.resize(static_cast<Eigen::Index>(data.dimensions), all);
  samples.values.resize(all);
  for (std::size_t number = 0; number < data.sources.size(); ++number) {
    const Source& source = data.sources[number];
    samples.points.middleCols(samples.firsts[number], source.merits.size()) = source.points;
    samples.values.segment(samples.firsts[number], source.merits.size()) = scale(source.merits);
  }
  return samples;
}

}  // namespace

surrogates::ThetaBounds theta_bounds(Eigen::Index dimensions) {
  surrogates::ThetaBounds bounds = surrogates::skopt_bounds(dimensions);
  bounds.lower[0] = std::log(1e-4);
  bounds.lower.segment(1, dimensions).setConstant(std::log(0.05));
  bounds.upper[dimensions + 1] = std::log(10.0);
  return bounds;
}

Vector first_theta(Eigen::Index dimensions) {
  Vector theta = Vector::Constant(dimensions + 2, std::log(0.5));
  theta[0] = 0;
  theta[dimensions + 1] = std::log(0.1);  // as in the authors' stacks
  return theta;
}

SourceModel fit_in_turn(SourceData& data, Shape shape, Stacking stacking) {
  const auto d = static_cast<Eigen::Index>(data.dimensions);
  const Scale scale = data.scale();
  SourceModel model(shape, stacking);
  Vector before = first_theta(d);
  for (Source& source : data.sources) {
    const Vector values = scale(source.merits);
    const Known known = model.know(source.points);
    const bool exact = stacking == Stacking::exact && model.size() > 0;
    const surrogates::Likelihood likelihood(shape, source.points, values - known.mean,
                                            exact ? model.covariance(known, known) : Matrix());
    source.theta = surrogates::fit_theta(likelihood, theta_bounds(d), {first_theta(d), before});
    // Increase the noise until the matrix is numerically positive definite.
    for (int tries = 0; !model.append(source.points, values, source.theta) && tries < 60; ++tries)
      source.theta[d + 1] += 1;
    before = source.theta;
  }
  return model;
}

double joint_log_likelihood(const SourceData& data, Shape shape, const Vector& thetas, Vector* gradient) {
  const Samples samples = all_samples(data);
  const auto d = static_cast<Eigen::Index>(data.dimensions);
  const Eigen::Index all = samples.values.size();
  Matrix covariance = Matrix::Zero(all, all);
  for (std::size_t level = 0; level < data.sources.size(); ++level) {
    const Vector theta = thetas.segment(static_cast<Eigen::Index>(level) * (d + 2), d + 2);
    const Eigen::Index later = all - samples.firsts[level];
    const Matrix points = samples.points.rightCols(later);
    covariance.bottomRightCorner(later, later) += surrogates::Kernel(shape, theta).between(points, points);
    covariance.diagonal().segment(samples.firsts[level], data.sources[level].merits.size()).array() +=
        std::exp(theta[d + 1]) + surrogates::kJitter;
  }
  const Eigen::LLT<Matrix> root(covariance);
  if (gradient) gradient->setZero(thetas.size());
  if (root.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  const Vector weights = root.solve(samples.values);
  const double value = -0.5 * samples.values.dot(weights) - root.matrixLLT().diagonal().array().log().sum() -
                       0.5 * static_cast<double>(all) * kLogTwoPi;
  if (!gradient) return value;
  const Matrix outer = weights * weights.transpose() - root.solve(Matrix::Identity(all, all));
  for (std::size_t level = 0; level < data.sources.size(); ++level) {
    const Eigen::Index at = static_cast<Eigen::Index>(level) * (d + 2), first = samples.firsts[level];
    const Eigen::Index later = all - first, own = data.sources[level].merits.size();
    const Vector theta = thetas.segment(at, d + 2);
    const Matrix points = samples.points.rightCols(later);
    std::vector<Matrix> squares;
    Eigen::ArrayXXd smooth = Eigen::ArrayXXd::Zero(later, later), factor;
    for (Eigen::Index i = 0; i < d; ++i) {
      squares.push_back(surrogates::squared_differences(points.row(i), points.row(i)) * std::exp(-2 * theta[i + 1]));
      smooth += squares.back().array();
    }
    surrogates::apply_shape(shape, smooth, factor);
    const auto part = outer.bottomRightCorner(later, later).array();
    const double half_amplitude = 0.5 * std::exp(theta[0]);
    (*gradient)[at] = half_amplitude * (part * smooth).sum();
    for (Eigen::Index i = 0; i < d; ++i)
      (*gradient)[at + 1 + i] = half_amplitude * (part * factor * squares[static_cast<std::size_t>(i)].array()).sum();
    (*gradient)[at + d + 1] = 0.5 * std::exp(theta[d + 1]) * outer.diagonal().segment(first, own).sum();
  }
  return value;
}

void fit_together(SourceData& data, Shape shape, int iterations) {
  const auto d = static_cast<Eigen::Index>(data.dimensions);
  const auto levels = static_cast<Eigen::Index>(data.sources.size());
  const surrogates::ThetaBounds one = theta_bounds(d);
  Vector start(levels * (d + 2));
  for (Eigen::Index level = 0; level < levels; ++level)
    start.segment(level * (d + 2), d + 2) = data.sources[static_cast<std::size_t>(level)].theta;
  surrogates::SearchLimits limits;
  limits.iterations = iterations;
  const surrogates::Minimum found = surrogates::minimize(
      [&](const Vector& thetas, Vector& gradient) {
        const double value = joint_log_likelihood(data, shape, thetas, &gradient);
        gradient = -gradient;
        return -value;
      },
      start, one.lower.replicate(levels, 1), one.upper.replicate(levels, 1), limits);
  if (!std::isfinite(found.value)) return;  // keep the current ones
  for (Eigen::Index level = 0; level < levels; ++level)
    data.sources[static_cast<std::size_t>(level)].theta = found.at.segment(level * (d + 2), d + 2);
}

}  // namespace transfer_gp
