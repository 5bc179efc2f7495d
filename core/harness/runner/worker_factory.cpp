#include "runner/worker_factory.h"

#include <algorithm>

#include "base/machine.h"
#include "runner/thread_worker.h"

namespace relign::runner {

std::unique_ptr<TrialWorker> WorkerFactory::make(unsigned workers, unsigned threads, const std::atomic<bool>* stop,
                                                 const OnCaptures& on_captures) const {
  if (options_.worker_program.empty())
    return std::make_unique<ThreadWorker>(plan_, options_of(threads, stop, on_captures));
  return make_process(workers, threads, stop, on_captures);
}

std::unique_ptr<ProcessWorker> WorkerFactory::make_process(unsigned workers, unsigned threads,
                                                           const std::atomic<bool>* stop,
                                                           const OnCaptures& on_captures) const {
  return std::make_unique<ProcessWorker>(plan_, hashes_, options_.worker_program, limits(workers),
                                         options_of(threads, stop, on_captures));
}

WorkerOptions WorkerFactory::options_of(unsigned threads, const std::atomic<bool>* stop,
                                        const OnCaptures& on_captures) const {
  WorkerOptions options;
  options.threads = threads;
  options.results = options_.results;
  options.cache_folder = options_.cache_folder;
  options.on_message = reporter_.on_message();
  options.on_captures = on_captures;
  options.stop = stop;
  options.sandbox = options_.sandbox;
  return options;
}

ProcessWorker::Limits WorkerFactory::limits(unsigned workers) const {
  constexpr double kShareOfMachine = 0.8;
  const suites::Suite& suite = plan_.plan.suite;
  const auto machine = static_cast<std::size_t>(kShareOfMachine * static_cast<double>(usable_memory_bytes()));
  ProcessWorker::Limits limits;
  limits.trial_seconds = suite.trial_seconds;
  limits.memory_bytes = suite.trial_memory_mb > 0 ? std::size_t{suite.trial_memory_mb} * 1'000'000 : machine;
  limits.spare_bytes = std::min(limits.memory_bytes, machine / workers) / 2;
  return limits;
}

}  // namespace relign::runner
