// Bayesian optimisation in the unit cube with an ask-and-tell interface.
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

// Defaults as in scikit-optimize.
struct Recipe {
  std::vector<surrogates::Acquisition> portfolio = {surrogates::Acquisition::expected_improvement,
                                                    surrogates::Acquisition::lower_bound,
                                                    surrogates::Acquisition::probability};  // more than one: gp_hedge
  surrogates::Shape shape = surrogates::Shape::matern52;
  std::size_t initial_points = 10;  // 0: dimensions + 1
  bool latin = false;               // initial points: a Latin hypercube; false: uniform
  double xi = 0.01;
  bool xi_relative = false;      // xi in standard deviations of the merits
  bool model_incumbent = false;  // incumbent: the lowest posterior mean at a measured pose; false: the lowest merit
  bool priors = false;           // on the hyperparameters
  bool warp = false;
  double kappa = 1.96;
  double caution = 0;  // optimum: the minimum of mean + caution * deviation
  double noise = 0;    // share of the merits' variance; 0: fitted
  std::size_t candidates = 10000;
  std::size_t near_candidates = 0;  // additional candidates around the model's optimum
  std::size_t restarts = 2;
  std::size_t exact_points = 80;  // with more points the approximations described in README.md
};

class Proposer {
 public:
  Proposer(std::size_t dimensions, const Recipe& recipe, std::uint64_t seed);

  // A non-finite value counts as the worst one so far.
  void tell(const Vector& point, double value);
  Vector ask();
  // The minimum of the posterior mean (plus caution); empty until the initial points are measured.
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
  relign::Random choices_;
  surrogates::ThetaBounds bounds_;
  surrogates::ThetaPrior prior_;
  std::vector<Vector> starts_;  // for the optimisation of theta, the same at every fit
  std::vector<Vector> design_;  // initial points not yet measured, taken from the end
  std::vector<Vector> points_;
  std::vector<double> values_;
  Vector theta_;
  std::size_t fitted_with_ = 0;  // number of points at the last fit of theta
  std::optional<surrogates::GaussianProcess> model_;
  std::optional<Vector> optimum_;
  double incumbent_ = 0;
  std::vector<Vector> proposals_;  // one per acquisition
  std::vector<double> gains_;
};

}  // namespace bo_gp
