// Shares out trials among the workers of a run, one thread of this process for each worker.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "runner/plan_pretraining.h"
#include "runner/trial_queue.h"
#include "runner/worker_factory.h"

namespace relign::runner {

class WorkerTeam {
 public:
  // Writes the result of the trial at this position of the plan. Called by several threads at once.
  using Record = std::function<void(std::size_t place, WorkedTrial& worked)>;
  // All must outlive this object; `stop` may be null.
  WorkerTeam(const PreparedPlan& plan, const PlanPretraining& learnt, const WorkerFactory& factory,
             RunReporter& reporter, const std::atomic<bool>* stop, Record record);

  // Runs the trials at these positions with up to `workers` workers (0: one per core). Returns early after a stop;
  // unfinished trials are then not recorded. Rethrows the first failure that concerns more than one trial.
  // `known`: trials of an earlier run, by position, for the estimate of the time left.
  void run(const std::vector<std::size_t>& todo, unsigned workers, const std::map<std::size_t, SpentTime>& known = {});

 private:
  void work(unsigned number, std::size_t group, TrialQueue& queue, unsigned workers, unsigned threads);
  void run_trial(TrialWorker& worker, unsigned number, std::size_t place, double& writing_seconds);
  TimeLeft estimate(const std::vector<std::vector<std::size_t>>& groups, unsigned workers,
                    const std::map<std::size_t, SpentTime>& known) const;
  void wait_for(std::vector<std::thread>& team);
  void halt_when_stopped() {
    if (stop_ && stop_->load()) halt_ = true;
  }

  const PreparedPlan& plan_;
  const PlanPretraining& learnt_;
  const WorkerFactory& factory_;
  RunReporter& reporter_;
  const std::atomic<bool>* stop_;
  Record record_;
  std::atomic<bool> halt_{false};  // stopped, or a worker failed: workers check it before each step
  std::mutex mutex_;               // guards the members below
  std::condition_variable worker_is_done_;
  std::size_t workers_done_ = 0;
  std::exception_ptr failure_;
};

}  // namespace relign::runner
