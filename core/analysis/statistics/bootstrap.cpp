#include "statistics/bootstrap.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "statistics/distributions.h"
#include "statistics/sorted_sample.h"

namespace relign::statistics {
namespace {

constexpr std::size_t kPairedReplicateBytes = 64'000'000;

std::vector<SortedSample> sort_columns(const std::vector<std::vector<double>>& columns, std::size_t first,
                                       std::size_t count, std::size_t instances) {
  std::vector<SortedSample> samples;
  samples.reserve(count);
  for (std::size_t column = first; column < first + count; ++column) {
    if (columns[column].size() != instances) {
      throw Error(ErrorKind::internal, "column " + std::to_string(column) + " has " +
                                           std::to_string(columns[column].size()) + " values for " +
                                           std::to_string(instances) +
                                           " instances; give one value per instance, NaN if missing");
    }
    samples.emplace_back(columns[column]);
  }
  return samples;
}

// The outer loop is over resamples, so that draws that are not stored are made once for all columns.
std::vector<Replicates> replicate_quantile(const Resampling& resampling, const std::vector<SortedSample>& samples,
                                           double share) {
  std::vector<Replicates> result(samples.size(), Replicates(resampling.resamples()));
  ResampleBlock block(resampling);
  for (std::size_t first = 0; first < resampling.resamples(); first += ResampleBlock::kLanes) {
    block.load(first);
    for (std::size_t column = 0; column < samples.size(); ++column)
      samples[column].quantiles(block, share, &result[column][first]);
  }
  return result;
}

std::vector<Replicates> replicate(const Resampling& resampling, const std::vector<SortedSample>& samples,
                                  const OrderStatistic& statistic) {
  if (statistic.is_quantile()) return replicate_quantile(resampling, samples, statistic.share());
  const std::size_t instances = resampling.instances();
  std::vector<double> weights(instances + 1, 0.0);
  for (std::size_t count = 1; count <= instances; ++count) weights[count] = statistic.weight_below(count, instances);
  std::vector<Replicates> result(samples.size(), Replicates(resampling.resamples()));
  std::vector<std::uint8_t> scratch;
  for (std::size_t resample = 0; resample < resampling.resamples(); ++resample) {
    const std::uint8_t* counts = resampling.counts(resample, scratch);
    for (std::size_t column = 0; column < samples.size(); ++column) {
      const SortedSample& sample = samples[column];
      result[column][resample] =
          sample.takes_table(instances) ? sample.resampled(counts, weights) : sample.resampled(counts, statistic);
    }
  }
  return result;
}

template <class Operation>
Replicates combined(const Replicates& left, const Replicates& right, Operation&& operation) {
  if (left.size() != right.size()) {
    throw Error(ErrorKind::internal, "replicates have " + std::to_string(left.size()) + " and " +
                                         std::to_string(right.size()) +
                                         " resamples; take both from the same Resampling");
  }
  Replicates result(left.size());
  std::transform(left.begin(), left.end(), right.begin(), result.begin(), operation);
  return result;
}

double sorted_quantile(const std::vector<double>& sorted, double share) {
  const double place = static_cast<double>(sorted.size() - 1) * share;
  const auto below = static_cast<std::size_t>(place);
  const double fraction = place - static_cast<double>(below);
  // Interpolation from an infinite value would give NaN.
  if (fraction == 0 || std::isinf(sorted[below])) return sorted[below];
  return sorted[below] + fraction * (sorted[below + 1] - sorted[below]);
}

}  // namespace

std::vector<Replicates> resampled(const Resampling& resampling, const std::vector<std::vector<double>>& columns,
                                  const OrderStatistic& statistic) {
  return replicate(resampling, sort_columns(columns, 0, columns.size(), resampling.instances()), statistic);
}

Replicates difference(const Replicates& left, const Replicates& right) {
  return combined(left, right, [](double a, double b) { return a - b; });
}

Replicates ratio(const Replicates& left, const Replicates& right) {
  return combined(left, right, [](double a, double b) { return a / b; });
}

Interval expanded_percentile(const Replicates& replicates, std::size_t n, double confidence) {
  check_confidence(confidence);
  std::vector<double> sorted;
  sorted.reserve(replicates.size());
  std::copy_if(replicates.begin(), replicates.end(), std::back_inserter(sorted),
               [](double value) { return !std::isnan(value); });
  if (n < 2 || sorted.empty()) return {};
  std::sort(sorted.begin(), sorted.end());
  const auto values = static_cast<double>(n);
  const double t = student_t_quantile((1 - confidence) / 2, values - 1);
  const double tail = normal_lower(std::sqrt(values / (values - 1)) * t);
  return {sorted_quantile(sorted, tail), sorted_quantile(sorted, 1 - tail)};
}

std::vector<Band> bands(const Resampling& resampling, const std::vector<std::vector<double>>& columns,
                        const OrderStatistic& statistic, double confidence) {
  const std::size_t at_a_time =
      std::max<std::size_t>(1, kPairedReplicateBytes / sizeof(double) / resampling.resamples());
  std::vector<Band> result;
  for (std::size_t first = 0; first < columns.size(); first += at_a_time) {
    const std::size_t count = std::min(at_a_time, columns.size() - first);
    const std::vector<SortedSample> samples = sort_columns(columns, first, count, resampling.instances());
    const std::vector<Replicates> replicates = replicate(resampling, samples, statistic);
    for (std::size_t column = 0; column < count; ++column) {
      const std::size_t n = samples[column].size();
      result.push_back(
          {n, statistic.of(columns[first + column]), expanded_percentile(replicates[column], n, confidence)});
    }
  }
  return result;
}

}  // namespace relign::statistics
