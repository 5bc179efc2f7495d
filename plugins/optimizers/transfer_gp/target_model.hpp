// Gaussian process of the target with the sources' posterior as prior.
#pragma once

#include "source_model.hpp"
#include "surrogates/growing_cholesky.hpp"

namespace transfer_gp {

// Points at which predictions are repeated at every step: whitened once, stored in single precision; their covariance
// with the target's points grows by a row per point.
struct Candidates {
  Matrix points;                  // d x m
  Vector mean, variance;          // m
  Eigen::MatrixXf white, excess;  // as Known
  Matrix covariance;              // with the target's points, n x m
};
void keep_first(Candidates& candidates, Eigen::Index count);
Candidates make_candidates(const SourceModel& sources, const Matrix& points);

struct Predictions {
  Vector mean, deviation;
};

class TargetModel {
 public:
  explicit TargetModel(const SourceModel& sources) : sources_(&sources) {}

  // Adds a standardised value and a row to the candidates' covariance. set_theta or extend must follow.
  void add(const Vector& point, double value, Candidates& candidates);
  void set_values(const Vector& values);  // replaces all values

  Eigen::Index size() const { return values_.size(); }
  // For the fit of theta: values minus the sources' mean, and the sources' posterior covariance there (empty unless the
  // stacking is exact).
  Vector residual() const { return values_ - known_.mean; }
  Matrix fixed_covariance() const;
  const Matrix& points() const { return known_.points; }

  // Sets theta of the target's own kernel and refactorises.
  void set_theta(const Vector& theta);
  // Appends the last value to the factor with the current theta.
  void extend();

  Predictions predict(const Candidates& candidates) const;
  Predictions predict(const Matrix& points) const;
  // The mean only, with much less work.
  Vector mean(const Matrix& points) const;

 private:
  Predictions predict(const Matrix& points, const Vector& mean, const Vector& variance, const Matrix& covariance) const;

  const SourceModel* sources_;
  Known known_;        // the prior at the target's points
  Matrix covariance_;  // the sources' posterior covariance there, n x n
  Vector values_;
  Vector theta_;
  surrogates::Kernel kernel_{Shape::rbf, Vector::Zero(2)};
  surrogates::GrowingCholesky root_;
  Vector weights_;
};

}  // namespace transfer_gp
