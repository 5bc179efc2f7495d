// `run --plan P --shard i/n`: the trials of a shard and the folder of this attempt.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "plugin_host/catalog.h"
#include "runner/frozen_plan.h"
#include "runner/run.h"
#include "runner/shard_attempt.h"

namespace relign::cli {

class ShardJob {
 public:
  // `shard` is "i/n". Throws Error(bad_input) if n is not the plan's number of shards: the division must not depend on
  // the size of the job array with which some shards are resubmitted. So does a plan of a sandbox unless `sandboxed`.
  ShardJob(const std::string& plan_file, const std::string& shard, bool sandboxed);

  suites::Suite read_suite(plugin_host::Catalog& catalog) const;
  const std::string& name() const { return plan_.name; }

  // Reduces `prepared` to the trials of this shard that no other attempt has completed and returns the attempt, which
  // must be kept until they have run. Throws Error(bad_input) if plugins or data differ from the plan's.
  std::unique_ptr<runner::ShardAttempt> begin(const std::filesystem::path& results, runner::PreparedPlan& prepared,
                                              const std::function<void(const std::string&)>& on_message) const;

 private:
  runner::FrozenPlan plan_;
  unsigned number_ = 0;
};

}  // namespace relign::cli
