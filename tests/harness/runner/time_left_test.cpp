#include "runner/time_left.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "runner/trial_queue.h"

namespace relign::runner {
namespace {

constexpr double kMounting = 1.2, kStarting = 0.4;
// Seconds in the steps of ten trials of each method, recorded on relign_od with 30 steps and two workers. The first of
// sensitivity on a worker has a step of 6.2 s in which it measures derivatives for all later trials.
constexpr double kLearning = 6.2;
constexpr double kCaptures = 11;
const std::vector<std::vector<double>> kRecorded = {{5.07, 5.87, 6.70, 5.00, 4.90, 5.88, 5.76, 4.31, 5.93, 5.58},
                                                    {4.19, 3.61, 3.38, 4.08, 3.57, 3.46, 3.91, 4.05, 3.83, 3.77},
                                                    {1.71, 1.72, 1.83, 2.25, 1.78, 1.59, 1.60, 1.54, 1.84, 1.64},
                                                    {2.27, 1.69, 1.83, 1.73, 1.69, 2.01, 2.00, 2.01, 1.61, 1.70},
                                                    {0.14, 0.09, 0.15, 0.10, 0.09, 0.10, 0.11, 0.12, 0.13, 0.10}};

// A run of these trials: what was promised, and when.
struct Replay {
  struct Promise {
    double at = 0;
    std::optional<Outlook> left;
  };
  std::vector<Promise> promises;  // every 0.1 s
  double end = 0;

  // The last promise before this share of the run.
  Outlook at_share(double share) const {
    Outlook found;
    for (const Promise& promise : promises)
      if (promise.at <= share * end && promise.left) found = *promise.left;
    return found;
  }
};

std::vector<TimeLeft::Trial> plan_of(std::size_t instances) {
  std::vector<TimeLeft::Trial> trials;
  for (std::size_t i = 0; i < instances * kRecorded.size(); ++i) trials.push_back({0, i % kRecorded.size(), kCaptures});
  return trials;
}

std::vector<std::vector<std::size_t>> groups_of(std::size_t instances) {
  std::vector<std::vector<std::size_t>> groups(instances);
  for (std::size_t i = 0; i < instances * kRecorded.size(); ++i) groups[i / kRecorded.size()].push_back(i);
  return groups;
}

// Trials of this many instances in an earlier run: the first of sensitivity on each of two workers prepares others.
std::vector<std::pair<std::size_t, SpentTime>> earlier_trials(std::size_t instances) {
  std::vector<std::pair<std::size_t, SpentTime>> earlier;
  for (std::size_t instance = 0; instance < instances; ++instance)
    for (std::size_t method = 0; method < kRecorded.size(); ++method) {
      SpentTime spent;
      spent.once = method == 0 && instance < 2 ? kLearning : 0;
      spent.steps = spent.total = kRecorded[method][instance % 10] + spent.once;
      earlier.emplace_back(method, spent);
    }
  return earlier;
}

// `reports`: every trial reports its captures, 11, as they are made.
Replay replay(std::size_t instances, std::size_t count,
              const std::vector<std::pair<std::size_t, SpentTime>>& known = {}, bool reports = false) {
  struct Worker {
    std::size_t group = 0, mounted = TrialQueue::kNoGroup;
    std::vector<bool> learnt = std::vector<bool>(kRecorded.size());
    bool started = false, works = false;
    SpentTime spent;
    double free = 0;

    void report(TimeLeft& estimate, std::size_t number, double now) const {
      const double in_steps = now - (free - spent.steps);
      if (in_steps < 0) return;
      const double each = (spent.steps - spent.once) / kCaptures;
      const double made = in_steps < each ? 0 : 1 + (in_steps - each - spent.once) / each;  // before the second: once
      estimate.advance(number, static_cast<std::size_t>(std::clamp(made, in_steps < each ? 0.0 : 1.0, kCaptures)), now);
    }
  };
  TimeLeft estimate(plan_of(instances), groups_of(instances), count);
  for (const auto& [method, spent] : known) estimate.add_known(method, spent);
  TrialQueue queue(groups_of(instances));
  std::vector<Worker> workers(count);
  Replay result;
  for (double now = 0; now < 10000; now += 0.1) {
    std::size_t idle = 0;
    for (std::size_t number = 0; number < count; ++number) {
      Worker& worker = workers[number];
      if (worker.works && worker.free > now) {
        if (reports) worker.report(estimate, number, now);
        continue;
      }
      if (worker.works) estimate.end(number, worker.spent);
      worker.works = false;
      const std::optional<std::size_t> trial = queue.next(worker.group);
      if (!trial) {
        ++idle;
        continue;
      }
      const std::size_t method = *trial % kRecorded.size(), instance = *trial / kRecorded.size();
      const bool learns = method == 0 && !worker.learnt[method];
      worker.spent.captures = kCaptures;
      worker.spent.once = learns ? kLearning : 0;
      worker.spent.steps = kRecorded[method][instance % 10] + worker.spent.once;
      worker.spent.total =
          worker.spent.steps + 0.03 + (worker.mounted == instance ? 0 : kMounting) + (worker.started ? 0 : kStarting);
      worker.learnt[method] = worker.started = worker.works = true;
      worker.mounted = instance;
      worker.free = now + worker.spent.total;
      estimate.begin(number, *trial, now);
    }
    if (idle == count) {
      result.end = now;
      break;
    }
    result.promises.push_back({now, estimate.at(now)});
  }
  return result;
}

TEST(TimeLeft, IsUnknownBeforeTheFirstTrial) {
  TimeLeft estimate(plan_of(2), groups_of(2), 1);
  EXPECT_FALSE(estimate.at(0));
  estimate.begin(0, 0, 0);
  EXPECT_FALSE(estimate.at(1));
  estimate.end(0, {5, 4, 0});
  EXPECT_TRUE(estimate.at(5));
}

TEST(TimeLeft, PredictsARecordedRunWithinThirtyPercent) {
  for (const std::size_t instances : {10, 20, 40})
    for (const std::size_t workers : {1, 2, 4}) {
      const Replay run = replay(instances, workers);
      ASSERT_GT(run.end, 0);
      for (const double share : {0.25, 0.5, 0.75, 0.9}) {
        const double left = (1 - share) * run.end;
        EXPECT_NEAR(run.at_share(share).seconds, left, 0.3 * left)
            << instances << " instances, " << workers << " workers, at " << share;
      }
      // A tenth of the smallest runs is less than the first trial.
      if (instances >= 20 * workers) {
        const double left = 0.9 * run.end;
        EXPECT_NEAR(run.at_share(0.1).seconds, left, 0.3 * left) << instances << " instances, " << workers;
      }
    }
}

// As with home before others: 2 captures of 0.04 s give the time of 81.
TEST(TimeLeft, ScalesMethodsThatHaveNotRunByTheirCaptures) {
  TimeLeft estimate({{0, 0, 81}, {0, 1, 81}, {0, 1, 81}}, {{0}, {1}, {2}}, 1);
  estimate.begin(0, 0, 0);
  estimate.end(0, {0.08, 0.08, 0, 2});
  ASSERT_TRUE(estimate.at(0.08));
  EXPECT_NEAR(estimate.at(0.08)->seconds, 2 * 81 * 0.04, 1e-9);
  TimeLeft known({{0, 0, 11}, {0, 1, 101}}, {{0}, {1}}, 1);
  known.add_known(0, {1.1, 1.1, 0, 11});
  ASSERT_TRUE(known.at(0));
  EXPECT_NEAR(known.at(0)->seconds, 1.1 + 10.1, 1e-9);
}

TEST(TimeLeft, CountsFirstTrialsApart) {
  TimeLeft estimate({{0, 0}, {0, 0}, {0, 0}}, {{0}, {1}, {2}}, 1);
  estimate.begin(0, 0, 0);
  estimate.end(0, {5.3, 5.3, 5});
  ASSERT_TRUE(estimate.at(5.3));
  EXPECT_NEAR(estimate.at(5.3)->seconds, 0.6, 1e-9);
  EXPECT_NEAR(estimate.at(5.3)->most, 10.6, 1e-9);  // the long step may come again
  estimate.begin(0, 1, 5.3);
  estimate.end(0, {0.3, 0.3, 0});
  EXPECT_NEAR(estimate.at(5.6)->seconds, 0.3, 1e-9);
  EXPECT_LT(estimate.at(5.6)->most, 0.5);
}

TEST(TimeLeft, ExpectsTheFirstTrialOfEveryWorker) {
  // Worker 0 has run methods 0 and 1; worker 1 will have to learn them as well.
  TimeLeft estimate({{0, 0}, {0, 0}, {0, 0}}, {{0}, {1}, {2}}, 2);
  estimate.begin(0, 0, 0);
  estimate.end(0, {5, 5, 4});
  estimate.begin(0, 1, 5);
  estimate.end(0, {1, 1, 0});
  EXPECT_NEAR(estimate.at(6)->seconds, 1, 1e-9);
  estimate.begin(1, 2, 6);
  EXPECT_NEAR(estimate.at(6)->seconds, 5, 1e-9);
  EXPECT_NEAR(estimate.at(8)->seconds, 3, 1e-9);
}

TEST(TimeLeft, UsesTheTimesOfAnEarlierRunBeforeTheFirstTrial) {
  for (const std::size_t instances : {1, 2, 4, 20})
    for (const bool reports : {false, true}) {
      const Replay run = replay(instances, 2, earlier_trials(10), reports);
      ASSERT_TRUE(run.promises.front().left);
      EXPECT_NEAR(run.promises.front().left->seconds, run.end, 0.3 * run.end) << instances << " instances";
    }
}

TEST(TimeLeft, CountsALongStepOfEveryEarlierTrialOnce) {
  TimeLeft estimate({{0, 0}, {0, 0}}, {{0}, {1}}, 1);
  for (int i = 0; i < 3; ++i) estimate.add_known(0, {4, 4, 3});
  EXPECT_NEAR(estimate.at(0)->seconds, 8, 1e-9);
  // In one of three it looks like a preparation.
  TimeLeft learning({{0, 0}, {0, 0}}, {{0}, {1}}, 1);
  learning.add_known(0, {4, 4, 3});
  for (int i = 0; i < 2; ++i) learning.add_known(0, {1, 1, 0});
  EXPECT_NEAR(learning.at(0)->seconds, 5, 1e-9);
}

// 20 captures a trial, one every 0.5 s but the second, which takes 5 s; the lens is mounted after 2 s.
TEST(TimeLeft, PromisesFromTheFirstCapturesOfTheFirstTrial) {
  TimeLeft estimate({{0, 0, 20}, {0, 0, 20}}, {{0, 1}}, 1);
  estimate.begin(0, 0, 0);
  estimate.advance(0, 0, 2);
  estimate.advance(0, 1, 2.5);
  EXPECT_FALSE(estimate.at(2.5));  // one capture may be a preparation
  estimate.advance(0, 2, 7.5);
  estimate.advance(0, 3, 8);
  ASSERT_TRUE(estimate.at(8));
  EXPECT_NEAR(estimate.at(8)->seconds, 17 * 0.5 + 20 * 0.5, 1e-9);
  EXPECT_LT(estimate.at(8)->least, 13);
  EXPECT_GT(estimate.at(8)->most, 20);
  // Later reports do not shake it, and the end of the trial replaces it.
  estimate.advance(0, 10, 11.5);
  EXPECT_NEAR(estimate.at(11.5)->seconds, 10 * 0.5 + 20 * 0.5, 1e-9);
  estimate.end(0, {16.5, 14.5, 4.5, 20});
  EXPECT_NEAR(estimate.at(16.5)->seconds, 10, 1e-9);
}

TEST(TimeLeft, PromisesBeforeTheFirstTrialEndsWhereItsCapturesAreReported) {
  for (const std::size_t instances : {10, 20}) {
    const Replay run = replay(instances, 1, {}, true);
    double first = 0;
    for (const Replay::Promise& promise : run.promises)
      if (!promise.left) first = promise.at;
    EXPECT_LT(first, kMounting + kStarting + kLearning + 2.5);  // its first trial takes 12.9 s
    for (const double share : {0.25, 0.5, 0.75, 0.9})
      EXPECT_NEAR(run.at_share(share).seconds, (1 - share) * run.end, 0.3 * (1 - share) * run.end) << share;
  }
}

TEST(TimeLeft, RangeNarrowsAndHoldsTheEstimate) {
  const Replay run = replay(20, 2);
  for (const Replay::Promise& promise : run.promises)
    if (promise.left) {
      EXPECT_LE(promise.left->least, promise.left->seconds);
      EXPECT_GE(promise.left->most, promise.left->seconds);
    }
  const auto width = [](const Outlook& left) { return left.most / left.least; };
  EXPECT_LT(width(run.at_share(0.5)), 1.5);
  EXPECT_GT(width(run.at_share(0.1)), width(run.at_share(0.5)));
}

TEST(TimeLeft, OverdueTrialsStillTakeTime) {
  TimeLeft estimate({{0, 0}, {0, 0}}, {{0}, {1}}, 1);
  estimate.begin(0, 0, 0);
  estimate.end(0, {1, 1, 0});
  estimate.begin(0, 1, 1);
  EXPECT_NEAR(estimate.at(1.5)->seconds, 0.5, 1e-9);
  EXPECT_GT(estimate.at(11)->seconds, 0.5);
}

TEST(SpentTime, FindsASingleLongStep) {
  records::TrialTimes times;
  times.algorithm_seconds = {0, 5, 0.1, 0.1, 0.1};
  times.simulation_seconds = times.truth_seconds = {0.1, 0.1, 0.1, 0.1, 0.1};
  const SpentTime spent = spent_time(times, 9);
  EXPECT_NEAR(spent.total, 9, 1e-9);
  EXPECT_NEAR(spent.steps, 6.3, 1e-9);
  EXPECT_NEAR(spent.once, 5 - 0.3 / 4, 1e-9);
  EXPECT_EQ(spent.captures, 5);
  times.algorithm_seconds = {0, 1, 1, 1, 1};
  EXPECT_EQ(spent_time(times, 9).once, 0);
  times.algorithm_seconds[2] = records::kUnknown;
  EXPECT_EQ(spent_time(times, 9).steps, 9);
}

}  // namespace
}  // namespace relign::runner
