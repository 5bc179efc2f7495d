// The target: few values, on top of what the sources taught.
#pragma once

#include "source_model.hpp"
#include "surrogates/growing_cholesky.hpp"

namespace transfer_gp {

// Many places at which predictions are asked for again and again: whitened once, kept in single precision, and their
// covariance with the target's points grows by a row for each of those.
struct Candidates {
  Matrix points;                  // d x m
  Vector mean, variance;          // m
  Eigen::MatrixXf white, excess;  // as Known
  Matrix covariance;              // with the target's points, n x m
};
// The first of them alone.
void keep_first(Candidates& candidates, Eigen::Index count);
Candidates make_candidates(const SourceModel& sources, const Matrix& points);

struct Predictions {
  Vector mean, deviation;
};

class TargetModel {
 public:
  explicit TargetModel(const SourceModel& sources) : sources_(&sources) {}

  // One more value, in standardised units; the candidates' covariance grows with it. set_theta or extend must follow.
  void add(const Vector& point, double value, Candidates& candidates);
  void set_values(const Vector& values);  // of all points

  Eigen::Index size() const { return values_.size(); }
  // What the sources do not explain, for the search of theta: values less their mean, and the covariance that is left
  // of them there (empty where the stacking takes no notice of it).
  Vector residual() const { return values_ - known_.mean; }
  Matrix fixed_covariance() const;
  const Matrix& points() const { return known_.points; }

  // Theta of the target's own kernel, for what follows.
  void set_theta(const Vector& theta);
  // The same theta with one value more, by a row of the factor, not a new one.
  void extend();

  Predictions predict(const Candidates& candidates) const;
  Predictions predict(const Matrix& points) const;
  // The mean alone, with much less work.
  Vector mean(const Matrix& points) const;

 private:
  Predictions predict(const Matrix& points, const Vector& mean, const Vector& variance, const Matrix& covariance) const;

  const SourceModel* sources_;
  Known known_;        // at the target's points
  Matrix covariance_;  // of the sources' posterior there, n x n
  Vector values_;
  Vector theta_;
  surrogates::Kernel kernel_{Shape::rbf, Vector::Zero(2)};
  surrogates::GrowingCholesky root_;
  Vector weights_;
};

}  // namespace transfer_gp
