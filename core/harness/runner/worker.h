// The worker's side of a run: a process that executes requests, one per line (worker_process.h is the other side).
//
// Lines are JSON, and private to one version of the program: both sides are the same executable.
//   in:  {"setup": {...}}                       once, first: worker_plan.h, threads, folders, memory limit
//        {"prepared": {...}}                    pretrained data, before the trials that load them
//        {"prepare": {"trial": {...}, "scene_data": "..."}}  pretrain the algorithm of this trial
//        {"trial": {...}}
//        {"stop": true}                         start no further step
//   out: {"ready": true}
//        {"begun": "..."}                       closing line, of a lens that is mounted: the trial's clock starts
//        {"message": "..."}                     for the user
//        {"source": true}                       pretraining: one more source is done
//        {"entries": {...}}                     size and digest of the pretrained data, which are in the journal
//        {"done": {...}}                        closing line, size and digest of the journal, times
//        {"runaway": true}                      the algorithm will not return: end the worker
//        {"error": {"kind": 1, "text": "..."}}  a failure that concerns more than the trial
// Steps go into the journal (trial_journal.h). When the coordinator closes the connection, the worker ends itself and
// every process that it started.
#pragma once

#include <chrono>

namespace relign::runner {

// Time stamps of messages: seconds of a clock that all processes of a machine share.
inline double clock_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Serves until the connection is closed. Returns the exit status.
int run_worker();

}  // namespace relign::runner
