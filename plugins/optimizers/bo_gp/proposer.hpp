// Bayesian optimisation in the unit cube, without a host: what was seen goes in, poses to measure and the model's
// optimum come out.
#pragma once

#include <array>
#include <optional>
#include <relign/random.hpp>
#include <vector>

#include "surrogates/acquisition.hpp"
#include "surrogates/bounded_lbfgs.hpp"
#include "surrogates/likelihood.hpp"

namespace bo_gp {

using surrogates::Matrix;
using surrogates::Vector;

// The defaults are scikit-optimize's.
struct Recipe {
  std::vector<surrogates::Acquisition> portfolio = {surrogates::Acquisition::expected_improvement,
                                                    surrogates::Acquisition::lower_bound,
                                                    surrogates::Acquisition::probability};  // hedged between
  surrogates::Shape shape = surrogates::Shape::matern52;
  std::size_t initial_points = 10;  // 0: one more than dimensions
  bool latin = false;               // initial points: a Latin hypercube instead of uniform ones
  double xi = 0.01;
  bool xi_relative = false;      // in deviations of the merits
  bool model_incumbent = false;  // to beat: the lowest posterior mean at a measured pose, not the lowest merit
  bool priors = false;           // on the hyper-parameters
  bool warp = false;
  double kappa = 1.96;
  double caution = 0;  // deviations added to the mean whose lowest point is the optimum
  double noise = 0;    // share of the merits' variance; 0: fitted
  std::size_t candidates = 10000;
  std::size_t near_candidates = 0;  // besides: around the model's optimum
  std::size_t restarts = 2;
  std::size_t exact_points = 80;  // more than that: the short cuts of README.md
};

class Proposer {
 public:
  Proposer(std::size_t dimensions, const Recipe& recipe, std::uint64_t seed);

  // A value that is no usable number counts as bad as the worst one seen.
  void tell(const Vector& point, double value);
  Vector ask();
  // The lowest posterior mean (plus caution); nothing while the initial points are measured.
  const std::optional<Vector>& optimum() const { return optimum_; }

 private:
  struct Data {
    Matrix points;
    Vector values;
  };
  Data data() const;
  void fit();
  void find_optimum();
  Vector initial_point();
  Matrix draw_candidates();
  std::size_t choose();
  bool visited(const Vector& point) const;
  bool thrifty() const { return points_.size() > recipe_.exact_points; }

  std::size_t dimensions_;
  Recipe recipe_;
  relign::Random initial_;
  relign::Random candidates_;
  relign::Random dice_;
  surrogates::ThetaBounds bounds_;
  surrogates::ThetaPrior prior_;
  std::vector<Vector> starts_;  // of the search for theta: the same ones at every fit
  std::vector<Vector> design_;  // initial points still to be measured, the last one first
  std::vector<Vector> points_;
  std::vector<double> values_;
  Vector theta_;
  std::size_t fitted_with_ = 0;  // points
  std::optional<surrogates::GaussianProcess> model_;
  std::optional<Vector> optimum_;
  double incumbent_ = 0;
  std::vector<Vector> proposals_;  // one per acquisition
  std::vector<double> gains_;
};

}  // namespace bo_gp
