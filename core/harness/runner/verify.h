// Replays trials of a results folder from its manifest, and compares every recorded line (except host times) bit for
// bit.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "plugin_host/catalog.h"
#include "records/damage.h"
#include "records/difference.h"
#include "records/folder_checks.h"
#include "records/replays.h"
#include "trials/scene_facts.h"
#include "trials/trial.h"

namespace relign::runner {

struct VerifyOptions {
  std::filesystem::path results;
  std::size_t sample = 0;  // number of trials; 0: all
  std::uint64_t seed = 1;  // of the sample
  std::string trial;       // not empty: only this trial
  // The folder to which relative paths of the suite refer; empty: that of the suite file in the manifest.
  std::filesystem::path suite_folder;
  std::string secret;    // of a sealed suite; empty: the manifest's
  unsigned workers = 0;  // 0: all cores
  std::filesystem::path cache_folder;
  const std::atomic<bool>* stop = nullptr;
  std::shared_ptr<const plugin_host::Sandbox> sandbox;                   // for algorithms; null: none
  std::function<void(const std::string&)> on_message;                    // any thread, one at a time
  std::function<void(std::size_t done, std::size_t total)> on_progress;  // the same
  // Every capture of a replayed trial; with one trial in one thread.
  std::function<void(const trials::SceneFacts&, const trials::Step&, const float* pixels)> on_step;
};

// A difference between the environment of the recorded trials and this one. Hashes are shortened.
struct Change {
  std::string what, was, is;
  bool operator<(const Change& other) const {
    return std::tie(what, was, is) < std::tie(other.what, other.was, other.is);
  }
};

struct ReplayDifference {
  std::string trial, label;  // label: "compass on relign_od rho0.25 #3"
  records::Difference difference;
  bool tolerated_more = false;  // it exceeds kOtherCpuTolerance, with which it was compared
};

struct VerifySummary {
  std::size_t recorded = 0;  // complete trials of the plan
  std::size_t missing = 0;   // of the plan, without a complete record; not counted with `trial`
  std::size_t replayed = 0, equal = 0;
  std::size_t with_tolerance = 0;        // of `equal`: only within kOtherCpuTolerance, on another processor
  double largest_deviation = 0;          // among these, |is - was| / (1 + |was|)
  records::NotCompared not_compared;     // columns that the build of replayed trials did not have yet
  std::size_t stations = 0;              // cannot be replayed: recorded on hardware
  std::size_t ended_by_machine = 0;      // cannot be replayed: ended by a crash or a limit of time or memory
  std::size_t unknown = 0;               // not in the suite as it is now, because data or definitions changed
  std::vector<records::Damage> damaged;  // not replayed
  std::vector<ReplayDifference> differences;
  std::vector<Change> changes;
  records::Checks checks;
  std::map<std::pair<std::string, std::string>, records::ReplayCounts> methods;  // by name and protocol
  bool stopped = false;

  bool all_equal() const {
    return differences.empty() && unknown == 0 && damaged.empty() && !records::any_failed(checks);
  }
  // Nothing speaks for the results, and nothing against them.
  bool nothing() const { return replayed == 0 && stations == 0 && all_equal(); }
};

// Throws Error: bad_input for a folder that is not a results folder or newer, a suite that can no longer be
// read, and a trial that does not exist or cannot be replayed; plugin_rejected; io.
VerifySummary verify(const VerifyOptions& options, plugin_host::Catalog& catalog);

}  // namespace relign::runner
