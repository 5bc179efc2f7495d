#include "statistics/pooled_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/error.h"
#include "statistics/band.h"

namespace relign::statistics {
namespace {

// Rounding of weights, which are sums of reciprocals.
constexpr double kSameWeight = 1e-9;
// Blocks are summed without branches; only those that contain a quartile, the median or a place of the profile are
// processed value by value.
constexpr std::size_t kBlock = 64;

}  // namespace

StratifiedMean::StratifiedMean(const StratifiedValues& values, const std::vector<std::size_t>& instances)
    : instances_(instances), trainings_(values.trainings) {
  if (values.strata.size() != instances.size() || instances.size() > std::numeric_limits<std::uint16_t>::max())
    throw Error(ErrorKind::internal, std::to_string(values.strata.size()) + " strata of values for " +
                                         std::to_string(instances.size()) + " strata of instances");
  for (std::size_t stratum = 0; stratum < instances.size(); ++stratum) {
    const std::vector<double>& here = values.strata[stratum];
    if (here.size() != instances[stratum] * trainings_)
      throw Error(ErrorKind::internal, "stratum " + std::to_string(stratum) + " has " + std::to_string(here.size()) +
                                           " values for " + std::to_string(trainings_) + " trainings on " +
                                           std::to_string(instances[stratum]) + " instances; give NaN if missing");
    first_cell_.push_back(values_.size());
    std::size_t known = 0;
    for (const double value : here) {
      const bool there = !std::isnan(value);
      values_.push_back(there ? value : 0);
      known_.push_back(there ? 1 : 0);
      known += there ? 1 : 0;
    }
    complete_.push_back(known == here.size());
    size_ += known;
    const std::size_t of_one = known / std::max<std::size_t>(1, trainings_);
    fewest_ = stratum == 0 ? of_one : std::min(fewest_, of_one);
  }
}

void StratifiedMean::drawn(const StratifiedResampling::Draw& draw, const std::uint8_t* trainings,
                           std::vector<std::size_t>& result) const {
  result.assign(instances_.size(), 0);
  for (std::size_t stratum = 0; stratum < instances_.size(); ++stratum) {
    const std::size_t count = instances_[stratum];
    const std::uint8_t* counts = draw.strata[stratum];
    if (complete_[stratum]) {  // all resamples have the same size
      result[stratum] = count * trainings_;
      continue;
    }
    for (std::size_t training = 0; training < trainings_; ++training) {
      const std::uint8_t* known = &known_[first_cell_[stratum] + training * count];
      std::size_t here = 0;
      for (std::size_t i = 0; i < count; ++i) here += std::size_t{counts[i]} * known[i];
      result[stratum] += trainings[training] * here;
    }
  }
}

double StratifiedMean::resampled(const StratifiedResampling::Draw& draw, const std::uint8_t* trainings) const {
  std::vector<std::size_t> drawn_here;
  drawn(draw, trainings, drawn_here);
  double mean = 0;
  std::size_t strata = 0;
  for (std::size_t stratum = 0; stratum < instances_.size(); ++stratum) {
    if (drawn_here[stratum] == 0) continue;
    ++strata;
    const std::size_t count = instances_[stratum];
    const std::uint8_t* counts = draw.strata[stratum];
    double sum = 0;
    for (std::size_t training = 0; training < trainings_; ++training) {
      const double* values = &values_[first_cell_[stratum] + training * count];
      double lanes[4] = {0, 0, 0, 0};  // independent sums vectorise; the compiler may not reorder one
      std::size_t i = 0;
      for (; i + 4 <= count; i += 4)
        for (std::size_t lane = 0; lane < 4; ++lane) lanes[lane] += counts[i + lane] * values[i + lane];
      for (; i < count; ++i) lanes[0] += counts[i] * values[i];
      sum += trainings[training] * ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3]));
    }
    mean += sum / static_cast<double>(drawn_here[stratum]);
  }
  return strata == 0 ? kMissing : mean / static_cast<double>(strata);
}

PooledSample::PooledSample(const StratifiedValues& values, const std::vector<std::size_t>& instances,
                           const std::vector<double>& places)
    : mean_(values, instances), instances_(instances), trainings_(values.trainings) {
  std::vector<double> all;
  std::vector<std::uint16_t> stratum_of;
  for (std::size_t stratum = 0; stratum < values.strata.size(); ++stratum) {
    all.insert(all.end(), values.strata[stratum].begin(), values.strata[stratum].end());
    stratum_of.resize(all.size(), static_cast<std::uint16_t>(stratum));
  }
  for (std::size_t cell = 0; cell < all.size(); ++cell)
    if (!std::isnan(all[cell])) cells_.push_back(static_cast<std::uint32_t>(cell));
  std::stable_sort(cells_.begin(), cells_.end(), [&](std::uint32_t a, std::uint32_t b) { return all[a] < all[b]; });
  for (const std::uint32_t cell : cells_) {
    values_.push_back(all[cell]);
    stratum_.push_back(stratum_of[cell]);
  }
  for (const double place : places)
    below_.push_back(
        static_cast<std::size_t>(std::upper_bound(values_.begin(), values_.end(), place) - values_.begin()));
}

// `unit(stratum)`: the weight of one draw. The interquartile mean is OrderStatistic::iqm() with weights; the median is
// the value at which the cumulative weight passes 1/2, or the mean of two values if it equals 1/2 between them.
template <class Unit>
void PooledSample::walk(const Unit& unit, Scratch& scratch, PooledStatistics& result) const {
  const std::size_t blocks = (values_.size() + kBlock - 1) / kBlock;
  const auto weight_of = [&](std::size_t place) { return scratch.counts[cells_[place]] * unit(stratum_[place]); };
  scratch.weights.resize(blocks);
  scratch.sums.resize(blocks);
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::size_t stop = std::min(values_.size(), (block + 1) * kBlock);
    double weight = 0, sum = 0;
    for (std::size_t place = block * kBlock; place < stop; ++place) {
      const double here = weight_of(place);
      weight += here;
      sum += here * values_[place];
    }
    scratch.weights[block] = weight;
    scratch.sums[block] = sum;
  }
  result.iqm = 0;
  result.median = kMissing;
  result.profile.assign(below_.size(), 0);
  double weight = 0, lower = kMissing;
  std::size_t next = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::size_t first = block * kBlock, stop = std::min(values_.size(), first + kBlock);
    const double after = weight + scratch.weights[block];
    const bool outside = after <= 0.25 - kSameWeight || weight >= 0.75 + kSameWeight;
    const bool inside = weight >= 0.25 + kSameWeight && after <= 0.75 - kSameWeight;
    const bool decides = !std::isnan(lower) || (weight < 0.5 && after >= 0.5 - kSameWeight);
    const bool profiled = next < below_.size() && below_[next] < stop;
    if ((outside || inside) && !decides && !profiled) {
      if (inside) result.iqm += 2 * scratch.sums[block];
      weight = after;
      continue;
    }
    for (std::size_t place = first; place < stop; ++place) {
      for (; next < below_.size() && below_[next] == place; ++next) result.profile[next] = weight;
      const double added = weight_of(place);
      if (added == 0) continue;
      const double value = values_[place], before = weight;
      weight += added;
      result.iqm += 2 * (std::clamp(weight, 0.25, 0.75) - std::clamp(before, 0.25, 0.75)) * value;
      if (!std::isnan(lower)) {
        result.median = (lower + value) / 2;
        lower = kMissing;
      }
      if (before < 0.5 - kSameWeight && weight >= 0.5 - kSameWeight) {
        result.median = value;
        if (weight <= 0.5 + kSameWeight) lower = value;
      }
    }
  }
  for (; next < below_.size(); ++next) result.profile[next] = weight;
}

void PooledSample::resampled(const StratifiedResampling::Draw& draw, const std::uint8_t* trainings, Scratch& scratch,
                             PooledStatistics& result) const {
  std::size_t cells = 0;
  for (const std::size_t count : instances_) cells += count * trainings_;
  scratch.counts.resize(cells);
  std::uint16_t* at = scratch.counts.data();
  for (std::size_t stratum = 0; stratum < instances_.size(); ++stratum)
    for (std::size_t training = 0; training < trainings_; ++training, at += instances_[stratum])
      for (std::size_t instance = 0; instance < instances_[stratum]; ++instance)
        at[instance] = static_cast<std::uint16_t>(draw.strata[stratum][instance] * trainings[training]);
  mean_.drawn(draw, trainings, scratch.drawn);
  const auto strata = static_cast<double>(
      std::count_if(scratch.drawn.begin(), scratch.drawn.end(), [](std::size_t count) { return count > 0; }));
  if (strata == 0) {
    result = {kMissing, kMissing, std::vector<double>(below_.size(), kMissing)};
    return;
  }
  scratch.unit.clear();
  for (const std::size_t count : scratch.drawn)
    scratch.unit.push_back(count == 0 ? 0 : 1 / (strata * static_cast<double>(count)));
  const double first = scratch.unit.front();
  if (std::all_of(scratch.unit.begin(), scratch.unit.end(), [first](double unit) { return unit == first; }))
    walk([first](std::uint16_t) { return first; }, scratch, result);
  else
    walk([&scratch](std::uint16_t stratum) { return scratch.unit[stratum]; }, scratch, result);
}

EveryOnce::EveryOnce(const std::vector<std::size_t>& instances, std::size_t trainings) {
  std::size_t most = trainings;
  for (const std::size_t count : instances) most = std::max(most, count);
  ones_.assign(most, 1);
  draw.strata.assign(instances.size(), ones_.data());
}

}  // namespace relign::statistics
