// What `run` hands trials to: a thread of the program (thread_worker.h) or a process of its own (worker_process.h). One
// per thread of the coordinator.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>

#include "records/record.h"
#include "runner/preparation.h"
#include "runner/run.h"

namespace relign::runner {

// A trial as it will be written.
struct WorkedTrial {
  records::TrialRecord record;  // all but the steps
  std::string step_lines;       // each with its newline
  std::size_t steps = 0;
  records::TrialTimes times;  // plugin hashes not filled in
  std::string log;
  bool stopped = false;  // was asked to stop: no result
};

class TrialWorker {
 public:
  TrialWorker() = default;
  virtual ~TrialWorker() = default;
  TrialWorker(const TrialWorker&) = delete;
  TrialWorker& operator=(const TrialWorker&) = delete;

  // `prepared`: what the trial's algorithm loads; null: nothing. Whatever a plugin does is in the record; throws Error
  // for what concerns more than this trial (a library that cannot be loaded, a worker that cannot be started).
  virtual WorkedTrial run(const suites::PlannedTrial& trial, const Preparer::Entries* prepared) = 0;
};

struct WorkerOptions {
  unsigned threads = 1;           // for the scene's own work
  std::filesystem::path results;  // for the captures of a station
  std::filesystem::path cache_folder;
  std::function<void(const std::string&)> on_message;  // any thread
  const std::atomic<bool>* stop = nullptr;
};

}  // namespace relign::runner
