// Runs a plan: all algorithms on the same instances, resumable by trial id, with pictures at the end.
// Workers are processes (worker_process.h), or threads (thread_worker.h).
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "plugin_host/catalog.h"
#include "records/manifest.h"
#include "runner/time_left.h"
#include "suites/plan.h"
#include "trials/scene_facts.h"

namespace relign::runner {

struct Progress {
  std::size_t total = 0;  // trials of this run
  std::size_t done = 0;   // finished in this run or before
  std::size_t failed = 0;
  std::size_t reused = 0;  // finished before
  double seconds = 0;      // since the start
  std::string doing;       // current activity: "trials", "pictures"
  bool estimates = false;  // `left` is the time left of `doing`, or nothing while it is being measured
  std::optional<Outlook> left;
};

struct RunOptions {
  std::filesystem::path results;  // folder
  unsigned workers = 0;           // 0: all cores
  // The command that runs run_worker() (worker.h). Empty: workers are threads of this process, without the suite's
  // limits of time and memory.
  std::vector<std::string> worker_program;
  bool retry_failed = false;  // run finished trials that failed again
  bool drop_damaged = false;  // remove damaged records of an earlier run, and run their trials again
  // key=value: scene, noise_level, algorithm, protocol, instance. Values of one key are alternatives; different keys
  // must all match.
  std::vector<std::pair<std::string, std::string>> only;
  std::filesystem::path cache_folder;
  std::string command;                                  // for manifest.json: the command to repeat this run
  std::shared_ptr<const plugin_host::Sandbox> sandbox;  // for algorithms; null: none
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const Progress&)> on_progress;    // any thread, one at a time
  std::function<void(const std::string&)> on_message;  // warnings, notes such as "compass changed: 30 trials
                                                       // rerun"; any thread, one at a time
  // Draws the cross-section of a scene's lens as SVG for reports; "" where there is none. A function of the caller,
  // because this module does not depend on optics.
  std::function<std::string(const plugin_host::Choice& scene)> draw_lens;
};

struct RunSummary {
  std::size_t trials = 0;
  std::size_t finished = 0;
  std::size_t reused = 0;
  std::size_t failed = 0;
  bool stopped = false;
  double seconds = 0;
  std::vector<std::string> failures;  // "trial 4f1c... compass on relign_od rho0.25 #3: timeout: message"
  std::set<std::string> failed_ends;  // of these trials: "timeout"
};

struct PreparedPlan {
  suites::Plan plan;
  std::vector<trials::SceneFacts> scenes;   // one per scene of the suite
  std::vector<std::string> scene_identity;  // canonical JSON: hashes of the data files behind each scene
  // By name: most bytes that this process had while the scene was created.
  std::map<std::string, std::uint64_t> scene_memory;
  std::optional<records::Shard> shard;  // for manifest.json, if these are the trials of a shard
};

// Creates each scene once (which fills the cache of reference images), draws once from every noise level and loads
// every algorithm, so that errors are found before the first trial. Throws Error; Error(stopped) soon after `stop`
// becomes true.
PreparedPlan prepare(suites::Suite suite, const std::filesystem::path& cache_folder,
                     const std::function<void(const std::string&)>& on_message = {},
                     const std::atomic<bool>* stop = nullptr,
                     std::shared_ptr<const plugin_host::Sandbox> sandbox = nullptr);

// Throws Error(bad_input) for an `only` without matches and for damaged records without drop_damaged, Error(io) for the
// folder. A fault of an algorithm is a failed trial, not an exception.
RunSummary run(const PreparedPlan& prepared, const RunOptions& options);

// Names and hashes of the data files of a scene as canonical JSON: its identity in addition to its Choice.
std::string data_identity(const trials::SceneFacts& facts);

// The folder of a scene's files within the results: "scenes/<hash>".
std::string scene_folder(const PreparedPlan& prepared, std::size_t scene);

}  // namespace relign::runner
