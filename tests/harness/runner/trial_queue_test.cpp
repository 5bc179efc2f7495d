#include "runner/trial_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

namespace relign::runner {
namespace {

TEST(TrialQueue, WorkerStaysWithItsGroup) {
  TrialQueue queue({{0, 6}, {1, 7}, {2, 8}});
  std::size_t first = TrialQueue::kNoGroup;
  std::size_t second = TrialQueue::kNoGroup;
  EXPECT_EQ(queue.next(first), 0U);
  EXPECT_EQ(queue.next(second), 1U);
  EXPECT_EQ(queue.next(first), 6U);
  EXPECT_EQ(queue.next(first), 2U);
  // All groups have started: the second worker takes remaining trials, those of its own group first.
  EXPECT_EQ(queue.next(second), 7U);
  EXPECT_EQ(queue.next(second), 8U);
  EXPECT_EQ(queue.next(second), std::nullopt);
  EXPECT_EQ(queue.next(first), std::nullopt);
}

TEST(TrialQueue, ManyWorkersTakeEveryTrialExactlyOnce) {
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t group = 0; group < 50; ++group) groups.push_back({3 * group, 3 * group + 1, 3 * group + 2});
  TrialQueue queue(groups);
  std::vector<std::vector<std::size_t>> taken(4);
  std::vector<std::thread> workers;
  for (auto& mine : taken)
    workers.emplace_back([&queue, &mine] {
      std::size_t group = TrialQueue::kNoGroup;
      while (const auto place = queue.next(group)) mine.push_back(*place);
    });
  for (std::thread& worker : workers) worker.join();
  std::multiset<std::size_t> all;
  for (const auto& mine : taken) all.insert(mine.begin(), mine.end());
  EXPECT_EQ(all.size(), 150U);
  EXPECT_EQ(std::set<std::size_t>(all.begin(), all.end()).size(), 150U);
}

TEST(TrialQueue, WorkersMayJoinTheFirstGroup) {
  TrialQueue queue({{0, 5}, {1}, {2}});
  std::size_t first = 0;
  std::size_t second = 0;
  EXPECT_EQ(queue.next(first), 0U);
  EXPECT_EQ(queue.next(second), 5U);
  EXPECT_EQ(queue.next(second), 1U);
  EXPECT_EQ(queue.next(first), 2U);
  EXPECT_EQ(queue.next(first), std::nullopt);
}

TEST(TrialQueue, MayBeEmpty) {
  TrialQueue queue({});
  std::size_t group = TrialQueue::kNoGroup;
  EXPECT_EQ(queue.next(group), std::nullopt);
}

}  // namespace
}  // namespace relign::runner
