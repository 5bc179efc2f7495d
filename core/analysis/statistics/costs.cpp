#include "statistics/costs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/json_members.h"
#include "statistics/distributions.h"
#include "statistics/proportion.h"

namespace relign::statistics {
namespace {

struct Means {
  std::size_t begun = 0, met = 0, timed = 0;
  double seconds = 0, deviation = 0;  // mean station time and the standard deviation of single ones

  double share() const { return static_cast<double>(met) / static_cast<double>(begun); }
};

Means means_of(const CostColumns::Chosen& chosen) {
  Means means;
  double sum = 0, squares = 0;
  for (std::size_t place = 0; place < chosen.met.size(); ++place) {
    if (std::isnan(chosen.met[place])) continue;
    ++means.begun;
    means.met += chosen.met[place] > 0 ? 1 : 0;
    if (std::isnan(chosen.seconds[place])) continue;
    ++means.timed;
    sum += chosen.seconds[place];
  }
  const auto timed = static_cast<double>(means.timed);
  means.seconds = sum / timed;
  for (const double seconds : chosen.seconds)
    if (!std::isnan(seconds)) squares += (seconds - means.seconds) * (seconds - means.seconds);
  means.deviation = means.timed < 2 ? kMissing : std::sqrt(squares / (timed - 1));
  return means;
}

// An estimate of two independent ones, each moved alone to either end of its interval: the square root of the sum of
// squares to each side (MOVER; Zou and Donner, Statistics in Medicine 27 (2008)).
Interval combined(double estimate, const Interval& by_share, const Interval& by_seconds) {
  const auto side = [&](double a, double b) { return std::hypot(a - estimate, b - estimate); };
  return {estimate - side(by_share.low, by_seconds.low), estimate + side(by_share.high, by_seconds.high)};
}

}  // namespace

LineCost line_cost(const Prices& prices, double met, double seconds) {
  const double missed = 1 - met, hour = 3600;
  if (std::isnan(prices.rework))
    return {met, missed, seconds, prices.station_per_hour * seconds / hour + missed * prices.module};
  const double scrapped = missed * missed, all_seconds = seconds * (1 + missed);
  return {1 - scrapped, scrapped, all_seconds,
          prices.station_per_hour * all_seconds / hour + missed * prices.rework + scrapped * prices.module};
}

CostColumns::CostColumns(const std::vector<std::uint64_t>& instances, const Prices& prices, const Cycle& cycle)
    : instances_(instances), prices_(prices), cycle_(cycle) {
  if (std::isnan(cycle_.seconds)) cycle_.seconds = 0;
}

void CostColumns::add(const ReadTrial& trial, const std::vector<bool>& met) {
  if (!prices_.stated()) return;
  const auto found = std::lower_bound(instances_.begin(), instances_.end(), trial.row.instance);
  Trial kept{static_cast<std::size_t>(found - instances_.begin()), {}, {}};
  for (std::size_t step = 0; step < met.size(); ++step) {
    const records::StepNumbers& at = trial.steps[step];
    const double align = std::isnan(at.recommended_seconds) ? at.machine_seconds : at.recommended_seconds;
    kept.met.push_back(met[step] ? 1 : 0);
    kept.seconds.push_back(
        static_cast<float>(cycle_seconds(cycle_, align, static_cast<double>(step), trial.row.algorithm_ms_per_step)));
  }
  trials_.push_back(std::move(kept));
}

void CostColumns::add_failed(std::uint64_t instance) {
  if (!prices_.stated()) return;
  const auto found = std::lower_bound(instances_.begin(), instances_.end(), instance);
  trials_.push_back({static_cast<std::size_t>(found - instances_.begin()), {}, {}});
}

unsigned CostColumns::last_step() const {
  std::size_t steps = 1;
  for (const Trial& trial : trials_) steps = std::max(steps, trial.met.size());
  return static_cast<unsigned>(steps - 1);
}

CostColumns::Chosen CostColumns::at(std::array<unsigned, 2> steps) const {
  Chosen chosen{steps, std::vector<double>(instances_.size(), kMissing),
                std::vector<double>(instances_.size(), kMissing)};
  for (const Trial& trial : trials_) {
    if (trial.met.empty()) {
      chosen.met[trial.place] = 0;
      continue;
    }
    const std::size_t step = std::min<std::size_t>(steps[trial.place % 2], trial.met.size() - 1);
    chosen.met[trial.place] = trial.met[step];
    chosen.seconds[trial.place] = trial.seconds[step];
  }
  return chosen;
}

unsigned CostColumns::cheapest_of(std::size_t half) const {
  unsigned best = last_step();
  double least = std::numeric_limits<double>::infinity();
  for (unsigned step = 0; step <= last_step(); ++step) {
    Chosen chosen = at({step, step});
    for (std::size_t place = 1 - half; place < chosen.met.size(); place += 2)
      chosen.met[place] = chosen.seconds[place] = kMissing;
    const Means means = means_of(chosen);
    const double cost = line_cost(prices_, means.share(), means.seconds).per_good_module();
    if (!(cost < least)) continue;
    least = cost;
    best = step;
  }
  return best;
}

CostColumns::Chosen CostColumns::cheapest() const { return at({cheapest_of(1), cheapest_of(0)}); }

CostStudy study_cost(const Prices& prices, const CostColumns::Chosen& chosen) {
  const Means means = means_of(chosen);
  CostStudy study;
  study.steps = chosen.steps;
  study.met = success_rate(means.met, means.begun);
  const double half = means.timed < 2
                          ? kMissing
                          : student_t_quantile((1 + kConfidence) / 2, static_cast<double>(means.timed - 1)) *
                                means.deviation / std::sqrt(static_cast<double>(means.timed));
  study.seconds = {means.timed, means.seconds, {means.seconds - half, means.seconds + half}};
  const auto at = [&](double met, double seconds) { return line_cost(prices, met, seconds); };
  const LineCost best = at(means.share(), means.seconds);
  const LineCost good_end = at(study.met.interval.high, means.seconds),
                 bad_end = at(study.met.interval.low, means.seconds);
  const LineCost fast = at(means.share(), study.seconds.interval.low),
                 slow = at(means.share(), study.seconds.interval.high);
  study.scrapped = {means.begun, best.scrapped, {good_end.scrapped, bad_end.scrapped}};
  study.good_per_hour = {means.begun, best.good_per_hour(),
                         combined(best.good_per_hour(), {bad_end.good_per_hour(), good_end.good_per_hour()},
                                  {slow.good_per_hour(), fast.good_per_hour()})};
  const double price = best.per_good_module();
  study.per_good_module = {means.begun, price, {good_end.per_good_module(), price}};
  if (std::isfinite(price))
    study.per_good_module.interval = combined(price, {good_end.per_good_module(), bad_end.per_good_module()},
                                              {fast.per_good_module(), slow.per_good_module()});
  return study;
}

Band saving(const CostStudy& study, const CostStudy& baseline) {
  const Band &own = study.per_good_module, &other = baseline.per_good_module;
  if (!std::isfinite(own.estimate) || !std::isfinite(other.estimate)) return {};
  const double saves = other.estimate - own.estimate;
  return {std::min(own.n, other.n),
          saves,
          {saves - std::hypot(other.estimate - other.interval.low, own.interval.high - own.estimate),
           saves + std::hypot(other.interval.high - other.estimate, own.estimate - own.interval.low)}};
}

}  // namespace relign::statistics
