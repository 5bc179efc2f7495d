// Replays trials of a results folder from what its manifest keeps, and compares every recorded line, host times aside,
// bit for bit.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "plugin_host/catalog.h"
#include "records/compare.h"
#include "trials/scene_facts.h"
#include "trials/trial.h"

namespace relign::runner {

struct VerifyOptions {
  std::filesystem::path results;
  std::size_t sample = 0;  // how many trials; 0: all
  std::uint64_t seed = 1;  // which ones
  std::string trial;       // not empty: this one alone
  // Only trials that lack what the rules "best" and "current" need (records::lacks_rules); to those that are equal in
  // what they have it is added.
  bool add_rules = false;
  // What relative paths of the suite are below; empty: the suite file's folder as the manifest names it.
  std::filesystem::path suite_folder;
  unsigned workers = 0;  // 0: all cores
  std::filesystem::path cache_folder;
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const std::string&)> on_message;                    // any thread, one at a time
  std::function<void(std::size_t done, std::size_t total)> on_progress;  // the same
  // Every capture of a replayed trial; with one trial in one thread.
  std::function<void(const trials::SceneFacts&, const trials::Step&, const float* pixels)> on_step;
};

// What is not as it was when the trials were made. Hashes are shortened.
struct Change {
  std::string what, was, is;
  bool operator<(const Change& other) const {
    return std::tie(what, was, is) < std::tie(other.what, other.was, other.is);
  }
};

struct ReplayDifference {
  std::string trial, label;  // label: "compass on relign_od rho0.25 #3"
  records::Difference difference;
  bool tolerated_more = false;  // it was compared with kOtherCpuTolerance and is beyond it
};

struct VerifySummary {
  std::size_t recorded = 0;  // complete trials of the plan
  std::size_t replayed = 0, equal = 0;
  std::size_t with_tolerance = 0;    // of those equal: within kOtherCpuTolerance, their plugins promise no more here
  double largest_deviation = 0;      // among these, |is - was| / (1 + |was|)
  std::size_t stations = 0;          // cannot be replayed: a machine made them
  std::size_t ended_by_machine = 0;  // a crash, a time or memory limit: what ended them is not in the record
  std::size_t unknown = 0;           // the suite as it is here now has no such trial: data or definitions changed
  std::size_t completed = 0;         // with add_rules: records that have all rules now
  std::vector<ReplayDifference> differences;
  std::vector<Change> changes;
  bool stopped = false;

  bool all_equal() const { return differences.empty() && unknown == 0; }
};

// Throws Error: bad_input for a folder that is none, newer or damaged, a suite that cannot be read here any more, and a
// trial that is not there or cannot be replayed; plugin_refused; io.
VerifySummary verify(const VerifyOptions& options, plugin_host::Catalog& catalog);

}  // namespace relign::runner
