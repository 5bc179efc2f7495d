#include "statistics/survival.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "statistics/distributions.h"

namespace relign::statistics {
namespace {

Interval log_log(double survival, double greenwood_sum, double z) {
  if (survival == 1) return {1, 1};
  const double log_survival = std::log(survival);
  const double spread = z * std::sqrt(greenwood_sum) / -log_survival;
  return {std::exp(log_survival * std::exp(spread)), std::exp(log_survival * std::exp(-spread))};
}

// Clopper and Pearson's upper limit of a proportion with 0 of n observed.
double upper_limit_of_none(std::size_t n, double confidence) {
  return 1 - std::pow((1 - confidence) / 2, 1 / static_cast<double>(n));
}

double first_at_half(const std::vector<SurvivalPoint>& curve, double (*value)(const SurvivalPoint&)) {
  constexpr double kRounding = 1e-12;  // of products of fractions
  for (const SurvivalPoint& point : curve) {
    if (value(point) <= 0.5 + kRounding) return point.steps;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

std::vector<SurvivalPoint> kaplan_meier(const std::vector<TargetTime>& trials, double confidence) {
  check_confidence(confidence);
  std::vector<TargetTime> sorted;
  std::copy_if(trials.begin(), trials.end(), std::back_inserter(sorted),
               [](const TargetTime& trial) { return !std::isnan(trial.steps); });
  std::sort(sorted.begin(), sorted.end(), [](const TargetTime& a, const TargetTime& b) { return a.steps < b.steps; });
  const double z = normal_quantile((1 + confidence) / 2);
  std::vector<SurvivalPoint> curve;
  double survival = 1, greenwood_sum = 0;
  for (std::size_t first = 0; first < sorted.size();) {
    SurvivalPoint point;
    point.steps = sorted[first].steps;
    point.at_risk = sorted.size() - first;
    for (; first < sorted.size() && sorted[first].steps == point.steps; ++first) {
      ++(sorted[first].reached ? point.reached : point.censored);
    }
    const auto at_risk = static_cast<double>(point.at_risk), reached = static_cast<double>(point.reached);
    const double before = survival;
    survival *= (at_risk - reached) / at_risk;
    if (point.reached > 0) greenwood_sum += reached / (at_risk * (at_risk - reached));
    point.survival = survival;
    point.standard_error = survival == 0 ? kMissing : survival * std::sqrt(greenwood_sum);
    point.interval = survival == 0 ? Interval{0, before * upper_limit_of_none(point.at_risk, confidence)}
                                   : log_log(survival, greenwood_sum, z);
    curve.push_back(point);
  }
  return curve;
}

Band median_steps(const std::vector<SurvivalPoint>& curve) {
  if (curve.empty()) return {};
  return {curve.front().at_risk,
          first_at_half(curve, [](const SurvivalPoint& point) { return point.survival; }),
          {first_at_half(curve, [](const SurvivalPoint& point) { return point.interval.low; }),
           first_at_half(curve, [](const SurvivalPoint& point) { return point.interval.high; })}};
}

}  // namespace relign::statistics
