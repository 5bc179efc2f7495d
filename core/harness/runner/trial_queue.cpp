#include "runner/trial_queue.h"

#include <utility>

namespace relign::runner {

TrialQueue::TrialQueue(std::vector<std::vector<std::size_t>> groups)
    : groups_(std::move(groups)), taken_(groups_.size(), 0) {}

std::optional<std::size_t> TrialQueue::take(std::size_t group) {
  if (group >= groups_.size() || taken_[group] == groups_[group].size()) return std::nullopt;
  return groups_[group][taken_[group]++];
}

std::optional<std::size_t> TrialQueue::next(std::size_t& group) {
  const std::lock_guard<std::mutex> hold(mutex_);
  if (auto place = take(group)) return place;
  while (untouched_ < groups_.size()) {
    group = untouched_++;
    if (auto place = take(group)) return place;
  }
  for (std::size_t other = 0; other < groups_.size(); ++other) {
    if (auto place = take(other)) {
      group = other;
      return place;
    }
  }
  return std::nullopt;
}

}  // namespace relign::runner
