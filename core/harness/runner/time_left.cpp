#include "runner/time_left.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <queue>
#include <utility>

#include "base/median.h"
#include "records/results_folder.h"
#include "runner/trial_queue.h"

namespace relign::runner {
namespace {

constexpr double kFollow = 0.1;    // least weight of a new value
constexpr double kOneTrial = 0.3;  // relative uncertainty after one trial, or from an earlier run
constexpr double kLeastSpread = 0.05, kMostSpread = 0.5;
constexpr double kOverdue = 0.1;  // what a trial that takes longer than expected still takes, of its time so far

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

}  // namespace

SpentTime spent_time(const records::TrialTimes& times, double total) {
  SpentTime spent;
  spent.total = total;
  const std::vector<double>& own = times.algorithm_seconds;
  const double all = sum(own), steps = records::step_seconds(times);
  spent.steps = std::isfinite(steps) ? std::clamp(steps, 0.0, total) : total;
  spent.captures = std::max(1.0, static_cast<double>(own.size()));
  if (own.size() < 3) return spent;
  const double longest = *std::max_element(own.begin(), own.end());
  if (longest > all / 2) spent.once = longest - (all - longest) / static_cast<double>(own.size() - 1);
  return spent;
}

void TimeLeft::Mean::add(double next) {
  ++count;
  const double weight = std::max(1.0 / static_cast<double>(count), kFollow);
  const double difference = next - value;
  value += weight * difference;
  variance = (1 - weight) * (variance + weight * difference * difference);
}

void TimeLeft::Worker::begin(std::size_t next, std::size_t its_group, std::size_t method) {
  trial = next;
  starts = methods.empty();
  mounts = group != its_group;
  first_of_method = methods.insert(method).second;
  group = its_group;
}

// Expected seconds of one kind of trial, in one case.
struct TimeLeft::Costs {
  struct OfMethod {
    double later = 0, first = 0, setup = 0;
  };
  std::map<std::size_t, OfMethod> methods;
  std::map<std::size_t, double> mounting;
  double starting = 0;  // more than mounting

  double of(const Worker& worker, const Trial& trial) const {
    const OfMethod& method = methods.at(trial.method);
    const double outside = worker.mounts ? mounting.at(trial.scene) : method.setup;
    return (worker.first_of_method ? method.first : method.later) + outside + (worker.starts ? starting : 0);
  }
};

TimeLeft::TimeLeft(std::vector<Trial> trials, std::vector<std::vector<std::size_t>> groups, std::size_t workers)
    : trials_(std::move(trials)), groups_(std::move(groups)), workers_(workers) {
  for (std::size_t group = 0; group < groups_.size(); ++group)
    for (const std::size_t trial : groups_[group]) {
      group_of_[trial] = group;
      double& most = methods_[trials_[trial].method].most_captures;
      most = std::max(most, trials_[trial].captures);
      mounting_[trials_[trial].scene];
    }
}

void TimeLeft::add_known(std::size_t method, double step_seconds) {
  if (const auto found = methods_.find(method); found != methods_.end() && std::isfinite(step_seconds))
    found->second.known.push_back(step_seconds);
}

void TimeLeft::begin(std::size_t worker, std::size_t trial, double now) {
  workers_[worker].begin(trial, group_of_.at(trial), trials_[trial].method);
  workers_[worker].since = now;
  begun_.insert(trial);
}

void TimeLeft::end(std::size_t worker, const SpentTime& spent) {
  Worker& on = workers_[worker];
  const Trial& trial = trials_[*on.trial];
  Method& method = methods_.at(trial.method);
  on.trial.reset();
  method.captures.add(spent.captures);
  (on.first_of_method ? method.first : method.later).add(spent.steps);
  if (on.first_of_method) method.first_without_once.add(spent.steps - spent.once);
  const double outside = spent.total - spent.steps;
  (on.starts ? starting_ : on.mounts ? mounting_.at(trial.scene) : method.setup).add(outside);
}

double TimeLeft::seconds_of_steps(const Method& method, Case which, double guess) const {
  const auto within = [which](double value, double spread) {
    return which == Case::expected ? value : which == Case::least ? value * (1 - spread) : value * (1 + spread);
  };
  if (const Mean& later = method.later; later.count > 1 && later.value > 0) {
    const double error = std::sqrt(later.variance / std::min(static_cast<double>(later.count), 1 / kFollow));
    return within(later.value, std::clamp(2 * error / later.value, kLeastSpread, kMostSpread));
  }
  if (method.later.count > 0) return within(method.later.value, kOneTrial);
  if (!method.known.empty()) return within(median(method.known), kOneTrial);
  if (method.first.count == 0) return within(guess, kMostSpread);
  return which == Case::most ? method.first.value : within(method.first_without_once.value, kOneTrial);
}

std::optional<TimeLeft::Costs> TimeLeft::costs(Case which) const {
  std::vector<double> seen, setups, mountings;
  for (const auto& [number, method] : methods_) {
    if (method.seen())
      seen.push_back(seconds_of_steps(method, which, 0) /
                     (method.captures.count > 0 ? method.captures.value : method.most_captures));
    if (method.setup.count > 0) setups.push_back(method.setup.value);
  }
  if (seen.empty()) return std::nullopt;
  for (const auto& [scene, seconds] : mounting_)
    if (seconds.count > 0) mountings.push_back(seconds.value);
  const auto mean = [](const std::vector<double>& values, double otherwise) {
    return values.empty() ? otherwise : sum(values) / static_cast<double>(values.size());
  };
  // Methods that have not run yet: like the others, for a capture.
  const double guess = which == Case::least  ? *std::min_element(seen.begin(), seen.end())
                       : which == Case::most ? *std::max_element(seen.begin(), seen.end())
                                             : mean(seen, 0);
  Costs costs;
  for (const auto& [number, method] : methods_) {
    Costs::OfMethod& cost = costs.methods[number];
    cost.later = seconds_of_steps(method, which, guess * method.most_captures);
    cost.first = method.first.count > 0 ? std::max(cost.later, method.first.value) : cost.later;
    cost.setup = method.setup.count > 0 ? method.setup.value : mean(setups, 0);
  }
  const double unseen_mounting = mean(mountings, which == Case::least ? 0 : starting_.value);
  for (const auto& [scene, seconds] : mounting_)
    costs.mounting[scene] = seconds.count > 0 ? seconds.value : unseen_mounting;
  if (!mountings.empty()) costs.starting = std::max(0.0, starting_.value - mean(mountings, 0));
  return costs;
}

// Runs the rest of the queue with these costs.
double TimeLeft::simulate(double now, const Costs& costs) const {
  // Untouched groups first, since a worker joins another's group only after these.
  std::vector<std::vector<std::size_t>> rest;
  std::map<std::size_t, std::size_t> number_of;  // group -> its number in `rest`
  for (const bool touched : {false, true})
    for (std::size_t group = 0; group < groups_.size(); ++group) {
      if ((begun_.count(groups_[group].front()) > 0) != touched) continue;
      std::vector<std::size_t> trials;
      for (const std::size_t trial : groups_[group])
        if (begun_.count(trial) == 0) trials.push_back(trial);
      if (trials.empty()) continue;
      number_of[group] = rest.size();
      rest.push_back(std::move(trials));
    }
  TrialQueue queue(std::move(rest));
  std::vector<Worker> workers = workers_;
  std::vector<std::size_t> places(workers.size(), TrialQueue::kNoGroup);
  using Free = std::pair<double, std::size_t>;  // when, which worker
  std::priority_queue<Free, std::vector<Free>, std::greater<>> free;
  for (std::size_t number = 0; number < workers.size(); ++number) {
    const Worker& worker = workers[number];
    if (worker.group)
      if (const auto found = number_of.find(*worker.group); found != number_of.end()) places[number] = found->second;
    double left = 0;
    if (worker.trial) {
      const double spent = now - worker.since;
      left = std::max(costs.of(worker, trials_[*worker.trial]) - spent, kOverdue * spent);
    }
    free.emplace(left, number);
  }
  double end = 0;
  while (!free.empty()) {
    const auto [when, number] = free.top();
    free.pop();
    end = std::max(end, when);
    const std::optional<std::size_t> trial = queue.next(places[number]);
    if (!trial) continue;
    workers[number].begin(*trial, group_of_.at(*trial), trials_[*trial].method);
    free.emplace(when + costs.of(workers[number], trials_[*trial]), number);
  }
  return end;
}

std::optional<Outlook> TimeLeft::at(double now) const {
  const std::optional<Costs> expected = costs(Case::expected);
  if (!expected) return std::nullopt;
  Outlook outlook;
  outlook.seconds = simulate(now, *expected);
  outlook.least = std::min(outlook.seconds, simulate(now, *costs(Case::least)));
  outlook.most = std::max(outlook.seconds, simulate(now, *costs(Case::most)));
  return outlook;
}

}  // namespace relign::runner
