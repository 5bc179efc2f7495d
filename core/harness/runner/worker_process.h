// A worker that is a process (worker.h): what a plugin does there ends its trial, not the run.
//
//   it crashes or leaves the process         crashed(SIGSEGV), crashed(exit 0)
//   it takes longer than a trial may         timeout
//   it takes more memory than a trial may    out_of_memory
//   it writes into our connection            protocol_error
//   it never stops asking for steps          overspent
// The steps finished before are kept. What a trial is blamed for must be its own doing: a crash in a worker that had
// other trials before counts only when it happens again in a new one. A worker that somebody else killed (SIGKILL: a
// person, a system short of memory) is lost, and its trial runs again, at most twice.
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
    double trial_seconds = 3600;   // of a trial, and before it of making its scene and lens
    std::size_t memory_bytes = 0;  // of the worker and what it starts; 0: no limit
    std::size_t spare_bytes = 0;   // a worker that holds more after a trial is replaced; 0: never
  };
  // `program` runs run_worker().
  ProcessWorker(const PreparedPlan& plan, const LibraryHashes& hashes, std::vector<std::string> program, Limits limits,
                WorkerOptions options);
  ~ProcessWorker() override;
  WorkedTrial run(const suites::PlannedTrial& trial, const Preparer::Entries* prepared) override;
  // What the trial's algorithm loads: from the cache, or made there, each source within the limits of a trial. What
  // ends the worker is a failure in the entries, as in Preparer::prepare. Throws Error as that does.
  Preparer::Entries prepare(const suites::PlannedTrial& trial);

 private:
  enum class Fate { finished, blamed, lost, stopped };
  struct Attempt;
  using Group = std::tuple<std::size_t, std::size_t, std::size_t>;

  void start();
  bool started();
  void stop_worker(double patience_seconds);
  void send(const Json& message);
  void send_prepared(const suites::PlannedTrial& trial, const Preparer::Entries* prepared);
  Attempt attempt(const suites::PlannedTrial& trial, const Preparer::Entries* prepared);
  bool take(const Json& message, Attempt& attempt);  // true: the trial is over
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
  std::set<Group> told_;       // whose prepared data the worker has
  std::size_t trials_ = 0;     // that the worker has begun
  std::string printed_;        // by the worker during this trial
  std::size_t cut_bytes_ = 0;  // of it
};

}  // namespace relign::runner
