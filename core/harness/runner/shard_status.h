// The state of a plan's shards by the records on disk. The states of a cluster's queue are unreliable: it may report
// "failed" for jobs that did their work, and "completed" for jobs that did not.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "runner/frozen_plan.h"

namespace relign::runner {

enum class ShardState { missing, partly, complete };

struct ShardStatus {
  std::size_t trials = 0;             // planned
  std::size_t done = 0;               // with a complete record in any attempt's folder
  std::vector<std::string> attempts;  // names of their folders

  ShardState state() const {
    if (done == trials) return ShardState::complete;
    return done == 0 ? ShardState::missing : ShardState::partly;
  }
};

const char* to_string(ShardState state);

// One entry per shard. Unreadable folders do not count and are reported to `on_message`. A missing results folder has
// no attempts. Throws Error(bad_input) when it holds attempts of another plan.
std::vector<ShardStatus> status_of_shards(const FrozenPlan& plan, const std::filesystem::path& results,
                                          const std::function<void(const std::string&)>& on_message);

}  // namespace relign::runner
