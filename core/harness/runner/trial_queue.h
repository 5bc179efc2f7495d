// Hands trials out to workers. Trials of one instance form a group: a worker stays with its group, so
// that a lens is mounted once for all algorithms, and helps another group only when none is untouched.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <vector>

namespace relign::runner {

class TrialQueue {
 public:
  // Groups of places in the plan, in the order to hand them out.
  explicit TrialQueue(std::vector<std::vector<std::size_t>> groups);

  // The next place for a worker; `group` is the worker's own memory, starting at kNoGroup. Thread-safe.
  static constexpr std::size_t kNoGroup = static_cast<std::size_t>(-1);
  std::optional<std::size_t> next(std::size_t& group);

 private:
  std::optional<std::size_t> take(std::size_t group);
  std::mutex mutex_;
  std::vector<std::vector<std::size_t>> groups_;
  std::vector<std::size_t> taken_;  // of each group
  std::size_t untouched_ = 0;       // first group that nobody has started
};

}  // namespace relign::runner
