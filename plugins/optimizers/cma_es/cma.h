// The (mu/mu_w, lambda) covariance matrix adaptation evolution strategy of N. Hansen, "The CMA Evolution Strategy: A
// Tutorial" (arXiv 1604.00772), with its default constants and positive weights only. It draws points and learns from
// their ranking; merits are evaluated elsewhere. See README.md.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <relign/random.hpp>
#include <vector>

namespace cma_es {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

// Table 1 of the tutorial for n axes and a population of lambda.
struct Constants {
  Constants(int axes, int population) : n(axes), lambda(population), mu(population / 2), weights(mu) {
    for (int i = 0; i < mu; ++i) weights[i] = std::log((lambda + 1) / 2.0) - std::log(i + 1.0);
    weights /= weights.sum();
    mu_eff = 1 / weights.squaredNorm();
    c_c = (4 + mu_eff / n) / (n + 4 + 2 * mu_eff / n);
    c_s = (mu_eff + 2) / (n + mu_eff + 5);
    c_1 = 2 / ((n + 1.3) * (n + 1.3) + mu_eff);
    c_mu = std::min(1 - c_1, 2 * (mu_eff - 2 + 1 / mu_eff) / ((n + 2.0) * (n + 2.0) + mu_eff));
    damping = 1 + 2 * std::max(0.0, std::sqrt((mu_eff - 1) / (n + 1)) - 1) + c_s;
    expected_length = std::sqrt(double(n)) * (1 - 1 / (4.0 * n) + 1 / (21.0 * n * n));
  }
  static int usual_population(int axes) { return 4 + static_cast<int>(3 * std::log(double(axes))); }

  int n, lambda, mu;
  Vector weights;  // for the mu best, best first
  double mu_eff, c_c, c_s, c_1, c_mu, damping;
  double expected_length;  // of a standard normal vector
};

class Evolution {
 public:
  // stride: standard deviation of the first draws per axis, not 0.
  Evolution(const Vector& mean, const Vector& stride, int population)
      : k_(static_cast<int>(mean.size()), population),
        scale_(stride),
        mean_(mean),
        path_c_(Vector::Zero(k_.n)),
        path_s_(Vector::Zero(k_.n)),
        covariance_(Matrix::Identity(k_.n, k_.n)),
        axes_(covariance_),
        lengths_(Vector::Ones(k_.n)) {}

  const Constants& constants() const { return k_; }
  const Vector& mean() const { return mean_; }
  // Largest standard deviation of the draws over all directions, in units of the first one.
  double spread() const { return sigma_ * lengths_.maxCoeff(); }
  double condition() const { return std::pow(lengths_.maxCoeff() / lengths_.minCoeff(), 2); }

  Vector draw(relign::Random& random) const {
    Vector normal(k_.n);
    for (int axis = 0; axis < k_.n; ++axis) normal[axis] = random.normal();
    const Vector turned = axes_ * lengths_.cwiseProduct(normal);
    return mean_ + sigma_ * scale_.cwiseProduct(turned);
  }

  // ranked: all draws of one generation, best first.
  void learn(const std::vector<Vector>& ranked) {
    ++generation_;
    Vector step = Vector::Zero(k_.n);  // move of the mean, in units of the stride and sigma
    Matrix rank_mu = Matrix::Zero(k_.n, k_.n);
    for (int i = 0; i < k_.mu; ++i) {
      const Vector y = (ranked[i] - mean_).cwiseQuotient(scale_) / sigma_;
      step += k_.weights[i] * y;
      rank_mu += k_.weights[i] * y * y.transpose();
    }
    mean_ += sigma_ * scale_.cwiseProduct(step);

    const Vector whitened = axes_ * (axes_.transpose() * step).cwiseQuotient(lengths_);
    path_s_ = (1 - k_.c_s) * path_s_ + std::sqrt(k_.c_s * (2 - k_.c_s) * k_.mu_eff) * whitened;
    const double length = path_s_.norm();
    // While the step size is still increasing, the path does not reflect the shape (h_sigma in the tutorial).
    const double begun = std::sqrt(1 - std::pow(1 - k_.c_s, 2.0 * generation_));
    const bool calm = length / begun < (1.4 + 2.0 / (k_.n + 1)) * k_.expected_length;
    path_c_ *= 1 - k_.c_c;
    if (calm) path_c_ += std::sqrt(k_.c_c * (2 - k_.c_c) * k_.mu_eff) * step;
    const double kept = 1 - k_.c_1 - k_.c_mu + (calm ? 0 : k_.c_1 * k_.c_c * (2 - k_.c_c));
    covariance_ = kept * covariance_ + k_.c_1 * path_c_ * path_c_.transpose() + k_.c_mu * rank_mu;
    sigma_ *= std::exp(std::min(1.0, k_.c_s / k_.damping * (length / k_.expected_length - 1)));
    sigma_ = std::min(sigma_, kLargestSpread);
    decompose();
  }

 private:
  // Limits the step size where merits do not.
  static constexpr double kLargestSpread = 1e3;

  void decompose() {
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(covariance_);
    const double largest = solver.eigenvalues().maxCoeff();
    if (solver.info() != Eigen::Success || !(largest > 0) || !std::isfinite(largest)) return;  // keep the previous one
    axes_ = solver.eigenvectors();
    lengths_ = solver.eigenvalues().cwiseMax(1e-20 * largest).cwiseSqrt();
  }

  Constants k_;
  Vector scale_;
  Vector mean_;
  Vector path_c_, path_s_;
  Matrix covariance_;
  Matrix axes_;     // eigenvectors of the covariance
  Vector lengths_;  // square roots of its eigenvalues
  double sigma_ = 1;
  int generation_ = 0;
};

}  // namespace cma_es
