// How far the parts of a plan are, by the records on disk: no queue knows better, and every queue says "failed" of jobs
// that did their work and "completed" of jobs that did not.
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
  std::size_t trials = 0;             // in the plan
  std::size_t done = 0;               // with a complete record in any attempt's folder
  std::vector<std::string> attempts;  // names of their folders

  ShardState state() const {
    if (done == trials) return ShardState::complete;
    return done == 0 ? ShardState::missing : ShardState::partly;
  }
};

const char* to_string(ShardState state);

// One entry a part. What cannot be read is told to `on_message` and does not count. A results folder that is not there
// has no attempts. Throws Error(bad_input) when it holds attempts of another plan.
std::vector<ShardStatus> status_of_shards(const FrozenPlan& plan, const std::filesystem::path& results,
                                          const std::function<void(const std::string&)>& on_message);

}  // namespace relign::runner
