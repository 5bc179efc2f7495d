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
  mounted.reset();
  captures = in_longest = 0;
  longest = 0;
}

// From a few captures on, since the first may be a preparation.
std::optional<TimeLeft::Running> TimeLeft::Worker::running() const {
  constexpr std::size_t kFewCaptures = 3;
  if (!trial || captures < kFewCaptures) return std::nullopt;
  const double all = last - *mounted;
  if (longest <= all / 2 || in_longest == captures) return Running{all / static_cast<double>(captures), 0};
  const double capture = (all - longest) / static_cast<double>(captures - in_longest);
  return Running{capture, std::max(0.0, longest - capture * static_cast<double>(in_longest))};
}

// Expected seconds of one kind of trial, in one case.
struct TimeLeft::Costs {
  struct OfMethod {
    double later = 0, first = 0, setup = 0;
    double steps(const Worker& worker) const { return worker.first_of_method ? first : later; }
  };
  std::map<std::size_t, OfMethod> methods;
  std::map<std::size_t, double> mounting;
  double starting = 0;  // more than mounting

  double of(const Worker& worker, const Trial& trial) const {
    const OfMethod& method = methods.at(trial.method);
    const double outside = worker.mounts ? mounting.at(trial.scene) : method.setup;
    return method.steps(worker) + outside + (worker.starts ? starting : 0);
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

void TimeLeft::add_known(std::size_t method, const SpentTime& spent) {
  const auto found = methods_.find(method);
  if (found == methods_.end() || !std::isfinite(spent.steps)) return;
  found->second.known.push_back(spent.steps);
  found->second.known_once.push_back(spent.once);
}

void TimeLeft::begin(std::size_t worker, std::size_t trial, double now) {
  workers_[worker].begin(trial, group_of_.at(trial), trials_[trial].method);
  workers_[worker].since = now;
  begun_.insert(trial);
}

void TimeLeft::advance(std::size_t worker, std::size_t captures, double now) {
  Worker& on = workers_[worker];
  if (!on.trial) return;
  if (!on.mounted) {
    on.mounted = on.last = now;
    outside_of_steps(on).add(now - on.since);
  }
  if (captures <= on.captures) return;
  if (now - on.last > on.longest) {
    on.longest = now - on.last;
    on.in_longest = captures - on.captures;
  }
  on.captures = captures;
  on.last = now;
}

void TimeLeft::end(std::size_t worker, const SpentTime& spent) {
  Worker& on = workers_[worker];
  Method& method = methods_.at(trials_[*on.trial].method);
  const double steps = on.mounted ? spent.total - (*on.mounted - on.since) : spent.steps;
  method.captures.add(spent.captures);
  (on.first_of_method ? method.first : method.later).add(steps);
  if (on.first_of_method) method.first_without_once.add(steps - spent.once);
  if (!on.mounted) outside_of_steps(on).add(spent.total - steps);
  on.trial.reset();
}

TimeLeft::Mean& TimeLeft::outside_of_steps(const Worker& worker) {
  const Trial& trial = trials_[*worker.trial];
  return worker.starts ? starting_ : worker.mounts ? mounting_.at(trial.scene) : methods_.at(trial.method).setup;
}

// Of the trial with the most captures.
std::optional<TimeLeft::Running> TimeLeft::running(std::size_t method) const {
  const Worker* most = nullptr;
  for (const Worker& worker : workers_)
    if (worker.trial && trials_[*worker.trial].method == method && (!most || worker.captures > most->captures))
      most = &worker;
  return most ? most->running() : std::nullopt;
}

// Seconds that the first trial on a worker takes longer. A long step in more trials than there are workers belongs to
// the method, and comes in every trial.
double TimeLeft::once_of_known(const Method& method) const {
  const std::vector<double>& once = method.known_once;
  const auto with = static_cast<std::size_t>(std::count_if(once.begin(), once.end(), [](double s) { return s > 0; }));
  const bool learns = with > 0 && (with <= workers_.size() || 2 * with < once.size());
  return learns ? *std::max_element(once.begin(), once.end()) : 0;
}

double TimeLeft::seconds_of_steps(std::size_t number, const Method& method, Case which, double guess) const {
  const auto within = [which](double value, double spread) {
    return which == Case::expected ? value : which == Case::least ? value * (1 - spread) : value * (1 + spread);
  };
  if (const Mean& later = method.later; later.count > 1 && later.value > 0) {
    const double error = std::sqrt(later.variance / std::min(static_cast<double>(later.count), 1 / kFollow));
    return within(later.value, std::clamp(2 * error / later.value, kLeastSpread, kMostSpread));
  }
  if (method.later.count > 0) return within(method.later.value, kOneTrial);
  if (!method.known.empty()) {
    std::vector<double> later = method.known;
    if (once_of_known(method) > 0)
      std::transform(later.begin(), later.end(), method.known_once.begin(), later.begin(), std::minus<>());
    return within(median(std::move(later)), kOneTrial);
  }
  if (method.first.count == 0) {
    const std::optional<Running> running = this->running(number);
    return within(running ? running->capture * method.most_captures : guess, kMostSpread);
  }
  return which == Case::most ? method.first.value : within(method.first_without_once.value, kOneTrial);
}

std::optional<TimeLeft::Costs> TimeLeft::costs(Case which) const {
  std::vector<double> seen, setups, mountings;
  for (const auto& [number, method] : methods_) {
    if (method.seen() || running(number))
      seen.push_back(seconds_of_steps(number, method, which, 0) /
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
    cost.later = seconds_of_steps(number, method, which, guess * method.most_captures);
    const std::optional<Running> running = this->running(number);
    cost.first = method.first.count > 0  ? std::max(cost.later, method.first.value)
                 : !method.known.empty() ? cost.later + once_of_known(method)
                 : running               ? cost.later + running->once
                                         : cost.later;
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
      const Trial& trial = trials_[*worker.trial];
      const double spent = now - worker.mounted.value_or(worker.since);
      const double cost = worker.mounted ? costs.methods.at(trial.method).steps(worker) : costs.of(worker, trial);
      left = std::max(cost - spent, kOverdue * spent);
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
