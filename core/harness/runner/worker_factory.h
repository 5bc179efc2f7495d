// Makes the workers of a run: processes with the suite's limits, or threads of this process.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>

#include "runner/provenance.h"
#include "runner/run_reporter.h"
#include "runner/worker_process.h"

namespace relign::runner {

class WorkerFactory {
 public:
  // All must outlive this object and its workers.
  WorkerFactory(const PreparedPlan& plan, const RunOptions& options, const LibraryHashes& hashes, RunReporter& reporter)
      : plan_(plan), options_(options), hashes_(hashes), reporter_(reporter) {}

  using OnCaptures = std::function<void(std::size_t)>;
  // One of `workers` that run at once, with `threads` for the scene. A worker stops soon after `stop` becomes true; it
  // may be null.
  std::unique_ptr<TrialWorker> make(unsigned workers, unsigned threads, const std::atomic<bool>* stop,
                                    const OnCaptures& on_captures) const;
  // The same as a process, for a run whose options have a worker_program.
  std::unique_ptr<ProcessWorker> make_process(unsigned workers, unsigned threads, const std::atomic<bool>* stop,
                                              const OnCaptures& on_captures = {}) const;

 private:
  WorkerOptions options_of(unsigned threads, const std::atomic<bool>* stop, const OnCaptures& on_captures) const;
  ProcessWorker::Limits limits(unsigned workers) const;

  const PreparedPlan& plan_;
  const RunOptions& options_;
  const LibraryHashes& hashes_;
  RunReporter& reporter_;
};

}  // namespace relign::runner
