#include "search.hpp"

#include <algorithm>
#include <cmath>

#include "source_fit.hpp"
#include "surrogates/candidates.hpp"

namespace transfer_gp {
namespace {

// Standard deviation of the prior of the target's theta around the median of the sources', in natural logarithms.
constexpr double kSpread = 1;
// Hyperparameters are fitted at every step up to kFew values, at every tenth up to kMany, and then fixed.
constexpr Eigen::Index kFew = 60, kMany = 120;
constexpr Eigen::Index kFewCandidates = 1000;  // with kMany values or more
constexpr double kLargest = 1e4;               // standardised merits are clamped to this

Candidates first_candidates(SourceData& data, const SearchSetup& setup) {
  if (data.finished) return std::move(data.candidates);
  relign::Random random(0, 1);
  return make_candidates(SourceModel(setup.shape, setup.stacking),
                         surrogates::uniform_points(random, data.dimensions, setup.candidates));
}

// The median theta of the differences between sources, because the target adds one more difference.
Vector prior_centre(const SourceData& data) {
  const auto d = static_cast<Eigen::Index>(data.dimensions);
  if (data.sources.empty()) return first_theta(d);
  const std::size_t first = data.sources.size() > 1 ? 1 : 0;  // the first source is not a difference
  Vector centre(d + 2);
  for (Eigen::Index i = 0; i < d + 2; ++i) {
    std::vector<double> values;
    for (std::size_t number = first; number < data.sources.size(); ++number)
      values.push_back(data.sources[number].theta[i]);
    std::sort(values.begin(), values.end());
    centre[i] = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
  }
  return centre;
}

}  // namespace

Search::Search(SourceData data, const SearchSetup& setup, std::uint64_t seed)
    : setup_(setup),
      sources_(data.finished ? model_of(data, setup.shape, setup.stacking) : SourceModel(setup.shape, setup.stacking)),
      scale_(data.finished ? data.scale() : Scale()),
      candidates_(first_candidates(data, setup)),
      target_(sources_),
      centre_(prior_centre(data)),
      theta_(centre_),
      random_(seed, 2) {}

double Search::standardised(double merit) const { return std::clamp(scale_(merit), -kLargest, kLargest); }

void Search::tell(const Vector& unit, double merit) {
  merits_.push_back(merit);
  const Vector usable = surrogates::usable_merits(merits_);
  const auto n = static_cast<Eigen::Index>(merits_.size());
  // Without sources the scale is that of the target and changes with every value, as does the replacement of non-finite
  // merits.
  if (sources_.size() == 0) scale_.standard = surrogates::Standard(usable);
  if (n == kMany) keep_first(candidates_, kFewCandidates);
  target_.add(unit, 0, candidates_);
  target_.set_values(usable.unaryExpr([this](double value) { return standardised(value); }));
  const bool often = n <= kFew, seldom = n <= kMany && n % 10 == 0;
  if (often || seldom)
    refit();
  else
    target_.extend();
  predictions_ = target_.predict(candidates_);
}

void Search::refit() {
  const auto d = candidates_.points.rows();
  const surrogates::Likelihood likelihood(setup_.shape, target_.points(), target_.residual(),
                                          target_.fixed_covariance());
  const surrogates::ThetaPrior prior = [this](const Vector& theta, Vector& gradient) {
    const Vector away = (theta - centre_) / kSpread;
    gradient -= away / kSpread;
    return -0.5 * away.squaredNorm();
  };
  theta_ = surrogates::fit_theta(likelihood, theta_bounds(d), {centre_, theta_}, prior);
  if (!theta_.allFinite()) theta_ = centre_;
  target_.set_theta(theta_);
}

template <class Cost>
Vector Search::zoom(Vector at, double cost, int rounds, Eigen::Index count, const Cost& costs) {
  double radius = 0.08;  // about the spacing of candidates along an axis in six dimensions
  for (int round = 0; round < rounds; ++round, radius *= 0.4) {
    Matrix around = at.replicate(1, count);
    for (double& coordinate : around.reshaped())
      coordinate = std::clamp(coordinate + radius * random_.normal(), 0.0, 1.0);
    const Vector there = costs(around);
    const Eigen::Index lowest = surrogates::lowest(there, 1).front();
    if (!(there[lowest] < cost)) continue;
    cost = there[lowest];
    at = around.col(lowest);
  }
  return at;
}

Vector Search::ask() {
  const auto cost_of = [this](const Predictions& at) { return Vector(at.mean - setup_.kappa * at.deviation); };
  const Vector costs = cost_of(predictions_);
  const Eigen::Index lowest = surrogates::lowest(costs, 1).front();
  return zoom(candidates_.points.col(lowest), costs[lowest], 2, 24,
              [&](const Matrix& around) { return cost_of(target_.predict(around)); });
}

Vector Search::best() {
  const Eigen::Index lowest = surrogates::lowest(predictions_.mean, 1).front();
  Vector at = candidates_.points.col(lowest);
  double mean = predictions_.mean[lowest];
  // Candidates are sparse; a measured pose may be better than all of them.
  const Vector measured = target_.mean(target_.points());
  const Eigen::Index known = surrogates::lowest(measured, 1).front();
  if (measured[known] < mean) {
    at = target_.points().col(known);
    mean = measured[known];
  }
  return zoom(at, mean, 4, 24, [this](const Matrix& around) { return target_.mean(around); });
}

}  // namespace transfer_gp
