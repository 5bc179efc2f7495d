#include "proposer.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "hyper_priors.hpp"
#include "surrogates/candidates.hpp"
#include "surrogates/warp.hpp"

namespace bo_gp {
namespace {

using surrogates::Acquisition;
using surrogates::GaussianProcess;

constexpr std::size_t kPolished = 5;
constexpr int kPolishIterations = 20;

// With more than exact_points.
constexpr std::size_t kThriftyCandidates = 1000;
constexpr std::size_t kPointsBetweenFits = 10;
constexpr std::size_t kMaxPoints = 120;  // at least

}  // namespace

Proposer::Proposer(std::size_t dimensions, const Recipe& recipe, std::uint64_t seed)
    : dimensions_(dimensions), recipe_(recipe), initial_(seed, 0), candidates_(seed, 1), choices_(seed, 2) {
  const auto axes = static_cast<Eigen::Index>(dimensions);
  if (recipe_.initial_points == 0) recipe_.initial_points = dimensions + 1;
  if (recipe_.latin) {
    const Matrix design = surrogates::latin_hypercube(initial_, dimensions, recipe_.initial_points);
    for (const auto& point : design.colwise()) design_.emplace_back(point);
  }
  if (recipe_.priors) {
    HyperPriors priors = published_priors(axes, recipe_.noise);
    bounds_ = std::move(priors.bounds);
    prior_ = std::move(priors.prior);
    starts_.push_back(std::move(priors.start));
  } else {
    bounds_ = surrogates::skopt_bounds(axes, recipe_.noise);
  }
  starts_.push_back(Vector::Zero(axes + 2));  // all hyperparameters 1
  relign::Random random(seed, 3);
  for (std::size_t restart = 0; restart < recipe_.restarts; ++restart) {
    Vector start(axes + 2);
    for (Eigen::Index i = 0; i < start.size(); ++i) start[i] = random.uniform(bounds_.lower[i], bounds_.upper[i]);
    starts_.push_back(start);
  }
  gains_.assign(recipe_.portfolio.size(), 0);
}

void Proposer::tell(const Vector& point, double value) {
  points_.push_back(point);
  values_.push_back(value);
  if (points_.size() < recipe_.initial_points) return;
  fit();
  for (std::size_t i = 0; i < proposals_.size(); ++i) gains_[i] -= model_->predict(proposals_[i]).mean;
  proposals_.clear();
  find_optimum();
}

Vector Proposer::ask() {
  if (!model_) return initial_point();
  const double xi = recipe_.xi * (recipe_.xi_relative ? model_->standard().scale : 1);
  const surrogates::AcquisitionSetup setup{incumbent_, xi, recipe_.kappa};
  const Matrix candidates = draw_candidates();
  Vector mean;
  Vector deviation;
  model_->predict(candidates, mean, deviation);
  for (const Acquisition kind : recipe_.portfolio) {
    const auto cost = [&](const Vector& at, Vector& gradient) {
      return surrogates::acquisition_cost(kind, setup, model_->predict(at), gradient);
    };
    const Vector costs = surrogates::acquisition_costs(kind, setup, mean, deviation);
    proposals_.push_back(surrogates::polish(cost, candidates, costs, kPolished, kPolishIterations).at);
  }
  const Vector chosen = proposals_[choose()];
  if (!visited(chosen)) return chosen;
  for (const Vector& other : proposals_)
    if (!visited(other)) return other;
  return surrogates::uniform_point(initial_, dimensions_);
}

void Proposer::find_optimum() {
  Vector mean;
  Vector deviation;
  const Matrix measured = model_->points().cwiseMax(0).cwiseMin(1);  // the start may be outside the box
  model_->predict(measured, mean, deviation);
  const surrogates::Standard standard = model_->standard();
  // An upper confidence bound, as a lower bound with negative kappa; standardised to suit the tolerances of the search.
  const surrogates::AcquisitionSetup setup{0, 0, -recipe_.caution};
  const auto cost = [&](const Vector& at, Vector& gradient) {
    const double value = surrogates::acquisition_cost(Acquisition::lower_bound, setup, model_->predict(at), gradient);
    gradient /= standard.scale;
    return (value - standard.mean) / standard.scale;
  };
  const Vector costs = surrogates::acquisition_costs(Acquisition::lower_bound, setup, mean, deviation);
  optimum_ = surrogates::polish(cost, measured, costs, kPolished, kPolishIterations).at;
}

Proposer::Data Proposer::data() const {
  const Vector merits = surrogates::usable_merits(values_);
  std::vector<std::size_t> kept(points_.size());
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  const auto merit = [&](std::size_t i) { return merits[static_cast<Eigen::Index>(i)]; };
  const std::size_t most = std::max(kMaxPoints, recipe_.exact_points);
  if (kept.size() > most) {  // half of them the best, half the newest
    const auto old = kept.end() - static_cast<std::ptrdiff_t>(most / 2);
    std::stable_sort(kept.begin(), old, [&](std::size_t a, std::size_t b) { return merit(a) < merit(b); });
    kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(most - most / 2), old);
  }
  const auto count = static_cast<Eigen::Index>(kept.size());
  Data made{Matrix(static_cast<Eigen::Index>(dimensions_), count), Vector(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    made.points.col(i) = points_[kept[static_cast<std::size_t>(i)]];
    made.values[i] = merit(kept[static_cast<std::size_t>(i)]);
  }
  if (recipe_.warp) made.values = surrogates::warped(made.values);
  return made;
}

void Proposer::fit() {
  const Data measured = data();
  const surrogates::Standard standard(measured.values);
  if (!thrifty() || theta_.size() == 0 || points_.size() >= fitted_with_ + kPointsBetweenFits) {
    std::vector<Vector> starts = thrifty() && theta_.size() && !recipe_.priors ? std::vector<Vector>{} : starts_;
    // scikit-optimize does not start from the last theta. With few random starts that occasionally loses a good model
    // and its recommendation.
    if (theta_.size() && (thrifty() || recipe_.priors)) starts.push_back(theta_);
    const surrogates::Likelihood likelihood(recipe_.shape, measured.points, standard.apply(measured.values));
    theta_ = surrogates::fit_theta(likelihood, bounds_, starts, prior_);
    fitted_with_ = points_.size();
  }
  model_.emplace(recipe_.shape, measured.points, measured.values, theta_, standard);
  incumbent_ = measured.values.minCoeff();
  if (recipe_.model_incumbent) {
    Vector mean;
    Vector deviation;
    model_->predict(measured.points, mean, deviation);
    incumbent_ = mean.minCoeff();
  }
}

Vector Proposer::initial_point() {
  if (design_.empty()) return surrogates::uniform_point(initial_, dimensions_);
  const Vector point = design_.back();
  design_.pop_back();
  return point;
}

Matrix Proposer::draw_candidates() {
  const std::size_t count = thrifty() ? std::min(kThriftyCandidates, recipe_.candidates) : recipe_.candidates;
  Matrix drawn = surrogates::uniform_points(candidates_, dimensions_, count);
  if (recipe_.near_candidates == 0) return drawn;
  const auto near = static_cast<Eigen::Index>(recipe_.near_candidates);
  drawn.conservativeResize(Eigen::NoChange, drawn.cols() + near);
  // Around the optimum, at log-uniform distances of 0.005 to 0.5 of the cube.
  for (Eigen::Index i = drawn.cols() - near; i < drawn.cols(); ++i) {
    const double stride = 0.5 * std::exp(candidates_.uniform(-4.6, 0));
    for (Eigen::Index axis = 0; axis < drawn.rows(); ++axis)
      drawn(axis, i) = std::clamp((*optimum_)[axis] + stride * candidates_.normal(), 0.0, 1.0);
  }
  return drawn;
}

// Selects a proposal with probability proportional to exp(gain).
std::size_t Proposer::choose() {
  if (gains_.size() == 1) return 0;
  const double highest = *std::max_element(gains_.begin(), gains_.end());
  std::vector<double> weights;
  for (const double gain : gains_) weights.push_back(std::exp(gain - highest));
  double left = choices_.uniform() * std::accumulate(weights.begin(), weights.end(), 0.0);
  for (std::size_t i = 0; i + 1 < weights.size(); ++i) {
    if (left < weights[i]) return i;
    left -= weights[i];
  }
  return weights.size() - 1;
}

bool Proposer::visited(const Vector& point) const {
  return std::any_of(points_.begin(), points_.end(),
                     [&](const Vector& old) { return (old - point).lpNorm<Eigen::Infinity>() < 1e-8; });
}

}  // namespace bo_gp
