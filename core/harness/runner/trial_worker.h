// Interface of the workers of `run`: threads of the program (thread_worker.h) or processes (worker_process.h). One per
// thread of the coordinator.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "records/record.h"
#include "runner/pretraining.h"
#include "runner/run.h"

namespace relign::runner {

// A finished trial, ready to be written.
struct WorkedTrial {
  records::TrialRecord record;  // without the steps
  std::string step_lines;       // each with its newline
  std::size_t steps = 0;
  records::TrialTimes times;  // plugin hashes not filled in
  std::string log;
  bool stopped = false;  // ended by a stop: does not count
};

class TrialWorker {
 public:
  TrialWorker() = default;
  virtual ~TrialWorker() = default;
  TrialWorker(const TrialWorker&) = delete;
  TrialWorker& operator=(const TrialWorker&) = delete;

  // `prepared`: pretrained data of the trial's algorithm; may be null. Faults of plugins are in the record; throws
  // Error for failures that concern more than this trial (a library that cannot be loaded, a worker that cannot be
  // started).
  virtual WorkedTrial run(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared) = 0;
};

struct WorkerOptions {
  unsigned threads = 1;           // for the scene
  std::filesystem::path results;  // for captures of a station
  std::filesystem::path cache_folder;
  std::function<void(const std::string&)> on_message;  // any thread
  // The running trial has mounted its lens and made this many captures; soon after each, from the worker's thread.
  std::function<void(std::size_t captures)> on_captures;
  const std::atomic<bool>* stop = nullptr;
  std::shared_ptr<const plugin_host::Sandbox> sandbox;  // for algorithms; null: none
};

}  // namespace relign::runner
