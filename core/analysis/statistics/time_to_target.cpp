#include "statistics/time_to_target.h"

#include <algorithm>
#include <limits>
#include <string>

#include "base/error.h"
#include "statistics/bootstrap.h"

namespace relign::statistics {

std::vector<TargetTime> times_to_targets(const std::vector<double>& track, const std::vector<double>& targets,
                                         double censored_at) {
  if (track.empty())
    throw Error(ErrorKind::internal, "a track without steps has no times to targets; leave the trial out");
  const auto last = static_cast<double>(track.size() - 1);
  if (!(censored_at >= last)) {
    throw Error(ErrorKind::internal, "a track of " + std::to_string(track.size() - 1) +
                                         " steps cannot be censored at " + std::to_string(censored_at) +
                                         "; give its last step or the budget");
  }
  std::vector<TargetTime> times;
  times.reserve(targets.size());
  for (const double target : targets) {
    const auto hit = std::find_if(track.begin(), track.end(), [&](double value) { return value <= target; });
    const bool reached = hit != track.end();
    times.push_back({reached ? static_cast<double>(hit - track.begin()) : censored_at, reached});
  }
  return times;
}

ExpectedSteps expected_steps(const std::vector<TargetTime>& trials) {
  ExpectedSteps result;
  double spent = 0;
  for (const TargetTime& trial : trials) {
    spent += trial.steps;
    result.successes += trial.reached ? 1 : 0;
  }
  result.trials = trials.size();
  if (trials.empty()) return result;
  result.steps =
      result.successes == 0 ? std::numeric_limits<double>::infinity() : spent / static_cast<double>(result.successes);
  return result;
}

ExpectedSteps expected_steps(const std::vector<TargetTime>& trials, const Resampling& resampling, double confidence) {
  ExpectedSteps result = expected_steps(trials);
  std::vector<std::vector<double>> columns(2, std::vector<double>(trials.size()));
  for (std::size_t trial = 0; trial < trials.size(); ++trial) {
    columns[0][trial] = trials[trial].steps;
    columns[1][trial] = trials[trial].reached ? 1 : 0;
  }
  const std::vector<Replicates> sums = resampled(resampling, columns, OrderStatistic::mean());
  Replicates replicates = ratio(sums[0], sums[1]);
  for (std::size_t resample = 0; resample < replicates.size(); ++resample) {
    // 0 steps / 0 successes would be NaN.
    if (sums[1][resample] == 0) replicates[resample] = std::numeric_limits<double>::infinity();
  }
  if (!trials.empty()) result.interval = expanded_percentile(replicates, trials.size(), confidence);
  return result;
}

std::vector<double> runtime_ecdf(const std::vector<TargetTime>& pairs, const std::vector<double>& at) {
  if (pairs.empty()) return std::vector<double>(at.size(), kMissing);
  std::vector<double> reached;
  for (const TargetTime& pair : pairs) {
    if (pair.reached) reached.push_back(pair.steps);
  }
  std::sort(reached.begin(), reached.end());
  std::vector<double> shares;
  shares.reserve(at.size());
  for (const double step : at) {
    const auto count = std::upper_bound(reached.begin(), reached.end(), step) - reached.begin();
    shares.push_back(static_cast<double>(count) / static_cast<double>(pairs.size()));
  }
  return shares;
}

}  // namespace relign::statistics
