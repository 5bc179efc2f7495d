// Where one attempt at a shard writes. Two attempts at the same shard can be alive at once: a cluster requeues a job
// whose node it has lost, and the node goes on. So each machine writes a folder of its own:
//   <results>/shard-0003.<host>-<boot>        a results folder like any other; boot: six digits of the machine's boot
//   id <results>/shard-0003.<host>-<boot>-2      while the first is being written, on the same machine
// An attempt goes on in its machine's folder where nobody writes it, and runs nothing that another folder of the shard
// has a complete record of. `merge` joins them all and compares what two of them did.
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
  // Complete in another attempt's folder and not in this one.
  const std::set<std::string>& done_elsewhere() const { return done_elsewhere_; }

 private:
  std::filesystem::path folder_;
  std::optional<records::ResultsLock> claim_;  // from before the first look until the run has ended
  std::set<std::string> done_elsewhere_;
};

// "shard-0003"
std::string shard_name(unsigned shard);

// Throws Error(bad_input) for a folder with results of another plan.
void require_plan(const std::filesystem::path& attempt, const std::string& plan_hash);

}  // namespace relign::runner
