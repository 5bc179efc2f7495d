#include "statistics/aggregate.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "statistics/bootstrap.h"
#include "statistics/pooled_sample.h"

namespace relign::statistics {
namespace {

// Limits of memory; methods beyond them are processed in parts, which draw their resamples again.
constexpr std::size_t kReplicateBytes = 64'000'000, kSampleBytes = 16'000'000;
constexpr std::size_t kBytesPerValue = 32;  // in both samples of a method

// Probability of improvement of the first method over the second.
class PairedWins {
 public:
  PairedWins(const StratifiedValues& first, const StratifiedValues& second, const std::vector<std::size_t>& instances)
      : instances_(instances), firsts_(first.trainings), seconds_(second.trainings) {
    for (std::size_t stratum = 0; stratum < instances.size(); ++stratum) {
      const std::size_t count = instances[stratum];
      if (first.strata.at(stratum).size() != count * firsts_ || second.strata.at(stratum).size() != count * seconds_)
        throw Error(ErrorKind::internal,
                    "compared methods have different instances; give both the same strata, NaN for missing values");
      std::size_t fewest = 0;
      for (std::size_t a = 0; a < firsts_; ++a)
        for (std::size_t b = 0; b < seconds_; ++b) {
          std::size_t known = 0;
          for (std::size_t i = 0; i < count; ++i) {
            const double left = first.strata[stratum][a * count + i], right = second.strata[stratum][b * count + i];
            const bool both = !std::isnan(left) && !std::isnan(right);
            known += both ? 1 : 0;
            known_.push_back(both ? 1 : 0);
            twice_won_.push_back(!both ? 0 : left < right ? 2 : left == right ? 1 : 0);
          }
          fewest = a == 0 && b == 0 ? known : std::min(fewest, known);
          n_ += known;
        }
      complete_ = complete_ && fewest == count;
      fewest_ = stratum == 0 ? fewest : std::min(fewest_, fewest);
    }
  }

  std::size_t n() const { return n_; }
  std::size_t fewest_instances() const { return fewest_; }
  std::size_t trainings() const {
    return firsts_ == 1 || seconds_ == 1 ? std::max(firsts_, seconds_) : std::min(firsts_, seconds_);
  }

  // NaN if no value was drawn.
  double share(const StratifiedResampling::Draw& draw, const std::uint8_t* firsts, const std::uint8_t* seconds) const {
    double sum = 0;
    std::size_t strata = 0, at = 0;
    for (std::size_t stratum = 0; stratum < instances_.size(); ++stratum) {
      const std::uint8_t* counts = draw.strata[stratum];
      std::uint64_t won = 0, met = 0;
      for (std::size_t a = 0; a < firsts_; ++a)
        for (std::size_t b = 0; b < seconds_; ++b, at += instances_[stratum]) {
          const std::uint64_t weight = std::uint64_t{firsts[a]} * seconds[b];
          if (weight == 0) continue;
          std::uint32_t won_here = 0, met_here = 0;
          const std::size_t count = instances_[stratum];
          for (std::size_t i = 0; i < count; ++i) won_here += std::uint32_t{counts[i]} * twice_won_[at + i];
          if (complete_)
            met_here = static_cast<std::uint32_t>(count);
          else
            for (std::size_t i = 0; i < count; ++i) met_here += std::uint32_t{counts[i]} * known_[at + i];
          won += weight * won_here;
          met += weight * met_here;
        }
      if (met == 0) continue;
      ++strata;
      sum += static_cast<double>(won) / (2 * static_cast<double>(met));
    }
    return strata == 0 ? kMissing : sum / static_cast<double>(strata);
  }

 private:
  std::vector<std::size_t> instances_;
  std::size_t firsts_, seconds_, n_ = 0, fewest_ = 0;
  bool complete_ = true;                         // no value is missing
  std::vector<std::uint8_t> known_, twice_won_;  // [stratum][first][second][instance]
};

// Counts of each training in the resamples; a single training counts once in all of them.
class TrainingDraws {
 public:
  TrainingDraws(const std::vector<MethodErrors>& methods, std::size_t resamples, std::uint64_t seed) {
    std::uint32_t level = 0;
    for (const MethodErrors& method : methods) {
      const bool several = method.last.trainings > 1;
      draws_.emplace_back(several ? method.last.trainings : 0, std::max<std::size_t>(resamples, 1), seed,
                          several ? ++level : 0);
    }
  }
  const std::uint8_t* counts(std::size_t method, std::size_t resample, std::vector<std::uint8_t>& scratch) const {
    static constexpr std::uint8_t kOnce = 1;
    return draws_[method].instances() == 0 ? &kOnce : draws_[method].counts(resample, scratch);
  }

 private:
  std::vector<Resampling> draws_;
};

struct Scratch {
  StratifiedResampling::Draw draw;
  std::vector<std::uint8_t> first, second;
  PooledSample::Scratch pooled;
  PooledStatistics statistics;
};

// Of one method; profile[place].
struct MethodReplicates {
  Replicates iqm, median, gap, area;
  std::vector<Replicates> profile;
};

// The n of the expanded percentile interval.
std::size_t expanded_for(std::size_t instances, std::size_t trainings) {
  return trainings > 1 ? std::min(instances, trainings) : instances;
}

Band band_of(std::size_t n, double estimate, const Replicates& replicates, std::size_t expanded) {
  return {n, estimate, replicates.empty() ? Interval() : expanded_percentile(replicates, expanded)};
}

class Bootstrap {
 public:
  Bootstrap(const StratifiedResampling& resampling, const std::vector<MethodErrors>& methods, Parallel& parallel)
      : resampling_(resampling),
        methods_(methods),
        trainings_(methods, resampling.resamples(), resampling.seed()),
        parallel_(parallel),
        scratch_(parallel.threads()) {}

  void add_methods(std::size_t first, std::size_t count, const std::vector<double>& places, Aggregates& result) {
    std::vector<PooledSample> last;
    std::vector<StratifiedMean> area;
    for (std::size_t method = first; method < first + count; ++method) {
      last.emplace_back(methods_[method].last, resampling_.instances(), places);
      area.emplace_back(methods_[method].area, resampling_.instances());
    }
    const std::size_t resamples = resampling_.resamples();
    const Replicates none(resamples);
    std::vector<MethodReplicates> replicates(count,
                                             {none, none, none, none, std::vector<Replicates>(places.size(), none)});
    for_each_resample([&](std::size_t resample, Scratch& scratch) {
      for (std::size_t at = 0; at < count; ++at) {
        const std::uint8_t* trainings = trainings_.counts(first + at, resample, scratch.first);
        MethodReplicates& here = replicates[at];
        last[at].resampled(scratch.draw, trainings, scratch.pooled, scratch.statistics);
        here.iqm[resample] = scratch.statistics.iqm;
        here.median[resample] = scratch.statistics.median;
        here.gap[resample] = last[at].mean().resampled(scratch.draw, trainings);
        for (std::size_t place = 0; place < places.size(); ++place)
          here.profile[place][resample] = scratch.statistics.profile[place];
        here.area[resample] = area[at].resampled(scratch.draw, trainings);
      }
    });
    for (std::size_t at = 0; at < count; ++at) {
      const StratifiedMean& gap = last[at].mean();
      const std::size_t n = gap.size(), trainings = methods_[first + at].last.trainings;
      const std::size_t expanded = expanded_for(gap.fewest_instances(), trainings);
      const EveryOnce once(resampling_.instances(), trainings);
      PooledSample::Scratch scratch;
      PooledStatistics ends;
      last[at].resampled(once.draw, once.trainings(), scratch, ends);
      const MethodReplicates& here = replicates[at];
      AggregateBands bands;
      bands.iqm = band_of(n, ends.iqm, here.iqm, expanded);
      bands.median = band_of(n, ends.median, here.median, expanded);
      bands.gap = band_of(n, gap.resampled(once.draw, once.trainings()), here.gap, expanded);
      bands.area = band_of(area[at].size(), area[at].resampled(once.draw, once.trainings()), here.area, expanded);
      for (std::size_t place = 0; place < places.size(); ++place)
        bands.profile.push_back(band_of(n, ends.profile[place], here.profile[place], expanded));
      result.methods.push_back(std::move(bands));
    }
  }

  void add_pairs(const std::vector<std::pair<std::size_t, std::size_t>>& pairs, Aggregates& result) {
    std::vector<PairedWins> wins;
    for (const auto& [first, second] : pairs)
      wins.emplace_back(methods_.at(first).last, methods_.at(second).last, resampling_.instances());
    std::vector<Replicates> replicates(pairs.size(), Replicates(resampling_.resamples()));
    for_each_resample([&](std::size_t resample, Scratch& scratch) {
      for (std::size_t pair = 0; pair < pairs.size(); ++pair)
        replicates[pair][resample] =
            wins[pair].share(scratch.draw, trainings_.counts(pairs[pair].first, resample, scratch.first),
                             trainings_.counts(pairs[pair].second, resample, scratch.second));
    });
    std::size_t trainings = 1;
    for (const MethodErrors& method : methods_) trainings = std::max(trainings, method.last.trainings);
    const EveryOnce once(resampling_.instances(), trainings);
    for (std::size_t pair = 0; pair < pairs.size(); ++pair)
      result.pairs.push_back(
          {pairs[pair].first, pairs[pair].second,
           band_of(wins[pair].n(), wins[pair].share(once.draw, once.trainings(), once.trainings()), replicates[pair],
                   expanded_for(wins[pair].fewest_instances(), wins[pair].trainings()))});
  }

 private:
  // In blocks, so that threads rarely synchronise; each resample is drawn once for all methods.
  template <class Body>
  void for_each_resample(const Body& body) {
    constexpr std::size_t kAtOnce = 16;
    const std::size_t resamples = resampling_.resamples(), blocks = (resamples + kAtOnce - 1) / kAtOnce;
    parallel_.for_each(static_cast<int>(blocks), [&](int block, unsigned thread) {
      Scratch& scratch = scratch_[thread];
      const std::size_t first = static_cast<std::size_t>(block) * kAtOnce;
      for (std::size_t resample = first; resample < std::min(first + kAtOnce, resamples); ++resample) {
        resampling_.draw(resample, scratch.draw);
        body(resample, scratch);
      }
    });
  }

  const StratifiedResampling& resampling_;
  const std::vector<MethodErrors>& methods_;
  TrainingDraws trainings_;
  Parallel& parallel_;
  std::vector<Scratch> scratch_;
};

}  // namespace

std::vector<double> profile_places() {
  constexpr int kSteps = 40;
  std::vector<double> places;
  for (int step = 0; step <= kSteps; ++step) places.push_back(static_cast<double>(step) / kSteps);
  return places;
}

Aggregates aggregate(const StratifiedResampling& resampling, const std::vector<MethodErrors>& methods,
                     const std::vector<std::pair<std::size_t, std::size_t>>& pairs, Parallel& parallel) {
  const std::vector<double> places = profile_places();
  Aggregates result;
  Bootstrap bootstrap(resampling, methods, parallel);
  const std::size_t of_one = (places.size() + 4) * sizeof(double) * resampling.resamples();
  std::size_t values = 1;
  for (const MethodErrors& method : methods) {
    std::size_t here = 0;
    for (const std::vector<double>& stratum : method.last.strata) here += stratum.size();
    values = std::max(values, here);
  }
  const std::size_t at_once = std::max<std::size_t>(
      1, std::min(kReplicateBytes / std::max<std::size_t>(1, of_one), kSampleBytes / (values * kBytesPerValue)));
  for (std::size_t first = 0; first < methods.size(); first += at_once)
    bootstrap.add_methods(first, std::min(at_once, methods.size() - first), places, result);
  bootstrap.add_pairs(pairs, result);
  return result;
}

}  // namespace relign::statistics
