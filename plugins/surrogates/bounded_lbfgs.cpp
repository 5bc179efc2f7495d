#include "bounded_lbfgs.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

namespace surrogates {
namespace {

constexpr std::size_t kMemory = 10;

using Mask = Eigen::ArrayXd;  // 1: free, 0: at an active bound

Mask free_coordinates(const Vector& at, const Vector& gradient, const Vector& lower, const Vector& upper) {
  Mask mask(at.size());
  for (Eigen::Index i = 0; i < at.size(); ++i)
    mask[i] = (at[i] <= lower[i] && gradient[i] >= 0) || (at[i] >= upper[i] && gradient[i] <= 0) ? 0 : 1;
  return mask;
}

struct Pair {
  Vector move;
  Vector change;  // of the gradient
};

// The two-loop recursion, restricted to the free coordinates.
Vector direction(const std::deque<Pair>& pairs, const Vector& gradient, const Mask& mask) {
  const auto dot = [&](const Vector& a, const Vector& b) { return (a.array() * b.array() * mask).sum(); };
  Vector q = gradient.array() * mask;
  std::vector<double> weight(pairs.size());
  double scale = 0;
  for (std::size_t i = pairs.size(); i-- > 0;) {
    const double curvature = dot(pairs[i].move, pairs[i].change);
    const double size = dot(pairs[i].change, pairs[i].change);
    weight[i] = std::numeric_limits<double>::quiet_NaN();
    if (!(curvature > 1e-12 * size)) continue;  // no curvature in this subspace
    weight[i] = dot(pairs[i].move, q) / curvature;
    q -= weight[i] * pairs[i].change;
    if (scale == 0) scale = curvature / size;
  }
  q *= scale > 0 ? scale : 1 / std::max(1.0, std::sqrt(dot(gradient, gradient)));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (std::isnan(weight[i])) continue;
    q += (weight[i] - dot(pairs[i].change, q) / dot(pairs[i].move, pairs[i].change)) * pairs[i].move;
  }
  return -(q.array() * mask).matrix();
}

struct State {
  Vector at;
  Vector gradient;
  double value = std::numeric_limits<double>::infinity();
};

// Searches the projected path for a point that satisfies the Armijo condition and, on coordinates away from the bounds,
// the weak Wolfe condition. Returns false if there is none.
bool search_line(const Objective& objective, const Vector& lower, const Vector& upper, const State& from,
                 const Vector& along, State& found) {
  double low = 0;
  double high = std::numeric_limits<double>::infinity();
  double stride = 1;
  bool any = false;
  for (int trial = 0; trial < 25; ++trial) {
    State next;
    next.at = (from.at + stride * along).cwiseMax(lower).cwiseMin(upper);
    next.gradient.resize(from.at.size());
    next.value = objective(next.at, next.gradient);
    const Vector move = next.at - from.at;
    const bool lower_enough = std::isfinite(next.value) && next.gradient.allFinite() &&
                              next.value <= from.value + 1e-4 * from.gradient.dot(move);
    if (!lower_enough) {
      if (any) return true;
      high = stride;
    } else {
      if (any && next.value >= found.value) return true;
      const Mask moving = (next.at.array() > lower.array() && next.at.array() < upper.array()).cast<double>();
      found = next;
      any = true;
      const double slope = (next.gradient.array() * along.array() * moving).sum();
      if (slope >= 0.9 * from.gradient.dot(along)) return true;
      low = stride;
    }
    stride = std::isinf(high) ? 2 * low : low + 0.5 * (high - low);
    if (!(stride > 0)) break;
  }
  return any;
}

}  // namespace

Minimum minimize(const Objective& objective, const Vector& start, const Vector& lower, const Vector& upper,
                 const SearchLimits& limits) {
  State here;
  here.at = start.cwiseMax(lower).cwiseMin(upper);
  here.gradient.resize(start.size());
  here.value = objective(here.at, here.gradient);
  std::deque<Pair> pairs;
  for (int iteration = 0; iteration < limits.iterations; ++iteration) {
    if (!std::isfinite(here.value) || !here.gradient.allFinite()) break;
    const Vector projected = (here.at - here.gradient).cwiseMax(lower).cwiseMin(upper) - here.at;
    if (projected.lpNorm<Eigen::Infinity>() <= limits.gradient) break;
    const Mask mask = free_coordinates(here.at, here.gradient, lower, upper);
    State next;
    bool found = false;
    Vector along = direction(pairs, here.gradient, mask);
    if (along.allFinite() && along.dot(here.gradient) < 0)
      found = search_line(objective, lower, upper, here, along, next);
    if (!found && !pairs.empty()) {  // discard the curvature pairs and try steepest descent
      pairs.clear();
      along = direction(pairs, here.gradient, mask);
      found = search_line(objective, lower, upper, here, along, next);
    }
    if (!found) break;
    Pair pair{next.at - here.at, next.gradient - here.gradient};
    if (pair.move.dot(pair.change) > std::numeric_limits<double>::epsilon() * pair.change.squaredNorm()) {
      pairs.push_back(std::move(pair));
      if (pairs.size() > kMemory) pairs.pop_front();
    }
    const double decrease = here.value - next.value;
    const double size = std::max({std::fabs(here.value), std::fabs(next.value), 1.0});
    here = std::move(next);
    if (decrease <= limits.decrease * size) break;
  }
  return {here.at, here.value};
}

}  // namespace surrogates
