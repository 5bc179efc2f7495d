#include "statistics/ranks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "base/error.h"
#include "statistics/distributions.h"

namespace relign::statistics {
namespace {

void check_lengths(const std::vector<std::vector<double>>& columns) {
  for (const std::vector<double>& column : columns) {
    if (column.size() == columns.front().size()) continue;
    throw Error(ErrorKind::internal, "algorithms have " + std::to_string(columns.front().size()) + " and " +
                                         std::to_string(column.size()) +
                                         " values; give one value per instance, NaN if missing");
  }
}

// Sums over instances: the ranks of each column, and the squared distances of all ranks from the mean rank.
struct RankSums {
  std::vector<double> ranks;
  double squares = 0;
};

void add_instance(const std::vector<double>& values, RankSums& sums) {
  const std::vector<double> ranks = midranks(values);
  const double middle = (static_cast<double>(values.size()) + 1) / 2;
  for (std::size_t column = 0; column < ranks.size(); ++column) {
    sums.ranks[column] += ranks[column];
    sums.squares += (ranks[column] - middle) * (ranks[column] - middle);
  }
}

}  // namespace

Friedman friedman(const std::vector<std::vector<double>>& columns) {
  Friedman result;
  if (columns.empty()) return result;
  check_lengths(columns);
  const std::size_t algorithms = columns.size();
  RankSums sums{std::vector<double>(algorithms, 0.0), 0};
  std::vector<double> values(algorithms);
  for (std::size_t instance = 0; instance < columns.front().size(); ++instance) {
    for (std::size_t column = 0; column < algorithms; ++column) values[column] = columns[column][instance];
    if (std::any_of(values.begin(), values.end(), [](double value) { return std::isnan(value); })) {
      ++result.left_out;
      continue;
    }
    add_instance(values, sums);
    ++result.instances;
  }
  const auto n = static_cast<double>(result.instances);
  const auto k = static_cast<double>(algorithms);
  result.mean_ranks.assign(algorithms, kMissing);
  if (result.instances == 0 || algorithms < 2) return result;
  double between = 0;
  for (std::size_t column = 0; column < algorithms; ++column) {
    result.mean_ranks[column] = sums.ranks[column] / n;
    between += std::pow(sums.ranks[column] - n * (k + 1) / 2, 2);
  }
  // Conover's form: the denominator is the variance of the actual ranks, which accounts for ties.
  result.chi_squared = sums.squares == 0 ? 0 : (k - 1) * between / sums.squares;
  result.p = chi_squared_upper(result.chi_squared, k - 1);
  if (result.instances < 2) return result;
  const double left = n * (k - 1) - result.chi_squared;
  const bool all_alike = left <= 1e-9 * n * (k - 1);
  result.f = all_alike ? std::numeric_limits<double>::infinity() : (n - 1) * result.chi_squared / left;
  result.f_p = fisher_f_upper(result.f, k - 1, (k - 1) * (n - 1));
  return result;
}

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<std::size_t> order;
  for (std::size_t test = 0; test < p.size(); ++test) {
    if (!std::isnan(p[test])) order.push_back(test);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> corrected = p;
  double largest = 0;
  for (std::size_t place = 0; place < order.size(); ++place) {
    const auto left = static_cast<double>(order.size() - place);
    largest = std::max(largest, std::min(1.0, left * p[order[place]]));
    corrected[order[place]] = largest;
  }
  return corrected;
}

}  // namespace relign::statistics
