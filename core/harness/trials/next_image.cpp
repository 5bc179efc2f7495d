#include "trials/next_image.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>

#include "base/seeds.h"

namespace relign::trials {
namespace {

// Fraction of the travel. A larger difference would blur edges between black and lit pixels.
constexpr double kDifference = 0.001;
constexpr double kMinEigenvalueRatio = 1e-10;  // to the largest eigenvalue; smaller ones are directions without effect
constexpr double kMinVarianceRatio = 1e-3;     // to the mean variance; bounds the weight of a pixel

// Above this the bound, one line in a figure, would take minutes to compute.
constexpr std::chrono::seconds kMaxRenderTime{3};

}  // namespace

Eigen::VectorXd noise_law(const Eigen::VectorXd& mean, const Eigen::VectorXd& variance) {
  const double average = variance.mean(), lit = mean.mean();
  const Eigen::VectorXd off = mean.array() - lit;
  const double spread = off.squaredNorm();
  double slope = spread > 0 ? std::max(0.0, off.dot(variance) / spread) : 0;
  if (average < slope * lit) slope = average / lit;  // no negative variance in the dark
  const double dark = average - slope * lit;
  return (dark + slope * mean.array()).max(kMinVarianceRatio * average);
}

double next_image_excess(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& weights) {
  // Scales each axis by its effect, so that a small eigenvalue means a small effect and not a large unit.
  Eigen::VectorXd scale = jacobian.colwise().norm();
  const double largest = scale.size() > 0 ? scale.maxCoeff() : 0;
  if (!(largest > 0)) return 0;
  scale = scale.cwiseMax(1e-6 * largest);
  const Eigen::MatrixXd scaled = jacobian * scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd information = scaled.transpose() * weights.asDiagonal() * scaled;
  const Eigen::MatrixXd effect = scaled.transpose() * scaled;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solved(information);
  const double smallest = kMinEigenvalueRatio * solved.eigenvalues().maxCoeff();
  double excess = 0;
  for (Eigen::Index k = 0; k < solved.eigenvalues().size(); ++k) {
    if (!(solved.eigenvalues()[k] > smallest)) continue;
    const Eigen::VectorXd direction = solved.eigenvectors().col(k);
    excess += direction.dot(effect * direction) / solved.eigenvalues()[k];
  }
  return excess / static_cast<double>(jacobian.rows());
}

std::optional<double> next_image_excess(plugin_host::MountedAssembly& lens, const SceneFacts& scene,
                                        const std::vector<double>& optimum, std::uint64_t instance_seed) {
  const auto pixels = static_cast<Eigen::Index>(scene.image_width) * static_cast<Eigen::Index>(scene.image_height);
  const auto axes = static_cast<Eigen::Index>(optimum.size());
  Eigen::VectorXf image(pixels);
  const auto begin = std::chrono::steady_clock::now();
  if (!lens.render_noise_free(optimum, image.data())) return std::nullopt;
  if (std::chrono::steady_clock::now() - begin > kMaxRenderTime) return std::nullopt;
  const Eigen::VectorXd mean = image.cast<double>();
  Eigen::MatrixXd jacobian(pixels, axes);
  for (Eigen::Index axis = 0; axis < axes; ++axis) {
    std::vector<double> beside = optimum;
    double& moved = beside[static_cast<std::size_t>(axis)];
    const double difference = moved < 0.5 ? kDifference : -kDifference;
    moved += difference;
    if (!lens.render_noise_free(beside, image.data())) return std::nullopt;
    jacobian.col(axis) = (image.cast<double>() - mean) / difference;
  }
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(pixels);
  for (unsigned capture = 1; capture <= kCaptures; ++capture) {
    lens.capture(optimum, frame_seed(instance_seed, capture, FrameStream::own_optimum), image.data());
    variance += (image.cast<double>() - mean).cwiseAbs2() / kCaptures;
  }
  if (!(variance.maxCoeff() > 0)) return 0.0;
  return next_image_excess(jacobian, noise_law(mean, variance).cwiseInverse());
}

}  // namespace relign::trials
