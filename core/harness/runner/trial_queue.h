// Hands out trials to workers. Trials of one instance form a group: a worker stays with its group, so
// that a lens is mounted once for all algorithms, and joins another worker's group only when all groups have started.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <vector>

namespace relign::runner {

class TrialQueue {
 public:
  // Groups of positions in the plan, in the order in which they are handed out.
  explicit TrialQueue(std::vector<std::vector<std::size_t>> groups);

  // The next position for a worker; `group` is the worker's state, initially kNoGroup, or a group to join. Thread-safe.
  static constexpr std::size_t kNoGroup = static_cast<std::size_t>(-1);
  std::optional<std::size_t> next(std::size_t& group);

 private:
  std::optional<std::size_t> take(std::size_t group);
  std::mutex mutex_;
  std::vector<std::vector<std::size_t>> groups_;
  std::vector<std::size_t> taken_;  // of each group
  std::size_t untouched_ = 0;       // first group that has not started
};

}  // namespace relign::runner
