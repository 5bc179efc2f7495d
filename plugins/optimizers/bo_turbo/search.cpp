#include "search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scrambled_sobol.hpp"
#include "surrogates/candidates.hpp"
#include "surrogates/gaussian_process.hpp"

namespace bo_turbo {
namespace {

constexpr std::size_t kPointsBetweenFits = 10;

double median(Vector values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

}  // namespace

Search::Search(std::size_t axes, const Setup& setup, std::uint64_t seed)
    : axes_(axes),
      setup_(setup),
      design_numbers_(seed, 0),
      candidate_numbers_(seed, 1),
      draws_(seed, 2),
      region_(axes) {
  if (setup_.initial_points == 0) setup_.initial_points = 2 * axes;
  if (setup_.candidates == 0) setup_.candidates = std::min<std::size_t>(100 * axes, 5000);
  restart();
}

void Search::restart() {
  region_ = TrustRegion(axes_);
  points_.clear();
  merits_.clear();
  fitted_with_ = 0;
  const Matrix design = surrogates::latin_hypercube(design_numbers_, axes_, setup_.initial_points);
  for (const auto& point : design.colwise()) design_.emplace_back(point);
}

Vector Search::ask() {
  if (region_.collapsed()) {
    restart();
    ++restarts_;
  }
  asked_in_region_ = design_.empty();
  if (!asked_in_region_) {
    const Vector point = design_.back();
    design_.pop_back();
    return point;
  }
  Matrix points(static_cast<Eigen::Index>(axes_), static_cast<Eigen::Index>(points_.size()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) points.col(i) = points_[static_cast<std::size_t>(i)];
  const Vector merits = surrogates::usable_merits(merits_);
  surrogates::Standard standard(merits);
  standard.mean = median(merits);
  fit(points, standard.apply(merits));
  standard.mean += standard.scale * fitted_.mean;
  const surrogates::GaussianProcess model(surrogates::Shape::matern52, points, merits, fitted_.theta, standard);

  Eigen::Index best = 0;
  merits.minCoeff(&best);
  const Vector centre = points.col(best).cwiseMax(0).cwiseMin(1);  // the start may be outside the box
  const auto axes = static_cast<Eigen::Index>(axes_);
  const Sides sides = region_.sides(centre, fitted_.theta.segment(1, axes).array().exp());
  const Matrix candidates = masked_candidates(candidate_numbers_, centre, sides, setup_.candidates,
                                              std::min(20.0 / static_cast<double>(axes_), 1.0));
  Vector normals(candidates.cols());
  for (double& normal : normals) normal = draws_.normal();
  Eigen::Index lowest = 0;
  model.draw(candidates, normals).minCoeff(&lowest);
  return candidates.col(lowest);
}

void Search::tell(const Vector& point, double merit) {
  if (asked_in_region_) {
    double best = std::numeric_limits<double>::infinity();
    for (const double old : merits_)
      if (surrogates::is_usable(old)) best = std::min(best, old);
    const bool first = std::isinf(best);  // the first usable merit of the region
    region_.record(surrogates::is_usable(merit) && (first || is_success(merit, best)));
    asked_in_region_ = false;
  }
  points_.push_back(point);
  merits_.push_back(merit);
}

void Search::fit(const Matrix& points, const Vector& standardised) {
  const bool thrifty = points_.size() > setup_.exact_points;
  if (thrifty && fitted_with_ > 0 && points_.size() < fitted_with_ + kPointsBetweenFits) return;
  const surrogates::Likelihood likelihood(surrogates::Shape::matern52, points, standardised);
  fitted_ = adam_fit(likelihood, points.rows(), points.cols());
  fitted_with_ = points_.size();
}

}  // namespace bo_turbo
