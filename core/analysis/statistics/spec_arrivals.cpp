#include "statistics/spec_arrivals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "statistics/proportion.h"
#include "statistics/survival.h"

namespace relign::statistics {

namespace {

double criterion_at(const ReadTrial& trial, Criterion criterion, std::size_t step) {
  const std::vector<double>& values = trial.stored.closing().criteria[criterion];
  return step < values.size() ? values[step] : kMissing;
}

}  // namespace

std::vector<bool> met_by_step(const TrialTable& table, const records::Specification& spec, const ReadTrial& trial) {
  const records::MtfRecord& mtf = table.mtf_of(trial.row).by[Rule::own][Curing::after];
  std::vector<bool> met(trial.steps.size(), spec.mtf_met_by(mtf.centre, mtf.corner));
  const std::vector<double> scores =
      track_values(trial.steps, trial.row.own_optimum_mse, track_of(Rule::own), trial.series.score);
  for (std::size_t step = 0; step < met.size(); ++step) {
    met[step] = met[step] && (std::isnan(spec.score) || scores[step] <= spec.score);
    for (const Criterion one : kCriteria)
      if (!std::isnan(spec.limits[one])) met[step] = met[step] && spec.meets(one, criterion_at(trial, one, step));
  }
  return met;
}

SpecArrivals::SpecArrivals(const TrialTable& table, const Series& series, const records::Specification& spec,
                           const Cycle& cycle)
    : table_(table), spec_(spec), cycle_(cycle), failed_(series.failed) {
  if (!spec.limits_criteria()) return;
  if (!std::isnan(spec.score)) arrivals_.emplace_back("rmse");
  for (const Criterion one : kCriteria)
    if (!std::isnan(spec.limits[one])) arrivals_.emplace_back(std::string(entry_of(one).column));
  arrivals_.emplace_back("all");
  curve_.resize(series.largest_budget + std::size_t{1});
}

void SpecArrivals::arrive(Arrival& arrival, const std::vector<bool>& met, const ReadTrial& trial) const {
  const auto first = static_cast<std::size_t>(std::find(met.begin(), met.end(), true) - met.begin());
  const bool reached = first < met.size();
  const double censored_at = std::max<double>(trial.row.budget, static_cast<double>(met.size() - 1));
  arrival.steps.push_back({reached ? static_cast<double>(first) : censored_at, reached});
  double seconds = std::numeric_limits<double>::infinity();  // as for the score: never, since budgets are in steps
  if (reached) {
    const records::StepNumbers& step = trial.steps[first];
    seconds = std::isnan(step.recommended_seconds) ? step.machine_seconds : step.recommended_seconds;
  }
  arrival.seconds.push_back({seconds, reached});
  const double cycle =
      cycle_seconds(cycle_, seconds, static_cast<double>(first), trial.row.algorithm_ms_per_step);  // NaN: unknown
  arrival.cycles.push_back({cycle, reached});
  arrival.in_spec += met.back() ? 1 : 0;
}

void SpecArrivals::add(const ReadTrial& trial) {
  if (arrivals_.empty()) return;
  auto arrival = arrivals_.begin();
  const auto judge = [&](const auto& meets) {
    std::vector<bool> met(trial.steps.size());
    for (std::size_t step = 0; step < met.size(); ++step) met[step] = meets(step);
    arrive(*arrival++, met, trial);
  };
  if (!std::isnan(spec_.score)) {
    const std::vector<double> scores =
        track_values(trial.steps, trial.row.own_optimum_mse, track_of(Rule::own), trial.series.score);
    judge([&](std::size_t step) { return scores[step] <= spec_.score; });
  }
  for (const Criterion one : kCriteria) {
    if (std::isnan(spec_.limits[one])) continue;
    judge([&](std::size_t step) { return spec_.meets(one, criterion_at(trial, one, step)); });
    for (std::size_t step = 0; step < curve_.size(); ++step)
      curve_[step].values[one].push_back(criterion_at(trial, one, std::min(step, trial.steps.size() - 1)));
  }
  const std::vector<bool> all = met_by_step(table_, spec_, trial);
  arrive(*arrival, all, trial);
  for (std::size_t step = 0; step < curve_.size(); ++step) curve_[step].met += all[std::min(step, all.size() - 1)];
}

void SpecArrivals::finish(SeriesStudy& study) const {
  if (arrivals_.empty() || arrivals_.front().steps.empty()) return;
  const std::size_t trials = arrivals_.front().steps.size();
  for (const Arrival& arrival : arrivals_)
    study.to_specification.push_back({arrival.name, arrival.in_spec, success_rate(arrival.in_spec, trials + failed_),
                                      expected_steps(arrival.steps), median_steps(kaplan_meier(arrival.steps)),
                                      median_steps(kaplan_meier(arrival.seconds))});
  const ArrivalStudy& all = study.to_specification.back();
  study.expected_to_spec = all.expected;
  study.steps_to_spec = study.rules[Rule::own].steps_to_spec = all.steps;
  study.seconds_to_spec = all.seconds;
  // Unknown computing time leaves the cycle unknown: it does not count as none.
  const std::vector<TargetTime>& cycles = arrivals_.back().cycles;
  if (std::none_of(cycles.begin(), cycles.end(), [](const TargetTime& time) { return std::isnan(time.steps); }))
    study.cycle_to_spec = median_steps(kaplan_meier(cycles));
  for (std::size_t step = 0; step < curve_.size() && step < study.curve.points.size(); ++step) {
    CurvePoint& point = study.curve.points[step];
    for (const Criterion one : kCriteria)
      if (!curve_[step].values[one].empty()) point.criteria[one] = quantiles(curve_[step].values[one]).median;
    point.in_spec = static_cast<double>(curve_[step].met) / static_cast<double>(trials);
  }
}

}  // namespace relign::statistics
