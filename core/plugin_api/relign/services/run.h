/*
 * relign/services/run.h: "relign.run/1" runs another algorithm for some steps of this trial's budget, from the current
 * pose (hand-over). Offered if the manifest has a parameter of type "algorithm". The rules of all services are in
 * relign/plugin.h.
 */
#ifndef RELIGN_SERVICES_RUN_H
#define RELIGN_SERVICES_RUN_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_RUN "relign.run/1"
enum {
  RELIGN_RUN_STEPS_SPENT = 0, /* it used the steps it was granted, or the trial's last ones */
  RELIGN_RUN_FINISHED = 1     /* it returned earlier */
};

typedef struct relign_observation relign_observation; /* in relign/plugin.h */

/* Poses are commanded poses (axes values) of the caller's own trial. Pointers are valid until the next call of step,
 * move or run. */
typedef struct relign_run_outcome {
  uint32_t struct_size;
  uint32_t steps; /* used of the budget */
  int32_t end;    /* RELIGN_RUN_*; meaningless unless run returned RELIGN_OK */
  uint32_t reserved;
  const relign_observation* last; /* the current pose, as the caller's own step would have returned it */
  const relign_observation* best; /* lowest merit of those steps and of the pose before them, without image unless
                                     it is the last; null unless the caller is granted RELIGN_OBSERVES_MERIT */
  const double* recommendation;   /* of the inner algorithm; null when it made none. It counts only when the caller
                                     repeats it with relign_trial::recommend */
} relign_run_outcome;

typedef struct relign_run_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* parameter: name of the caller's parameter that selects the algorithm. parameters_json: an object of changes to the
   * parameters of that algorithm, empty text for none. most_steps: at least 1.
   *
   * The inner algorithm drives a trial of its own: its step 0 is the last capture, its budget is most_steps or what is
   * left, its commanded coordinates are relative to the current pose unless both observe the start, and it is granted
   * only what both manifests declare. Stage, clocks and records are the caller's.
   *
   * Writes the outcome, up to its struct_size. RELIGN_STOP: no step was left, nothing was run. RELIGN_FAILED: the inner
   * algorithm failed; the outcome has the steps it made. RELIGN_BAD_ARGUMENT: no such parameter or unusable changes;
   * nothing was run. [run-thread] */
  relign_status (*run)(void* context, relign_text parameter, relign_text parameters_json, uint32_t most_steps,
                       relign_run_outcome* outcome);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_run_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_RUN_H */
