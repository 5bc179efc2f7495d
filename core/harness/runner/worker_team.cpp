#include "runner/worker_team.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "base/machine.h"
#include "runner/trial_selection.h"

namespace relign::runner {

WorkerTeam::WorkerTeam(const PreparedPlan& plan, const PlanPretraining& learnt, const WorkerFactory& factory,
                       RunReporter& reporter, const std::atomic<bool>* stop, Record record)
    : plan_(plan), learnt_(learnt), factory_(factory), reporter_(reporter), stop_(stop), record_(std::move(record)) {}

void WorkerTeam::run(const std::vector<std::size_t>& todo, unsigned workers,
                     const std::map<std::size_t, SpentTime>& known) {
  if (todo.empty()) return;
  const unsigned cores = core_count();
  // A station is one machine: its trials run one after the other.
  const bool station = std::any_of(todo.begin(), todo.end(), [this](std::size_t place) {
    return plan_.scenes[plan_.plan.trials[place].scene].owns_stage;
  });
  if (station && workers > 1) reporter_.message("using one worker: a station runs one trial at a time");
  const std::size_t wanted = station ? 1 : workers == 0 ? cores : workers;
  const auto size = static_cast<unsigned>(std::min<std::size_t>(wanted, todo.size()));
  const unsigned threads = std::max(1U, cores / size);
  std::vector<std::vector<std::size_t>> groups = group_by_instance(plan_.plan, todo);
  for (std::vector<std::size_t>& group : groups)
    for (std::size_t& place : group) place = todo[place];
  reporter_.begin("trials", estimate(groups, size, known));
  // All begin with the same instance, so that the cost of every method is soon known. Each mounts it, so not if there
  // are few.
  constexpr std::size_t kManyGroups = 4;
  const std::size_t first = groups.size() < kManyGroups * size ? TrialQueue::kNoGroup : 0;
  TrialQueue queue(std::move(groups));
  std::vector<std::thread> team;
  try {
    for (unsigned number = 0; number < size; ++number)
      team.emplace_back([this, number, first, &queue, size, threads] {
        work(number, first, queue, size, threads);
        const std::lock_guard<std::mutex> hold(mutex_);
        ++workers_done_;
        worker_is_done_.notify_one();
      });
  } catch (const std::system_error&) {
    // Fewer threads than requested do the same work; without any, this thread does it.
    if (team.empty()) work(0, first, queue, size, threads);
  }
  wait_for(team);
  if (failure_) std::rethrow_exception(failure_);
}

TimeLeft WorkerTeam::estimate(const std::vector<std::vector<std::size_t>>& groups, unsigned workers,
                              const std::map<std::size_t, SpentTime>& known) const {
  std::vector<TimeLeft::Trial> trials;
  for (const suites::PlannedTrial& trial : plan_.plan.trials)
    trials.push_back({trial.scene, trial.scene * plan_.plan.suite.algorithms.size() + trial.algorithm,
                      plan_.plan.suite.algorithms[trial.algorithm].steps + 1.0});
  TimeLeft estimate(trials, groups, workers);
  for (const auto& [place, spent] : known) estimate.add_known(trials[place].method, spent);
  return estimate;
}

// Polls the stop flag here, because a worker may be waiting for a trial that hangs.
void WorkerTeam::wait_for(std::vector<std::thread>& team) {
  {
    std::unique_lock<std::mutex> hold(mutex_);
    while (workers_done_ < team.size()) {
      worker_is_done_.wait_for(hold, std::chrono::milliseconds(100));
      halt_when_stopped();
      hold.unlock();
      reporter_.refresh();
      hold.lock();
    }
  }
  for (std::thread& worker : team) worker.join();
}

void WorkerTeam::work(unsigned number, std::size_t group, TrialQueue& queue, unsigned workers, unsigned threads) {
  try {
    const std::unique_ptr<TrialWorker> worker = factory_.make(
        workers, threads, &halt_, [this, number](std::size_t captures) { reporter_.trial_advanced(number, captures); });
    double writing_seconds = 0;  // of the previous trial
    while (!halt_) {
      halt_when_stopped();
      if (halt_) break;
      const std::optional<std::size_t> place = queue.next(group);
      if (!place) break;
      run_trial(*worker, number, *place, writing_seconds);
    }
  } catch (...) {
    const std::lock_guard<std::mutex> hold(mutex_);
    if (!failure_) failure_ = std::current_exception();
    halt_ = true;
  }
}

void WorkerTeam::run_trial(TrialWorker& worker, unsigned number, std::size_t place, double& writing_seconds) {
  const suites::PlannedTrial& trial = plan_.plan.trials[place];
  reporter_.trial_begun(number, place);
  WorkedTrial worked = worker.run(trial, learnt_.of(trial));
  if (worked.stopped) return;
  worked.times.harness_seconds += writing_seconds;
  const auto begin = std::chrono::steady_clock::now();
  record_(place, worked);
  writing_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  reporter_.trial_finished(number, records::ended_well(worked.record.end), worked.times);
}

}  // namespace relign::runner
