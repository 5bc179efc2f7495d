#include "runner/time_left.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "runner/trial_queue.h"

namespace relign::runner {
namespace {

constexpr double kMounting = 1.2, kStarting = 0.4;
// Seconds in the steps of ten trials of each method, recorded on relign_od with 30 steps and two workers. The first of
// sensitivity on a worker has a step of 6.2 s in which it measures derivatives for all later trials.
constexpr double kLearning = 6.2;
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
  for (std::size_t i = 0; i < instances * kRecorded.size(); ++i) trials.push_back({0, i % kRecorded.size()});
  return trials;
}

std::vector<std::vector<std::size_t>> groups_of(std::size_t instances) {
  std::vector<std::vector<std::size_t>> groups(instances);
  for (std::size_t i = 0; i < instances * kRecorded.size(); ++i) groups[i / kRecorded.size()].push_back(i);
  return groups;
}

Replay replay(std::size_t instances, std::size_t count, const std::map<std::size_t, double>& known = {}) {
  struct Worker {
    std::size_t group = 0, mounted = TrialQueue::kNoGroup;
    std::vector<bool> learnt = std::vector<bool>(kRecorded.size());
    bool started = false, works = false;
    SpentTime spent;
    double free = 0;
  };
  TimeLeft estimate(plan_of(instances), groups_of(instances), count);
  for (const auto& [method, seconds] : known) estimate.add_known(method, seconds);
  TrialQueue queue(groups_of(instances));
  std::vector<Worker> workers(count);
  Replay result;
  for (double now = 0; now < 10000; now += 0.1) {
    std::size_t idle = 0;
    for (std::size_t number = 0; number < count; ++number) {
      Worker& worker = workers[number];
      if (worker.works && worker.free > now) continue;
      if (worker.works) estimate.end(number, worker.spent);
      worker.works = false;
      const std::optional<std::size_t> trial = queue.next(worker.group);
      if (!trial) {
        ++idle;
        continue;
      }
      const std::size_t method = *trial % kRecorded.size(), instance = *trial / kRecorded.size();
      const bool learns = method == 0 && !worker.learnt[method];
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
  known.add_known(0, 1.1);
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
  const std::map<std::size_t, double> known = {{0, 5.5}, {1, 3.8}, {2, 1.7}, {3, 1.8}, {4, 0.1}};
  const Replay run = replay(20, 2, known);
  ASSERT_TRUE(run.promises.front().left);
  EXPECT_NEAR(run.promises.front().left->seconds, run.end, 0.3 * run.end);
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
