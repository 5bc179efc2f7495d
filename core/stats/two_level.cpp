#include "stats/two_level.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "stats/sorted_sample.h"

namespace relign::stats {

std::vector<Replicates> resampled(const TwoLevelResampling& resampling, const std::vector<std::vector<double>>& columns,
                                  const OrderStatistic& statistic) {
  const std::size_t seeds = resampling.training_seeds().instances(), instances = resampling.instances().instances();
  std::vector<SortedSample> samples;
  for (const std::vector<double>& column : columns) {
    if (column.size() != seeds * instances) {
      throw Error(ErrorKind::internal, std::to_string(column.size()) + " values are not those of " +
                                           std::to_string(seeds) + " training seeds on " + std::to_string(instances) +
                                           " instances: NaN stands where there is none");
    }
    samples.emplace_back(column);
  }
  std::vector<double> weights(seeds * instances + 1, 0.0);
  for (std::size_t count = 1; count < weights.size(); ++count) {
    weights[count] = statistic.weight_below(count, seeds * instances);
  }
  std::vector<Replicates> result(columns.size(), Replicates(resampling.instances().resamples()));
  std::vector<std::uint8_t> seed_scratch, instance_scratch;
  std::vector<std::uint16_t> cells(seeds * instances);  // products of two bytes
  for (std::size_t resample = 0; resample < resampling.instances().resamples(); ++resample) {
    const std::uint8_t* seed_counts = resampling.training_seeds().counts(resample, seed_scratch);
    const std::uint8_t* instance_counts = resampling.instances().counts(resample, instance_scratch);
    for (std::size_t seed = 0; seed < seeds; ++seed) {
      for (std::size_t instance = 0; instance < instances; ++instance) {
        cells[seed * instances + instance] = static_cast<std::uint16_t>(seed_counts[seed] * instance_counts[instance]);
      }
    }
    for (std::size_t column = 0; column < columns.size(); ++column) {
      const SortedSample& sample = samples[column];
      result[column][resample] = sample.takes_table(cells.size()) ? sample.resampled(cells.data(), weights)
                                                                  : sample.resampled(cells.data(), statistic);
    }
  }
  return result;
}

std::vector<Band> bands(const TwoLevelResampling& resampling, const std::vector<std::vector<double>>& columns,
                        const OrderStatistic& statistic, double confidence) {
  const std::vector<Replicates> replicates = resampled(resampling, columns, statistic);
  const std::size_t smaller = std::min(resampling.training_seeds().instances(), resampling.instances().instances());
  std::vector<Band> result;
  for (std::size_t column = 0; column < columns.size(); ++column) {
    const auto missing =
        std::count_if(columns[column].begin(), columns[column].end(), [](double value) { return std::isnan(value); });
    result.push_back({columns[column].size() - static_cast<std::size_t>(missing), statistic.of(columns[column]),
                      expanded_percentile(replicates[column], smaller, confidence)});
  }
  return result;
}

}  // namespace relign::stats
