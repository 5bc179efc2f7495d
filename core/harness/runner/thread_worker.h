// Runs trials in this process, for debuggers (`--isolation none`): a plugin that crashes or hangs ends the run.
#pragma once

#include "runner/trial_runner.h"
#include "runner/trial_worker.h"

namespace relign::runner {

class ThreadWorker final : public TrialWorker {
 public:
  ThreadWorker(const PreparedPlan& plan, WorkerOptions options);
  WorkedTrial run(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared) override;

 private:
  const PreparedPlan& plan_;
  WorkerOptions options_;
  TrialRunner runner_;
};

}  // namespace relign::runner
