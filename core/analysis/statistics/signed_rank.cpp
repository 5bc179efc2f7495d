#include "statistics/signed_rank.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "statistics/distributions.h"

namespace relign::statistics {
namespace {

// Share of all 2^n signs whose positive ranks sum to at most `sum`. Ranks are doubled, so that tied ranks are integers.
double exact_lower(const std::vector<double>& ranks, double sum) {
  std::vector<double> shares = {1};  // of each doubled sum
  for (const double rank : ranks) {
    const auto twofold = static_cast<std::size_t>(2 * rank);
    std::vector<double> next(shares.size() + twofold, 0.0);
    for (std::size_t total = 0; total < shares.size(); ++total) {
      next[total] += shares[total] / 2;
      next[total + twofold] += shares[total] / 2;
    }
    shares = std::move(next);
  }
  const auto end = static_cast<std::ptrdiff_t>(2 * sum) + 1;
  return std::accumulate(shares.begin(), shares.begin() + end, 0.0);
}

// Tie correction: the sum of t^3 - t over groups of t equal ranks.
double tie_sum(std::vector<double> ranks) {
  std::sort(ranks.begin(), ranks.end());
  double sum = 0;
  for (auto first = ranks.begin(); first != ranks.end();) {
    const auto next = std::upper_bound(first, ranks.end(), *first);
    const auto tied = static_cast<double>(next - first);
    sum += tied * tied * tied - tied;
    first = next;
  }
  return sum;
}

}  // namespace

std::vector<double> midranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t next = first;
    while (next < order.size() && values[order[next]] == values[order[first]]) ++next;
    for (std::size_t place = first; place < next; ++place)
      ranks[order[place]] = static_cast<double>(first + next + 1) / 2;
    first = next;
  }
  return ranks;
}

SignedRank signed_rank(const std::vector<double>& differences) {
  SignedRank result;
  std::vector<double> sizes;
  std::vector<bool> positive;
  for (const double difference : differences) {
    if (std::isnan(difference)) continue;
    if (difference == 0) {
      ++result.zeros;
      continue;
    }
    sizes.push_back(std::abs(difference));
    positive.push_back(difference > 0);
  }
  result.n = sizes.size();
  if (result.n == 0) return result;
  const std::vector<double> ranks = midranks(sizes);
  for (std::size_t place = 0; place < ranks.size(); ++place) {
    (positive[place] ? result.above : result.below) += ranks[place];
  }
  const double smaller = std::min(result.above, result.below);
  result.exact = result.n <= kExactSignedRank;
  if (result.exact) {
    result.p = std::min(1.0, 2 * exact_lower(ranks, smaller));  // symmetric distribution
    return result;
  }
  const auto n = static_cast<double>(result.n);
  const double variance = n * (n + 1) * (2 * n + 1) / 24 - tie_sum(ranks) / 48;
  result.p = std::min(1.0, 2 * normal_lower((smaller - n * (n + 1) / 4) / std::sqrt(variance)));
  return result;
}

}  // namespace relign::statistics
