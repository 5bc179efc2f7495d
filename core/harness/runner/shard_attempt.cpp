#include "runner/shard_attempt.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <fstream>
#include <iterator>
#include <vector>

#include "base/error.h"
#include "base/json_source.h"
#include "records/results_folder.h"

namespace relign::runner {
namespace fs = std::filesystem;

namespace {

// Identifies the running kernel, beyond which file locks are not reliable: machines of equal names, and one machine
// before and after a reboot, get different folders.
std::string machine_name() {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  std::string name(host);
  name = name.substr(0, std::min<std::size_t>(name.find('.'), 40));
  for (char& letter : name)
    if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string boot;
  file >> boot;
  return (name.empty() ? "host" : name) + "-" + (boot.empty() ? "000000" : boot.substr(0, 6));
}

std::set<std::string> complete_trials(const fs::path& folder, const std::function<void(const std::string&)>& notify) {
  const auto run_again = [&notify](const std::string& why) {
    if (notify) notify("trials of an earlier attempt run again: " + why);
  };
  try {
    std::vector<records::Damage> damaged;
    const std::set<std::string> complete = records::complete_trials(folder, damaged);
    for (const records::Damage& damage : damaged) run_again(records::to_string(damage));
    return complete;
  } catch (const Error& error) {
    run_again(error.what());
    return {};
  }
}

}  // namespace

std::string shard_name(unsigned shard) {
  const std::string digits = std::to_string(shard);
  return "shard-" + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

void require_plan(const fs::path& attempt, const std::string& plan_hash) {
  const std::optional<records::Manifest> manifest = records::read_manifest(attempt);
  if (!manifest) return;  // killed before it wrote anything
  if (manifest->shard && manifest->shard->plan == plan_hash) return;
  throw Error(ErrorKind::bad_input,
              attempt.string() + " has results of another plan; choose another folder with --out");
}

ShardAttempt::ShardAttempt(const fs::path& results, unsigned shard, const std::string& plan_hash,
                           const std::function<void(const std::string&)>& on_message) {
  std::error_code code;
  fs::create_directories(results, code);
  if (code)
    throw Error(ErrorKind::io, "cannot create the results folder '" + results.string() + "': " + code.message());
  const std::string start = shard_name(shard) + ".";
  const std::string own = start + machine_name();
  for (unsigned attempt = 1; !claim_; ++attempt) {
    const std::string name = own + (attempt == 1 ? "" : "-" + std::to_string(attempt));
    try {
      claim_.emplace(results, "." + name + ".claim");
    } catch (const records::FolderInUse&) {
      continue;
    }
    folder_ = results / name;
    // Without locks it is unknown whether the folder is being written, so that it is not shared.
    if (!claim_->held())
      folder_ += "-" + std::to_string(::getpid()) + "-" +
                 std::to_string(std::chrono::system_clock::now().time_since_epoch().count());
  }
  std::vector<fs::path> others;
  for (fs::directory_iterator entry(results, code), end; !code && entry != end; entry.increment(code)) {
    if (entry->path().filename().string().rfind(start, 0) != 0) continue;
    require_plan(entry->path(), plan_hash);
    if (entry->path().filename() != folder_.filename()) others.push_back(entry->path());
  }
  if (others.empty()) return;
  const std::set<std::string> mine = fs::exists(folder_, code) ? complete_trials(folder_, {}) : std::set<std::string>();
  for (const fs::path& other : others)
    for (const std::string& trial : complete_trials(other, on_message))
      if (!mine.count(trial)) done_elsewhere_.insert(trial);
}

}  // namespace relign::runner
