// A worker in a process (worker.h): a fault of a plugin ends its trial, not the run.
//
//   it crashes or exits                      crashed(SIGSEGV), crashed(exit 0)
//   it exceeds the time limit of a trial     timeout
//   it exceeds the memory limit of a trial   out_of_memory
//   it writes into our connection            protocol_error
//   it never stops asking for steps          overspent
// Finished steps are kept. A trial must not be blamed for an earlier one: a crash in a worker that ran other trials
// before counts only when it happens again in a new worker. A worker killed by a SIGKILL that we did not send (by a
// user, or a system short of memory) is lost, and its trial runs again, at most twice. A plugin's own process killed so
// is a crash: it could have killed itself, to have another run.
#pragma once

#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "plugin_host/process_child.h"
#include "runner/provenance.h"
#include "runner/trial_worker.h"

namespace relign::runner {

class ProcessWorker final : public TrialWorker {
 public:
  struct Limits {
    double trial_seconds = 3600;   // for a trial, and separately for creating its scene and lens
    std::size_t memory_bytes = 0;  // for the worker and its processes; 0: no limit
    std::size_t spare_bytes = 0;   // a worker with more memory in use after a trial is replaced; 0: never
  };
  // `program` runs run_worker().
  ProcessWorker(const PreparedPlan& plan, const LibraryHashes& hashes, std::vector<std::string> program, Limits limits,
                WorkerOptions options);
  ~ProcessWorker() override;
  WorkedTrial run(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared) override;
  // Pretrained data of the trial's algorithm: from the cache, or made in the worker with a trial's limits for each
  // source. If the worker ends, the entries have a failure. Throws Error as Pretrainer::prepare does.
  Pretrainer::Entries prepare(const suites::PlannedTrial& trial);

 private:
  enum class Fate { finished, blamed, lost, stopped };
  struct Attempt;
  using Group = std::tuple<std::size_t, std::size_t, std::size_t>;

  void start();
  bool started();
  void stop_worker(double timeout_seconds);
  void send(const Json& message);
  void send_prepared(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared);
  Attempt attempt(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared);
  bool take(const Json& message, Attempt& attempt);  // true: the trial has ended
  void take_done(const Json& done, Attempt& attempt);
  void end_by(Attempt& attempt, const std::string& end, const std::string& message);
  void take_death(Attempt& attempt);
  std::string memory_message(const Attempt& attempt) const;
  std::optional<Json> receive(Attempt& attempt);
  bool holds_too_much() const;

  const PreparedPlan& plan_;
  const LibraryHashes& hashes_;
  std::vector<std::string> program_;
  Limits limits_;
  WorkerOptions options_;
  std::optional<plugin_host::ChildProcess> child_;
  std::set<Group> sent_;       // groups whose pretrained data the worker has
  std::size_t trials_ = 0;     // started by this worker
  std::string printed_;        // output of the worker during this trial
  std::size_t cut_bytes_ = 0;  // of this output
};

}  // namespace relign::runner
