#include "runner/shard_status.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "records/results_folder.h"
#include "runner/shard_attempt.h"

namespace relign::runner {
namespace fs = std::filesystem;

namespace {

// The shard of a folder "shard-0003.HOST-BOOT"; `shards` for other names.
unsigned shard_of(const std::string& name, unsigned shards) {
  const std::string start = "shard-";
  const std::size_t dot = name.find('.');
  if (name.rfind(start, 0) != 0 || dot == std::string::npos) return shards;
  const std::string digits = name.substr(start.size(), dot - start.size());
  if (digits.empty() || digits.size() > 7 || digits.find_first_not_of("0123456789") != std::string::npos) return shards;
  return static_cast<unsigned>(std::min<unsigned long>(std::stoul(digits), shards));
}

}  // namespace

const char* to_string(ShardState state) {
  switch (state) {
    case ShardState::missing:
      return "missing";
    case ShardState::partly:
      return "partly";
    case ShardState::complete:
      break;
  }
  return "complete";
}

std::vector<ShardStatus> status_of_shards(const FrozenPlan& plan, const fs::path& results,
                                          const std::function<void(const std::string&)>& on_message) {
  std::vector<ShardStatus> all(plan.shards);
  std::error_code code;
  for (fs::directory_iterator entry(results, code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    const unsigned shard = shard_of(name, plan.shards);
    if (shard < plan.shards && entry->is_directory(code)) all[shard].attempts.push_back(name);
  }
  if (code && code != std::errc::no_such_file_or_directory)
    throw Error(ErrorKind::io, "cannot read the results folder '" + results.string() + "': " + code.message());
  for (unsigned number = 0; number < plan.shards; ++number) {
    ShardStatus& shard = all[number];
    std::sort(shard.attempts.begin(), shard.attempts.end());
    std::set<std::string> done;
    for (const std::string& attempt : shard.attempts) {
      require_plan(results / attempt, plan.hash);
      try {
        std::vector<records::Damage> damaged;
        done.merge(records::complete_trials(results / attempt, damaged));
        for (const records::Damage& damage : damaged) on_message("ignored: " + records::to_string(damage));
      } catch (const Error& error) {
        on_message(std::string("ignored: ") + error.what());
      }
    }
    const std::vector<std::string> ids = ids_of_shard(plan, number);
    shard.trials = ids.size();
    shard.done = static_cast<std::size_t>(
        std::count_if(ids.begin(), ids.end(), [&done](const std::string& id) { return done.count(id) > 0; }));
  }
  return all;
}

}  // namespace relign::runner
