// The results folder of one shard attempt. Two attempts at the same shard can run at once: a cluster requeues a job
// whose node it has lost, and the node continues. Therefore each machine writes a folder of its own:
//   <results>/shard-0003.<host>-<boot>     an ordinary results folder; boot: six digits of the machine's boot id
//   <results>/shard-0003.<host>-<boot>-2   on the same machine while the first one is being written
// An attempt continues its machine's folder unless another process is writing it, and skips trials that are complete in
// another folder of the shard. `merge` joins all of them and compares duplicates.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include "records/results_lock.h"

namespace relign::runner {

class ShardAttempt {
 public:
  // Throws Error(bad_input) when the folder holds attempts of another plan, Error(io).
  ShardAttempt(const std::filesystem::path& results, unsigned shard, const std::string& plan_hash,
               const std::function<void(const std::string&)>& on_message);

  const std::filesystem::path& folder() const { return folder_; }
  std::string name() const { return folder_.filename().string(); }
  // Trials that are complete in another attempt's folder but not in this one.
  const std::set<std::string>& done_elsewhere() const { return done_elsewhere_; }

 private:
  std::filesystem::path folder_;
  std::optional<records::ResultsLock> claim_;  // held from before reading the folder until the run has ended
  std::set<std::string> done_elsewhere_;
};

// "shard-0003"
std::string shard_name(unsigned shard);

// Throws Error(bad_input) for a folder with results of another plan.
void require_plan(const std::filesystem::path& attempt, const std::string& plan_hash);

}  // namespace relign::runner
