// The worker's side of a run: a process that is told what to do line by line (worker_process.h is the other side).
//
// Lines are JSON, and private to one version of the program: both sides are the same file.
//   in:  {"setup": {...}}                       once, first                 worker_plan.h, threads, folders, memory
//   limit
//        {"prepared": {...}}                    before trials that load it
//        {"prepare": {"trial": {...}, "scene_data": "..."}}  the algorithm of this trial
//        {"trial": {...}}
//        {"stop": true}                         no step begins after it
//   out: {"ready": true}
//        {"begun": {"own_optimum_mse": 0.1, "own_optimum_pose": [...]}}  the lens is mounted: the trial's time counts
//        {"message": "..."}                     for the user
//        {"source": true}                       preparing: one more source is done
//        {"entries": {...}}                     size and digest of what was prepared, which is in the journal
//        {"done": {...}}                        closing line, size and digest of the journal, times
//        {"runaway": true}                      the algorithm will never return: the worker wants to be ended
//        {"error": {"kind": 1, "text": "..."}}  concerns more than the trial
// Steps go into the journal (trial_journal.h). When the other side closes the connection, the worker ends, and with it
// all that it started.
#pragma once

#include <chrono>

namespace relign::runner {

// Both sides' times of messages: seconds of a clock that all processes of a machine share.
inline double clock_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Serves until the connection is closed; the exit status.
int run_worker();

}  // namespace relign::runner
