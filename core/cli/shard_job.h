// `run --plan P --shard i/n`: which trials these are, and where this attempt writes them.
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
  // `shard` is "i/n". Throws Error(bad_input) when n is not the plan's own number of parts: how a plan is cut must not
  // depend on what a queue says while a part of it is sent again.
  ShardJob(const std::string& plan_file, const std::string& shard);

  suites::Suite read_suite(plugin_host::Catalog& catalog) const;
  const std::string& name() const { return plan_.name; }

  // Leaves in `prepared` the trials of this part that no other attempt has done, and returns the attempt, which is to
  // be kept until they have run. Throws Error(bad_input) when plugins or data are others than the plan's.
  std::unique_ptr<runner::ShardAttempt> begin(const std::filesystem::path& results, runner::PreparedPlan& prepared,
                                              const std::function<void(const std::string&)>& on_message) const;

 private:
  runner::FrozenPlan plan_;
  unsigned number_ = 0;
};

}  // namespace relign::cli
