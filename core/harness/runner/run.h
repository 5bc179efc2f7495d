// Runs a plan: every trial on the same instances, resumable by trial id, with pictures at the end.
// Workers are processes (worker_process.h), or threads (thread_worker.h).
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "plugin_host/catalog.h"
#include "suites/plan.h"
#include "trials/scene_facts.h"

namespace relign::runner {

struct Progress {
  std::size_t total = 0;  // trials of this run
  std::size_t done = 0;   // finished now or found finished
  std::size_t failed = 0;
  std::size_t reused = 0;  // found finished
  double seconds = 0;      // since the start
  std::string doing;       // "trials", "pictures"
};

struct RunOptions {
  std::filesystem::path results;  // folder
  unsigned workers = 0;           // 0: all cores
  // The command that runs run_worker() (worker.h). Empty: workers are threads of this process, and the suite's limits
  // of a trial's time and memory do not hold.
  std::vector<std::string> worker_program;
  bool retry_failed = false;  // finished trials that ended in a failure run again
  // key=value: scene, noise_level, algorithm, protocol, instance. Values of one key add up, keys narrow down.
  std::vector<std::pair<std::string, std::string>> only;
  std::filesystem::path cache_folder;
  std::string command;  // for manifest.json: how to run this again
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const Progress&)> on_progress;    // any thread, one at a time
  std::function<void(const std::string&)> on_message;  // warnings, notes such as "compass changed: 30 trials
                                                       // rerun"; any thread, one at a time
  // The lens of a scene in section, as SVG, for reports; "" where there is none to draw. Optics are not known here.
  std::function<std::string(const plugin_host::Choice& scene)> draw_lens;
};

struct RunSummary {
  std::size_t trials = 0;
  std::size_t finished = 0;
  std::size_t reused = 0;
  std::size_t failed = 0;
  bool stopped = false;
  double seconds = 0;
  std::vector<std::string> failures;  // "trial 4f1c... compass on relign_od rho0.25 #3: message"
};

struct PreparedPlan {
  suites::Plan plan;
  std::vector<trials::SceneFacts> scenes;     // one per suite scene
  std::vector<std::string> scene_identity;  // canonical JSON: hashes of the data files behind each scene
  Json shard = nullptr;                     // for manifest.json, where these are the trials of a part of a plan
};

// Creates each scene once (which fills the cache of reference images), asks every noise level for one
// draw and loads every algorithm, so that what cannot work is known before the first trial. Throws Error;
// Error(stopped) soon after `stop` is up.
PreparedPlan prepare(suites::Suite suite, const std::filesystem::path& cache_folder,
                     const std::function<void(const std::string&)>& on_message = {},
                     const std::atomic<bool>* stop = nullptr);

// Throws Error(bad_input) for an `only` that names nothing, Error(io) for the folder. What an algorithm
// does wrong is a failed trial, never an exception.
RunSummary run(const PreparedPlan& prepared, const RunOptions& options);

// Names and contents of the data files behind a scene, as canonical JSON: what identifies it beyond its Choice.
std::string data_identity(const trials::SceneFacts& facts);

// The folder of a scene's own files below the results: "scenes/<hash>".
std::string scene_folder(const PreparedPlan& prepared, std::size_t scene);

}  // namespace relign::runner
